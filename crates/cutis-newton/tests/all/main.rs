//! Minimizers agree with closed forms, with finite differences and with a solver of another kind.

mod blocks;
mod closed_forms;
mod derivatives;
mod extremes;
mod hard;
mod refusals;
mod solver;
mod step;

/// The length scales of every problem. Results may not depend on the unit of length.
const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];

/// Fails unless `found` is within `tolerance` of `expected`, relative to `size`.
fn near(what: &str, found: f64, expected: f64, size: f64, tolerance: f64) -> Result<(), String> {
    let error = (found - expected).abs() / size;
    if error <= tolerance {
        Ok(())
    } else {
        Err(format!("{what} is {found:e} instead of {expected:e}: off by {error:e}"))
    }
}
