//! The outer ring: whole runs of the pipeline on both backends, and conserved quantities of long
//! runs.

mod cases;
mod checkpoint;
mod long;
mod pipeline;

use super::bench::{Bench, Failure};

/// Runs the ring.
pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    for case in cases::all(bench.effort)? {
        pipeline::compare(bench, &case)?;
    }
    long::run(bench)
}
