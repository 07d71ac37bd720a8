//! Reference solutions for measuring the errors of a solver: implicit steps and static equilibria
//! of a body, by Newton's method in double precision with a sparse direct solver.
//!
//! A [`Problem`] takes the energies `½C²/α`, the masses and the positions from a system of
//! `cutis-solver`. It shares no stepping code with the solvers. [`Problem::step`] finds the
//! minimizer of an implicit Euler step, which XPBD approaches with its iterations.
//! [`Problem::equilibrium`] finds the state of rest. [`relative_rms`] measures the distance of a
//! solver's result from either.
#![forbid(unsafe_code)]

mod derivatives;
mod dissection;
mod elements;
mod error;
mod field;
mod floating;
mod hessian;
mod newton;
mod objective;
mod options;
mod pattern;
mod problem;

pub use derivatives::Derivatives;
pub use error::NewtonError;
pub use options::{Minimum, Options, relative_rms};
pub use problem::Problem;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
