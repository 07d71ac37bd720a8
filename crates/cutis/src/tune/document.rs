//! What a calibration found: the document that is printed, and written as JSON.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Demand, Omission, ReferenceReport, Setting};
use crate::report::{Backend, Machine, Stage};
use crate::{CostReport, Error};

/// Version of the layout of a calibration; the number grows when a key changes its meaning or goes.
pub const SCHEMA: &str = "cutis-tune/1";
/// Why a candidate was not run, if that is why.
pub(super) const NO_TIME_LEFT: &str = "not run, no time left (--minutes)";

/// A calibration.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Tuning {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of this program.
    pub cutis_version: String,
    /// Machine that it ran on.
    pub machine: Machine,
    /// What the candidates ran on.
    pub backend: Backend,
    /// Frames of a run.
    pub frames: u32,
    /// What was asked for.
    pub demand: Demand,
    /// What the candidates were measured against.
    pub reference: ReferenceReport,
    /// All settings that were thought of, by the cost that was expected.
    pub candidates: Vec<Candidate>,
    /// The one to take; none if none meets the demand.
    pub picked: Option<Candidate>,
    /// The tuned copy of the scene; none if no setting meets the demand.
    pub scene_file: Option<PathBuf>,
    /// Bytes and time of the picked setting by part; no parts if none was picked.
    #[serde(rename = "ledger")]
    pub costs: CostReport,
    /// What can be left out, and what that saves and changes; empty if it was not measured.
    pub omissions: Vec<Omission>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Time that it took, by stage.
    pub stages: Vec<Stage>,
}

/// A setting and what was found of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Candidate {
    /// The setting.
    pub setting: Setting,
    /// Wall time of a frame that was expected before, ms.
    pub expected_ms: f64,
    /// Mean wall time of the frames that were run, ms; none if it was not run.
    pub ms_per_frame: Option<f64>,
    /// RMS distance of the positions from the reference at the end over the RMS displacement of the reference, over the vertices that
    /// can move; none if it did not get there.
    pub error: Option<f64>,
    /// Opening of each wound: what it opens by and how that differs from the reference; empty if it did not get there.
    pub wounds: Vec<WoundError>,
    /// Whether no other measured setting is as cheap and as near.
    pub pareto: bool,
    /// Whether it is the scene's own.
    pub own: bool,
    /// Why it was not run, or not to the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub abandoned: Option<String>,
}

/// How a wound opened, against the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WoundError {
    /// What it opened by, mm: mean distance of its lips, at the end less at the start.
    pub growth_mm: f64,
    /// That, less what it opens by in the reference, mm.
    pub difference_mm: f64,
    /// The same in percent of what it opens by in the reference; none where that is nothing but rounding.
    pub difference_percent: Option<f64>,
}

impl Candidate {
    /// A candidate that was not run yet.
    pub(super) fn planned(setting: Setting, expected_ms: f64) -> Self {
        Self {
            setting,
            expected_ms,
            ms_per_frame: None,
            error: None,
            wounds: Vec::new(),
            pareto: false,
            own: false,
            abandoned: None,
        }
    }
}

impl WoundError {
    /// Against what is expected; `rounding_mm` of it is nothing.
    pub(super) fn of(growth_mm: f64, expected_mm: f64, rounding_mm: f64) -> Self {
        let difference_mm = growth_mm - expected_mm;
        let opens = expected_mm.abs() > rounding_mm;
        let difference_percent = opens.then(|| 100.0 * difference_mm / expected_mm.abs());
        Self { growth_mm, difference_mm, difference_percent }
    }
}

impl Tuning {
    /// What is promised of a setting, in a line.
    pub(super) fn promise(&self, picked: &Candidate) -> String {
        let percent = |share: Option<f64>| 100.0 * share.unwrap_or(f64::NAN);
        let processor = match &self.backend.adapter {
            Some(adapter) => adapter.clone(),
            None => format!("{}, {} threads", self.machine.cpu, self.backend.threads),
        };
        format!(
            "Tuned by cutis {}: error {:.2} % (reference within {:.2} %), {:.1} ms per frame on {} ({processor}).",
            self.cutis_version,
            percent(picked.error),
            100.0 * self.reference.error,
            picked.ms_per_frame.unwrap_or(f64::NAN),
            self.backend.name,
        )
    }

    /// The error of a calibration in which no setting meets the demand.
    pub fn unmet(&self) -> Option<Error> {
        let measured = |candidate: &&Candidate| candidate.error.is_some();
        let best = self
            .candidates
            .iter()
            .filter(measured)
            .min_by(|a, b| a.error.unwrap_or(f64::INFINITY).total_cmp(&b.error.unwrap_or(f64::INFINITY)));
        let nearest = best.map_or("none was measured to the end".into(), |best| {
            format!(
                "the nearest of those measured, {}, has an error of {:.2} % and takes {:.1} ms per frame",
                best.setting,
                100.0 * best.error.unwrap_or(f64::NAN),
                best.ms_per_frame.unwrap_or(f64::NAN)
            )
        });
        let own = self.candidates.iter().find(|candidate| candidate.own);
        let coarse = own.and_then(|own| self.reference.coarse(own.setting));
        let needed = self.needed();
        let nearest: Vec<String> = coarse.into_iter().chain([nearest]).chain(needed).collect();
        self.picked
            .is_none()
            .then(|| Error::NoSetting { demand: self.demand.to_string(), nearest: nearest.join("; ") })
    }

    /// Where the demand is an error and what was picked does not have it: what would.
    pub(super) fn needed(&self) -> Option<String> {
        let demanded = self.demand.error()?;
        let error = self.picked.as_ref().and_then(|picked| picked.error);
        let short = error.is_none_or(|error| error + self.reference.error > demanded);
        let left_out = |candidate: &&Candidate| candidate.abandoned.as_deref() == Some(NO_TIME_LEFT);
        let late = self.candidates.iter().filter(left_out).count();
        let late = (late > 0).then(|| format!("{late} settings were not run for want of time (--minutes)"));
        let substeps = self.reference.substeps_for(demanded).map(|substeps| {
            format!(
                "by the reference, xpbd with one iteration needs about {substeps} substeps a frame for an error of {} %",
                100.0 * demanded
            )
        });
        let lines: Vec<String> = substeps.into_iter().chain(late).collect();
        (short && !lines.is_empty()).then(|| lines.join("; "))
    }

    /// JSON schema of a calibration.
    pub fn json_schema() -> serde_json::Value {
        schemars::schema_for!(Tuning).to_value()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wound_that_does_not_open_has_no_percentage() {
        let percent = |growth, expected| WoundError::of(growth, expected, 1e-4).difference_percent;
        assert_eq!(percent(1.5, -1.0), Some(250.0));
        for expected in [0.0, 1e-5, -1e-5] {
            assert_eq!((percent(0.5, expected), percent(0.0, expected)), (None, None));
        }
        let json = serde_json::to_value(WoundError::of(0.5, 0.0, 0.0)).unwrap();
        assert!(json["difference_percent"].is_null() && json["difference_mm"] == 0.5, "{json}");
    }
}
