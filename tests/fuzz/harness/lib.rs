//! Damaged and hostile inputs for every reader of files. A generator with a seed changes valid
//! files, and a reader must end with a value or a typed error, in bounded time and memory.
//!
//! `cargo xtask fuzz` runs it. The inputs are the same for the same seed and number of inputs. The
//! targets of cargo-fuzz in `libfuzzer` have the same readers, limits and valid files.

mod campaign;
mod libfuzzer;
mod memory;
mod mutate;
mod packed;
mod seeds;
mod targets;
#[cfg(test)]
mod tests;

pub use campaign::{Campaign, Fault, Limits, run, run_input};
pub use libfuzzer::{require_no_fault, write_corpus};
pub use targets::{TARGETS, Target, find};
