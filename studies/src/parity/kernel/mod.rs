//! The middle ring: one pass of each kernel, run on its own.

mod descent;
mod handles;
mod raymarch;
mod reduction;
mod relax;
mod resample;
mod sweep;
mod vertices;

use super::bench::{Bench, Failure};
use anyhow::bail;

/// Runs the ring.
pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    sweep::run(bench)?;
    descent::run(bench)?;
    vertices::run(bench)?;
    handles::run(bench)?;
    reduction::run(bench)?;
    resample::run(bench)?;
    raymarch::run(bench)?;
    relax::run(bench)
}

/// A shader's source with one part, which must occur, replaced by another.
fn replaced(source: &str, from: &str, to: &str) -> Result<String, Failure> {
    match source.contains(from) {
        true => Ok(source.replace(from, to)),
        false => bail!("the control changes nothing: the shader has no `{from}`"),
    }
}
