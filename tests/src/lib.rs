//! Scenes shared by tests and benches, and what is measured: the comparison of the backends, error against run time.

pub mod accuracy;
pub mod cantilever;
pub mod chainmail;
mod origin;
pub mod parity;
pub mod sheet;
pub mod stability;
mod worst;
