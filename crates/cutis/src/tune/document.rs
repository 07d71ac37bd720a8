//! The result of tuning, printed as tables or JSON.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Demand, Omission, ReferenceReport, RegionTrial, RestTrial, Setting};
use crate::report::{Backend, Machine, Stage};
use crate::{CostReport, Error};

/// Version of the JSON layout. It grows when a key disappears or changes its meaning.
pub const SCHEMA: &str = "cutis-tune/1";
/// Reason of a candidate that was skipped for lack of time.
pub(super) const NO_TIME_LEFT: &str = "not run, no time left (--minutes)";

/// Result of tuning a scene.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Tuning {
    /// Always [`SCHEMA`].
    pub schema: String,
    /// Version of this program.
    pub cutis_version: String,
    /// The machine.
    pub machine: Machine,
    /// Backend of the candidates.
    pub backend: Backend,
    /// Frames per run.
    pub frames: u32,
    /// Target for the setting.
    pub demand: Demand,
    /// The reference that the candidates were compared with.
    pub reference: ReferenceReport,
    /// All candidate settings, by expected cost.
    pub candidates: Vec<Candidate>,
    /// The picked setting; none if no setting meets the target.
    pub picked: Option<Candidate>,
    /// The state of rest, which a search finds without frames.
    #[serde(default)]
    pub rest: RestTrial,
    /// The tuned copy of the scene; none if no setting meets the target.
    pub scene_file: Option<PathBuf>,
    /// Bytes and time of the picked setting by part; no parts if none was picked.
    #[serde(rename = "ledger")]
    pub costs: CostReport,
    /// Regions of interest that were tried; empty if none was.
    #[serde(default)]
    pub regions: Vec<RegionTrial>,
    /// The ablation: the scene without each of its parts; empty if it was not measured.
    pub omissions: Vec<Omission>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Wall time by stage.
    pub stages: Vec<Stage>,
}

/// A setting and its measured cost and error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Candidate {
    /// The setting.
    pub setting: Setting,
    /// Expected wall time per frame, ms.
    pub expected_ms: f64,
    /// Mean measured wall time per frame, ms; none if the setting was not run.
    pub ms_per_frame: Option<f64>,
    /// RMS position error over RMS displacement, at the last frame, over the movable vertices; none
    /// if the run did not reach it.
    pub error: Option<f64>,
    /// Growth of each wound and its difference from the reference; empty if the run did not reach
    /// the last frame.
    pub wounds: Vec<WoundError>,
    /// True on the Pareto front of time and error.
    pub pareto: bool,
    /// True for the scene's own setting.
    pub own: bool,
    /// Reason if the run was skipped or stopped early.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub abandoned: Option<String>,
}

/// Growth of a wound compared with the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WoundError {
    /// Growth, mm: mean distance of the lips at the end minus that at the start.
    pub growth_mm: f64,
    /// Growth minus the growth in the reference, mm.
    pub difference_mm: f64,
    /// The difference in percent of the growth in the reference; none if that is only rounding.
    pub difference_percent: Option<f64>,
}

impl Candidate {
    /// A candidate before its run.
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
    /// Compares a growth with the expected one. Growths up to `rounding_mm` count as zero.
    pub(super) fn of(growth_mm: f64, expected_mm: f64, rounding_mm: f64) -> Self {
        let difference_mm = growth_mm - expected_mm;
        let opens = expected_mm.abs() > rounding_mm;
        let difference_percent = opens.then(|| 100.0 * difference_mm / expected_mm.abs());
        Self { growth_mm, difference_mm, difference_percent }
    }
}

impl Tuning {
    /// The region in the tuned scene; none if it has the whole body, or the scene's own region.
    pub fn region(&self) -> Option<&RegionTrial> {
        self.regions.iter().find(|trial| trial.picked)
    }

    /// One line that states the error and time of the picked setting.
    pub(super) fn promise(&self, picked: &Candidate) -> String {
        let percent = |share: Option<f64>| 100.0 * share.unwrap_or(f64::NAN);
        let processor = match &self.backend.adapter {
            Some(adapter) => adapter.clone(),
            None => format!("{}, {} threads", self.machine.cpu, self.backend.threads),
        };
        format!(
            "Tuned by cutis {}: error {:.2} % (uncertainty of the reference {:.2} %), {:.1} ms per frame on {} ({processor}).",
            self.cutis_version,
            percent(picked.error),
            100.0 * self.reference.error,
            picked.ms_per_frame.unwrap_or(f64::NAN),
            self.backend.name,
        )
    }

    /// The error to return if no setting meets the target.
    pub fn unmet(&self) -> Option<Error> {
        let measured = |candidate: &&Candidate| candidate.error.is_some();
        let best = self
            .candidates
            .iter()
            .filter(measured)
            .min_by(|a, b| a.error.unwrap_or(f64::INFINITY).total_cmp(&b.error.unwrap_or(f64::INFINITY)));
        let nearest = best.map_or("no setting was measured to the end".into(), |best| {
            format!(
                "the most accurate setting, {}, has an error of {:.2} % and takes {:.1} ms per frame",
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

    /// Advice on how to meet the target error, if the picked setting does not meet it.
    pub(super) fn needed(&self) -> Option<String> {
        let demanded = self.demand.error()?;
        let error = self.picked.as_ref().and_then(|picked| picked.error);
        let short = error.is_none_or(|error| error + self.reference.error > demanded);
        let no_time = |candidate: &&Candidate| candidate.abandoned.as_deref() == Some(NO_TIME_LEFT);
        let late = self.candidates.iter().filter(no_time).count();
        let late = (late > 0).then(|| format!("{late} settings were not run for lack of time (--minutes)"));
        let substeps = self.reference.substeps_for(demanded).map(|substeps| {
            format!(
                "according to the reference, xpbd with one iteration needs about {substeps} substeps a frame for an error of {} %",
                100.0 * demanded
            )
        });
        let lines: Vec<String> = substeps.into_iter().chain(late).collect();
        (short && !lines.is_empty()).then(|| lines.join("; "))
    }

    /// JSON schema of the result.
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
