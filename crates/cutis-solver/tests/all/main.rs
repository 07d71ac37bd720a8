//! Integration tests of the solver.

mod change;
mod descent;
mod loads;
mod resting;
mod validation;
