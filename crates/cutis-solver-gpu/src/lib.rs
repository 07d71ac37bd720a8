//! GPU backend of the solver.
#![forbid(unsafe_code)]
