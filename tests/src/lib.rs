//! Scenes shared by tests and benches, and what is measured: the comparison of the backends, error against run time.

pub mod accuracy;
pub mod cantilever;
pub mod chainmail;
#[path = "../../crates/cutis-solver-cpu/tests/lattice/mod.rs"]
pub mod lattice;
mod origin;
pub mod parity;
pub mod sheet;
pub mod stability;
mod worst;
