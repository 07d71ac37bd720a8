//! Scenes shared by tests and benches, and the comparison of the backends.

#[path = "../../crates/cutis-solver-cpu/tests/lattice/mod.rs"]
pub mod lattice;
pub mod parity;
pub mod sheet;
