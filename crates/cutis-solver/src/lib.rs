//! cutis-solver
