//! Integration tests of resampling.

mod bodies;
mod displacement;
mod errors;
#[cfg(feature = "gpu")]
mod gpu;
mod identities;
mod updates;
mod walls;
