//! Integration tests of pictures.

#[cfg(feature = "gpu")]
mod gpu;
mod lines;
mod paths;
mod pictures;
