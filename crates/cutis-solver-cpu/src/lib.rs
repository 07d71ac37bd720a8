//! cutis-solver-cpu
