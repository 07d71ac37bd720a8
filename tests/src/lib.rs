//! Scenes shared by tests and benches.

#[path = "../../crates/cutis-solver-cpu/tests/lattice/mod.rs"]
pub mod lattice;
pub mod sheet;
