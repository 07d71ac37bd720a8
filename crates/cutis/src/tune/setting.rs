//! A way to step a scene in time, and the candidates among which a scene's setting is chosen.

use cutis_solver::{Formulation, Settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::scene::{FormulationChoice, SolverSection};

/// Over-relaxation of candidates in vertex block descent with several iterations; with one there is none.
const RELAXATION: f64 = 1.3;

/// What is tuned: how the constraints are solved, and how a frame is divided.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Setting {
    /// `xpbd` or `vbd`.
    pub formulation: FormulationChoice,
    /// Substeps of a frame.
    pub substeps: u32,
    /// Iterations of a substep.
    pub iterations: u32,
    /// Over-relaxation of `vbd`; 1 with `xpbd`.
    pub relaxation: f64,
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = match self.formulation {
            FormulationChoice::Pbd => "pbd",
            FormulationChoice::Xpbd => "xpbd",
            FormulationChoice::Vbd => "vbd",
        };
        write!(f, "{name} {} x {}", self.substeps, self.iterations)?;
        if self.relaxation == 1.0 { Ok(()) } else { write!(f, ", {}", self.relaxation) }
    }
}

impl Setting {
    /// The scene's own.
    pub(super) fn of(solver: &SolverSection) -> Self {
        let SolverSection { formulation, substeps, iterations, relaxation, .. } = *solver;
        Self { formulation, substeps, iterations, relaxation }
    }

    /// XPBD with one iteration.
    pub(super) fn xpbd(substeps: u32) -> Self {
        Self { formulation: FormulationChoice::Xpbd, substeps, iterations: 1, relaxation: 1.0 }
    }

    fn vbd(substeps: u32, iterations: u32) -> Self {
        let relaxation = if iterations > 1 { RELAXATION } else { 1.0 };
        Self { formulation: FormulationChoice::Vbd, substeps, iterations, relaxation }
    }

    /// A section with this setting and everything else as it was.
    pub(super) fn applied_to(self, solver: &SolverSection) -> SolverSection {
        let Self { formulation, substeps, iterations, relaxation } = self;
        SolverSection { formulation, substeps, iterations, relaxation, ..solver.clone() }
    }

    /// The same for the solver.
    pub(super) fn settings(self, others: &Settings) -> Settings {
        let formulation = match self.formulation {
            FormulationChoice::Pbd => Formulation::Pbd,
            FormulationChoice::Xpbd => Formulation::Xpbd,
            FormulationChoice::Vbd => Formulation::Vbd,
        };
        let Self { substeps, iterations, relaxation, .. } = self;
        Settings { formulation, substeps, iterations, relaxation, ..*others }
    }

    /// Sweeps of a frame over all constraints; the largest number where it is more.
    pub(super) fn sweeps(self) -> u32 {
        self.substeps.saturating_mul(self.iterations)
    }
}

/// What settings cost, from measured substeps: a straight line for each formulation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Model {
    pub(super) xpbd: Line,
    pub(super) vbd: Line,
}

/// What a formulation costs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// Of each substep, ms.
    pub(super) substep_ms: f64,
    /// Of each iteration, ms.
    pub(super) iteration_ms: f64,
}

impl Model {
    /// Milliseconds that a frame may be expected to take.
    pub(super) fn frame_ms(&self, setting: Setting) -> f64 {
        let line = match setting.formulation {
            FormulationChoice::Vbd => self.vbd,
            FormulationChoice::Pbd | FormulationChoice::Xpbd => self.xpbd,
        };
        f64::from(setting.substeps) * line.substep_ms + f64::from(setting.sweeps()) * line.iteration_ms
    }
}

/// Settings that are expected to take at most `most_ms`, and the scene's own, cheapest first: XPBD with one iteration and substeps
/// in steps of a factor of √2, up to `most_substeps`, and of 4 with 2 and 4 iterations; vertex block descent with 1 to 16
/// iterations and substeps in steps of a factor of 2 with one iteration and of 4 with more.
pub(super) fn candidates(own: Setting, most_substeps: u32, most_ms: f64, model: &Model) -> Vec<Setting> {
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
    fn candidates_are_sorted_by_cost_and_hold_the_scene_s_own_once() {
        let line = Line { substep_ms: 1.0, iteration_ms: 3.0 };
        let model = Model { xpbd: line, vbd: Line { iteration_ms: 10.0, ..line } };
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
            assert_eq!(single(FormulationChoice::Xpbd), [1, 2, 3, 4, 6, 8, 11, 16, 23]);
            assert_eq!(single(FormulationChoice::Vbd), [1, 2, 4, 8]);
            assert!(list.contains(&Setting::vbd(1, 8)) && !list.contains(&Setting::vbd(1, 16)));
        }
    }

    #[test]
    fn a_setting_says_what_it_is() {
        assert_eq!(Setting::xpbd(20).to_string(), "xpbd 20 x 1");
        assert_eq!(Setting::vbd(2, 8).to_string(), "vbd 2 x 8, 1.3");
    }
}
