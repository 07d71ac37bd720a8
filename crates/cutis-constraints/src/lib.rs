//! Position-based constraints: what they measure, and nothing else.
//!
//! A [`Constraint`] supplies a value `C(x)` and its gradient `∇C(x)`. Mass, compliance, multiplier and time step
//! belong to the solver and never appear here.
#![forbid(unsafe_code)]

mod constraint;
mod real;

pub use constraint::{Constraint, Eval, Params};
pub use real::{Real, Scalar};
