//! Integration tests of the solver.

mod descent;
mod validation;
