//! The outer ring: whole runs of the pipeline on both backends, a state of rest, and conserved
//! quantities of long runs.

mod cases;
mod checkpoint;
mod long;
mod pipeline;
mod rest;

use super::bench::{Bench, Failure};

/// Runs the ring.
pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    for case in cases::all(bench.effort)? {
        pipeline::compare(bench, &case)?;
    }
    rest::compare(bench)?;
    long::run(bench)
}
