//! Integration tests of resampling.

mod bodies;
mod errors;
#[cfg(feature = "gpu")]
mod gpu;
mod identities;
mod updates;
mod walls;
