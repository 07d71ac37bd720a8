//! Helpers that the tests and benches of several crates share: real CT volumes, GPU adapters,
//! random numbers and a small lattice. The kit depends on no crate that it helps to test, except
//! `cutis-gpu`.

#[cfg(feature = "gpu")]
pub mod gpu;
mod kuhn;
mod random;
pub mod scans;

pub use kuhn::Kuhn;
pub use random::Random;
