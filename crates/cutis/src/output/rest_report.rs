//! The state of rest in the report.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::fixed;

/// How a state of rest was found (`run.until = "rest"`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RestReport {
    /// Estimate of the distance from the equilibrium over the displacement to it.
    pub error: f64,
    /// Norm of the forces that are left over the norm of all forces.
    pub force: f64,
    /// Wall time, ms.
    pub ms: f64,
    /// Where the equations of the steps were solved: `cpu`, or `gpu` for the device of the backend.
    /// The CPU computed forces and matrices.
    #[serde(default = "cpu")]
    pub equations_on: String,
    /// Newton steps.
    pub steps: Vec<RestStep>,
}

/// Where reports before this key solved their equations.
fn cpu() -> String {
    "cpu".into()
}

/// A Newton step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RestStep {
    /// Relative force before the step.
    pub force: f64,
    /// Displacement in the step, root of the mean square, mm.
    pub moved_mm: f64,
    /// Multigrid cycles.
    pub cycles: usize,
    /// Estimate of the distance from the equilibrium after the step, over the displacement to it.
    /// None before it is known.
    pub error: Option<f64>,
}

/// A state of rest between the things that are done to the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StopReport {
    /// Time in the scene, s.
    pub time_s: f64,
    /// What was done since the state before, as `steps` names it. Empty in the first state.
    pub done: Vec<String>,
    /// Mean opening of each wound, mm.
    pub mean_mm: Vec<f64>,
    /// Opening of each wound in its middle, mm.
    pub mid_mm: Vec<f64>,
    /// Sum of the forces in the threads of each suture, N.
    pub sutures_n: Vec<f64>,
    /// Size of the force of each handle, N.
    pub handles_n: Vec<f64>,
    /// Estimate of the distance from the equilibrium over the displacement to it from the state
    /// before.
    pub error: f64,
    /// Newton steps.
    pub steps: usize,
    /// Multigrid cycles.
    pub cycles: usize,
    /// Wall time, ms.
    pub ms: f64,
}

impl StopReport {
    /// One line for people.
    #[must_use]
    pub fn summary(&self) -> String {
        let done =
            if self.done.is_empty() { "before".into() } else { format!("after {}", self.done.join(", ")) };
        let list = |values: &[f64], unit: &str| {
            let values: Vec<String> =
                values.iter().map(|&value| format!("{} {unit}", fixed(value, 2))).collect();
            values.join(", ")
        };
        let parts = [
            ("openings", list(&self.mid_mm, "mm")),
            ("sutures", list(&self.sutures_n, "N")),
            ("handles", list(&self.handles_n, "N")),
        ];
        let parts: Vec<String> = parts
            .iter()
            .filter(|(_, values)| !values.is_empty())
            .map(|(name, values)| format!("{name} {values}"))
            .collect();
        format!(
            "{:.3} s, {done}: {} (error {:.2} %, {:.1} s)",
            self.time_s,
            parts.join("; "),
            100.0 * self.error,
            1e-3 * self.ms
        )
    }
}

impl RestReport {
    /// The report of a search that took `ms` and solved its equations on `place`.
    pub(crate) fn of(rest: &cutis_rest::Rest, ms: f64, place: &str) -> Self {
        let step = |step: &cutis_rest::Step| RestStep {
            force: step.force,
            moved_mm: 1e3 * step.moved_m,
            cycles: step.cycles,
            error: step.error.is_finite().then_some(step.error),
        };
        let steps = rest.steps.iter().map(step).collect();
        Self { error: rest.error, force: rest.force, ms, equations_on: place.into(), steps }
    }

    /// Multigrid cycles of all steps.
    pub(crate) fn cycles(&self) -> usize {
        self.steps.iter().map(|step| step.cycles).sum()
    }

    /// One line for people.
    #[must_use]
    pub fn summary(&self) -> String {
        format!(
            "at rest, with an estimated error of {} % of the displacement: {} steps, {} multigrid cycles{}, {:.1} s",
            percent(self.error),
            self.steps.len(),
            self.cycles(),
            if self.equations_on == "gpu" { " on the GPU" } else { "" },
            1e-3 * self.ms
        )
    }
}

/// An estimated error in percent, as text: `0.28`. An estimate is never zero.
pub(crate) fn percent(error: f64) -> String {
    let percent = 100.0 * error;
    if percent < 0.01 { "less than 0.01".to_owned() } else { format!("{percent:.2}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_error_is_not_called_zero() {
        let texts = [0.0028, 1e-4, 0.99e-4, 0.0].map(percent);
        assert_eq!(texts, ["0.28", "0.01", "less than 0.01", "less than 0.01"]);
    }
}
