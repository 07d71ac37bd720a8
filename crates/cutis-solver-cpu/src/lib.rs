//! Multi-threaded CPU backend.
//!
//! [`SolverCpu`] runs the same [`Simulation`](cutis_solver::Simulation) as the reference solver and spreads every
//! pass over threads: vertices in blocks, and the constraints of one color in chunks of a fixed size. Constraints of
//! one color share no vertex, so that the order among them does not matter: the result is the same bit for bit for
//! any number of threads, and equal to the reference in the same precision. Nothing is allocated inside a step.
#![forbid(unsafe_code)]

mod error;
mod parallel;
mod solver;

pub use error::CpuError;
pub use solver::SolverCpu;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
