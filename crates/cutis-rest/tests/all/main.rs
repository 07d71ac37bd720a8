//! The state of rest equals that of a direct solver, on any number of threads, and the number of
//! cycles hardly depends on the number of vertices.

mod blocks;
mod equilibria;
#[cfg(feature = "gpu")]
mod gpu;
mod refusals;
