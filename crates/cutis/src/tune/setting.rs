//! Solver settings, their expected cost, and the list of candidates.

use cutis_solver::{Formulation, Settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::scene::SolverSection;

/// Over-relaxation of vertex block descent with several iterations. A single iteration has none.
const RELAXATION: f64 = 1.3;

/// The values that are tuned: formulation, substeps and iterations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Setting {
    /// `xpbd` or `vbd`.
    pub formulation: Formulation,
    /// Substeps per frame.
    pub substeps: u32,
    /// Iterations per substep.
    pub iterations: u32,
    /// Over-relaxation of `vbd`; 1 with `xpbd`.
    pub relaxation: f64,
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = match self.formulation {
            Formulation::Pbd => "pbd",
            Formulation::Xpbd => "xpbd",
            Formulation::Vbd => "vbd",
        };
        write!(f, "{name} {} x {}", self.substeps, self.iterations)?;
        if self.relaxation == 1.0 { Ok(()) } else { write!(f, ", {}", self.relaxation) }
    }
}

impl Setting {
    /// The setting of a scene.
    pub(super) fn of(solver: &SolverSection) -> Self {
        let SolverSection { formulation, substeps, iterations, relaxation, .. } = *solver;
        Self { formulation, substeps, iterations, relaxation }
    }

    /// XPBD with one iteration per substep.
    pub(super) fn xpbd(substeps: u32) -> Self {
        Self { formulation: Formulation::Xpbd, substeps, iterations: 1, relaxation: 1.0 }
    }

    fn vbd(substeps: u32, iterations: u32) -> Self {
        let relaxation = if iterations > 1 { RELAXATION } else { 1.0 };
        Self { formulation: Formulation::Vbd, substeps, iterations, relaxation }
    }

    /// A copy of `solver` with this setting.
    pub(super) fn applied_to(self, solver: &SolverSection) -> SolverSection {
        let Self { formulation, substeps, iterations, relaxation } = self;
        SolverSection { formulation, substeps, iterations, relaxation, ..solver.clone() }
    }

    /// A copy of the solver's settings with this setting.
    pub(super) fn settings(self, others: &Settings) -> Settings {
        let Self { formulation, substeps, iterations, relaxation } = self;
        Settings { formulation, substeps, iterations, relaxation, ..*others }
    }

    /// Sweeps over all constraints per frame; saturates.
    pub(super) fn sweeps(self) -> u32 {
        self.substeps.saturating_mul(self.iterations)
    }
}

/// Expected cost of settings, linear in substeps and iterations, from measured substeps.
#[derive(Clone, Copy, Debug)]
pub(super) struct CostModel {
    pub(super) xpbd: LinearCost,
    pub(super) vbd: LinearCost,
}

/// Cost of a formulation.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearCost {
    /// Cost of a substep, ms.
    pub(super) substep_ms: f64,
    /// Cost of an iteration, ms.
    pub(super) iteration_ms: f64,
}

impl CostModel {
    /// Expected time of a frame, ms.
    pub(super) fn frame_ms(&self, setting: Setting) -> f64 {
        let line = match setting.formulation {
            Formulation::Vbd => self.vbd,
            Formulation::Pbd | Formulation::Xpbd => self.xpbd,
        };
        f64::from(setting.substeps) * line.substep_ms + f64::from(setting.sweeps()) * line.iteration_ms
    }
}

/// The scene's own setting and the settings expected to take at most `most_ms`, cheapest first.
///
/// XPBD: one iteration, with substeps growing by √2 up to `most_substeps`; 2 and 4 iterations, with
/// substeps growing by 4. Vertex block descent: one iteration, with substeps growing by 2; 2 to 16
/// iterations, with substeps growing by 4.
pub(super) fn candidates(own: Setting, most_substeps: u32, most_ms: f64, model: &CostModel) -> Vec<Setting> {
    let powers = |root: f64| {
        let power = move |n: i32| root.powi(n).round() as u32;
        let mut list: Vec<u32> = (0..64).map(power).take_while(|&n| n <= most_substeps).collect();
        list.dedup();
        list
    };
    let mut list: Vec<Setting> = powers(2_f64.sqrt()).into_iter().map(Setting::xpbd).collect();
    for iterations in [2, 4] {
        list.extend(
            powers(4.0).into_iter().map(|substeps| Setting { iterations, ..Setting::xpbd(substeps) }),
        );
    }
    list.extend(powers(2.0).into_iter().map(|substeps| Setting::vbd(substeps, 1)));
    for iterations in [2, 4, 8, 16] {
        list.extend(powers(4.0).into_iter().map(|substeps| Setting::vbd(substeps, iterations)));
    }
    list.retain(|&setting| setting != own && model.frame_ms(setting) <= most_ms);
    list.push(own);
    list.sort_by(|a, b| model.frame_ms(*a).total_cmp(&model.frame_ms(*b)));
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_are_sorted_by_cost_and_contain_the_scenes_own_setting_once() {
        let line = LinearCost { substep_ms: 1.0, iteration_ms: 3.0 };
        let model = CostModel { xpbd: line, vbd: LinearCost { iteration_ms: 10.0, ..line } };
        for own in [Setting::xpbd(8), Setting { iterations: 3, ..Setting::xpbd(130) }] {
            let list = candidates(own, 32, 100.0, &model);
            assert_eq!(list.iter().filter(|&&setting| setting == own).count(), 1);
            assert!(list.windows(2).all(|pair| model.frame_ms(pair[0]) <= model.frame_ms(pair[1])));
            assert!(list.iter().all(|&s| s == own || s.substeps <= 32 && model.frame_ms(s) <= 100.0));
            let single = |formulation| {
                let mut found: Vec<u32> = list
                    .iter()
                    .filter(|s| s.formulation == formulation && s.iterations == 1)
                    .map(|s| s.substeps)
                    .collect();
                found.sort();
                found
            };
            assert_eq!(single(Formulation::Xpbd), [1, 2, 3, 4, 6, 8, 11, 16, 23]);
            assert_eq!(single(Formulation::Vbd), [1, 2, 4, 8]);
            assert!(list.contains(&Setting::vbd(1, 8)) && !list.contains(&Setting::vbd(1, 16)));
        }
    }

    #[test]
    fn a_setting_prints_its_values() {
        assert_eq!(Setting::xpbd(20).to_string(), "xpbd 20 x 1");
        assert_eq!(Setting::vbd(2, 8).to_string(), "vbd 2 x 8, 1.3");
    }
}
