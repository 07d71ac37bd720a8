//! The middle ring: single passes of each kernel.

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

/// The source of a shader with one part replaced.
///
/// # Errors
/// The part does not occur.
fn replaced(source: &str, from: &str, to: &str) -> Result<String, Failure> {
    match source.contains(from) {
        true => Ok(source.replace(from, to)),
        false => bail!("the control changes nothing: the shader has no `{from}`"),
    }
}
