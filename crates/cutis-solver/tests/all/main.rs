//! Integration tests of the solver.

mod descent;
mod loads;
mod validation;
