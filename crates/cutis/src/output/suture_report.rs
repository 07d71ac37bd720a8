//! What the report tells about sutures.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A suture after the last frame. In PBD there are no forces, and the list of sutures is empty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SutureReport {
    /// Number of the wound that it closes, from 0: incisions first, then excisions.
    pub wound: usize,
    /// Number of its stitches.
    pub stitches: usize,
    /// Sum of the forces in the threads after the last frame, N.
    pub force_n: f64,
    /// The same per length of the incision, or of the long axis of the excision, N/cm.
    pub force_n_per_cm: f64,
    /// Largest force in a thread after the last frame, N.
    pub largest_n: f64,
}

impl SutureReport {
    /// One line.
    pub fn summary(&self) -> String {
        let Self { wound, stitches, force_n, force_n_per_cm, largest_n } = self;
        format!(
            "suture of wound {wound}: {stitches} stitches hold {force_n:.2} N in all, \
             {force_n_per_cm:.2} N per cm, at most {largest_n:.2} N in one"
        )
    }
}
