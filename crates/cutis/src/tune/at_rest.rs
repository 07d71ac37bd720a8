//! The search for the state of rest, which needs no frames: its time, and how far the last frame of
//! the reference is from rest.

use std::time::Instant;

use cutis_rest::{Body, Options, RestError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::WoundError;
use super::bench::Bench;
use super::reference::Reference;
use crate::model::constraints::rest_options;
use crate::scene::Scene;

/// The state of rest, compared with the last frame of the reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RestTrial {
    /// Wall time of the search, ms.
    pub ms: Option<f64>,
    /// Error that the search states: distance from rest over the displacement, both as roots of
    /// mean squares. At most `run.error`, unless all forces cancel to single precision before.
    pub stated_error: Option<f64>,
    /// Distance from the reference at the last frame: RMS of the positions over RMS displacement.
    pub difference: Option<f64>,
    /// Growth of each wound, compared with the reference.
    pub wounds: Vec<WoundError>,
    /// Reason if there is no state of rest to compare with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skipped: Option<String>,
}

impl RestTrial {
    /// Searches for the state of rest of a scene.
    pub(super) fn run(bench: &Bench<'_>, scene: &Scene, reference: &Reference) -> Self {
        if !scene.handle.is_empty() {
            let why = "handles move the body in the frames";
            return Self { skipped: Some(why.into()), ..Self::default() };
        }
        let options = rest_options(scene.run.error);
        match Self::searched(bench, &options, reference) {
            Ok(trial) => trial,
            Err(error) => Self { skipped: Some(error.to_string()), ..Self::default() },
        }
    }

    fn searched(bench: &Bench<'_>, options: &Options, reference: &Reference) -> Result<Self, RestError> {
        let start = Instant::now();
        let body = Body::of(bench.system, bench.settings.gravity_m_s2)?;
        let rest = body.settle(options, &mut |_| ())?;
        let ms = 1e3 * start.elapsed().as_secs_f64();
        let field = bench.movable.field(&rest.positions);
        let limit = reference.at_end();
        let rounding_mm = 1e3 * bench.movable.rounding();
        let growths = bench.growths_mm(&rest.positions).into_iter().zip(&reference.report.growths_mm);
        Ok(Self {
            ms: Some(ms),
            stated_error: Some(rest.error),
            difference: Some(field.rms_to(limit) / limit.rms()),
            wounds: growths
                .map(|(growth, &expected)| WoundError::of(growth, expected, rounding_mm))
                .collect(),
            skipped: None,
        })
    }

    /// Advice to search for rest, if the frames end within `error` of it and take longer.
    pub(super) fn advice(&self, error: f64, frames_ms: f64) -> Option<String> {
        let (ms, difference) = (self.ms?, self.difference?);
        (difference <= error && ms < frames_ms).then(|| {
            format!(
                "the last frame is within {:.2} % of rest: `cutis settle` finds the state of rest in {:.1} s, \
                 and the frames of the picked setting take {:.1} s",
                100.0 * difference,
                1e-3 * ms,
                1e-3 * frames_ms
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_is_advised_where_it_answers_the_same_question_sooner() {
        let trial = RestTrial { ms: Some(2000.0), difference: Some(0.03), ..RestTrial::default() };
        let advice = trial.advice(0.05, 9000.0).unwrap();
        assert!(
            advice.contains("3.00 %") && advice.contains("2.0 s") && advice.contains("9.0 s"),
            "{advice}"
        );
        assert_eq!(trial.advice(0.02, 9000.0), None);
        assert_eq!(trial.advice(0.05, 1000.0), None);
        assert_eq!(RestTrial::default().advice(0.05, 9000.0), None);
    }
}
