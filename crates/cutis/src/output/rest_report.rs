//! The state of rest in the report.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a state of rest was found (`run.until = "rest"`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RestReport {
    /// Estimate of the distance from the equilibrium over the displacement to it.
    pub error: f64,
    /// Norm of the forces that are left over the norm of all forces.
    pub force: f64,
    /// Wall time, ms.
    pub ms: f64,
    /// Newton steps.
    pub steps: Vec<RestStep>,
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

impl RestReport {
    /// The report of a search whose time is not known yet.
    pub(crate) fn of(rest: &cutis_rest::Rest) -> Self {
        let step = |step: &cutis_rest::Step| RestStep {
            force: step.force,
            moved_mm: 1e3 * step.moved_m,
            cycles: step.cycles,
            error: step.error.is_finite().then_some(step.error),
        };
        Self { error: rest.error, force: rest.force, ms: 0.0, steps: rest.steps.iter().map(step).collect() }
    }

    /// One line for people.
    #[must_use]
    pub fn summary(&self) -> String {
        let cycles: usize = self.steps.iter().map(|step| step.cycles).sum();
        format!(
            "at rest, with an estimated error of {:.2} % of the displacement: {} steps, {cycles} multigrid cycles, {:.1} s",
            100.0 * self.error,
            self.steps.len(),
            1e-3 * self.ms
        )
    }
}
