//! Multi-threaded CPU backend.
//!
//! [`SolverCpu`] runs the same [`Simulation`](cutis_solver::Simulation) as the reference solver and
//! distributes every pass over threads: vertices in blocks, and the constraints of one color in
//! chunks of a fixed size. Constraints of one color share no vertex, so that their order does not
//! matter. The result has the same bits for any number of threads, and the same bits as the
//! reference solver in the same precision. A step allocates no memory.
#![forbid(unsafe_code)]

mod error;
mod parallel;
mod solver;

pub use error::CpuError;
pub use solver::SolverCpu;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
