//! The trials of the candidates, cheapest first, and when one is given up.

use std::ops::ControlFlow;
use std::time::Instant;

use super::bench::{Bench, Run};
use super::document::NO_TIME_LEFT;
use super::field::Field;
use super::reference::Reference;
use super::{Candidate, Demand, Setting, WoundError, setting};
use crate::Error;
use crate::clock::Clock;
use crate::scene::FormulationChoice;

/// A candidate is given up when the error of a cheaper one of its formulation is smaller by this factor at the same moment.
const MUCH_NEARER: f64 = 0.7;
/// A candidate is given up when it is over the budget by this factor.
const OVER_BUDGET: f64 = 1.2;
/// Settings that are expected to cost so many times as much as one that does are not tried.
const DEARER: f64 = 1.5;

/// The candidates as far as they were tried.
pub(super) struct Trials<'a> {
    pub bench: &'a Bench<'a>,
    pub reference: &'a Reference,
    pub demand: Demand,
    pub done: Vec<Candidate>,
}

/// A run as others are compared with it.
struct Course {
    formulation: FormulationChoice,
    ms_per_frame: f64,
    /// At each moment that it reached.
    errors: Vec<f64>,
}

impl Course {
    /// Whether a cheaper one was much nearer when it was where this one is now. Only one of the same formulation can tell: vertex block
    /// descent with few substeps is far off while the body moves, and nearest where it comes to rest.
    fn is_hopeless_beside(&self, other: &Self) -> bool {
        let moment = self.errors.len() - 1;
        other.formulation == self.formulation
            && other.ms_per_frame <= self.ms_per_frame
            && other.errors.get(moment).is_some_and(|error| *error < MUCH_NEARER * self.errors[moment])
    }
}

impl Trials<'_> {
    /// Tries candidates, cheapest first, for about `limit_s` seconds; the scene's own whatever it takes.
    pub fn run(&mut self, own: Setting, limit_s: f64, clock: &mut Clock<'_>) -> Result<(), Error> {
        let model = clock.stage("cost of a substep", 0, |_| self.bench.model())?;
        let finest = self.reference.told.substeps.last().copied().unwrap_or(1) / 2;
        let most_ms = match self.demand {
            Demand::BudgetMs(ms) => OVER_BUDGET * ms,
            Demand::Default | Demand::Error(_) => f64::INFINITY,
        };
        let frames = f64::from(self.bench.frames);
        let (mut left_s, mut courses) = (limit_s, Vec::new());
        for setting in setting::candidates(own, finest, most_ms, &model) {
            let expected_ms = model.frame_ms(setting);
            let mut candidate = Candidate { own: setting == own, ..Candidate::planned(setting, expected_ms) };
            let expected_s = 1e-3 * expected_ms * frames;
            let why_not = self.not_needed(&candidate).or_else(|| {
                let late = expected_s > left_s && !candidate.own;
                late.then(|| NO_TIME_LEFT.to_owned())
            });
            if let Some(why) = why_not {
                candidate.abandoned = Some(why);
                self.done.push(candidate);
                continue;
            }
            let begun = Instant::now();
            let run = clock.stage(&format!("try {setting}"), self.bench.frames.into(), |progress| {
                self.bench.run(setting, progress, |run| self.verdict(&mut candidate, run, &courses))
            });
            left_s -= begun.elapsed().as_secs_f64();
            // What explodes is a finding about the setting, the scene's own among them.
            match run {
                Ok(run) => {
                    courses.push(self.course(setting, &run));
                    self.enter(&mut candidate, &run);
                }
                Err(Error::Solver(error @ cutis_solver::SolverError::NotFinite { .. })) => {
                    candidate.abandoned = Some(format!("failed: {error}"));
                }
                Err(error) => return Err(error),
            }
            self.done.push(candidate);
        }
        Ok(())
    }

    /// How far a run is off at each moment that it reached.
    fn course(&self, setting: Setting, run: &Run) -> Course {
        let error = |(found, reference): (&Field, &Field)| found.rms_to(reference) / reference.rms();
        Course {
            formulation: setting.formulation,
            ms_per_frame: run.ms_per_frame,
            errors: run.fields.iter().zip(&self.reference.fields).map(error).collect(),
        }
    }

    /// Why a candidate need not be run, if one that is much cheaper meets the demand.
    fn not_needed(&self, candidate: &Candidate) -> Option<String> {
        let demanded = self.demand.error().filter(|_| !candidate.own)?;
        let meets = |done: &&Candidate| done.error.is_some_and(|e| e + self.reference.told.error <= demanded);
        let cheapest =
            self.done.iter().filter(meets).min_by(|a, b| a.expected_ms.total_cmp(&b.expected_ms))?;
        (candidate.expected_ms > DEARER * cheapest.expected_ms)
            .then(|| format!("not run, {} meets the demand for less", cheapest.setting))
    }

    /// Whether a candidate that is under way goes on.
    fn verdict(&self, candidate: &mut Candidate, run: &Run, others: &[Course]) -> ControlFlow<()> {
        if candidate.own {
            return ControlFlow::Continue(());
        }
        let course = self.course(candidate.setting, run);
        let moment = course.errors.len() - 1;
        let share = format!("{} of {} frames", self.bench.moments()[moment], self.bench.frames);
        let over = match self.demand {
            Demand::BudgetMs(ms) => run.ms_per_frame > OVER_BUDGET * ms,
            Demand::Default | Demand::Error(_) => false,
        };
        let nearer = others.iter().any(|other| course.is_hopeless_beside(other));
        if over {
            candidate.abandoned = Some(format!("given up after {share}: over the budget"));
        } else if nearer {
            candidate.abandoned = Some(format!(
                "given up after {share}: {:.1} % off by then, and a cheaper one of its kind much less",
                100.0 * course.errors[moment]
            ));
        }
        if over || nearer { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Enters what a run found.
    fn enter(&self, candidate: &mut Candidate, run: &Run) {
        candidate.ms_per_frame = Some(run.ms_per_frame);
        if !run.finished() {
            return;
        }
        candidate.error = self.course(candidate.setting, run).errors.last().copied();
        let rounding_mm = 1e3 * self.bench.movable.rounding();
        candidate.wounds = run
            .growths_mm
            .iter()
            .zip(&self.reference.told.growths_mm)
            .map(|(&growth_mm, &expected_mm)| WoundError::of(growth_mm, expected_mm, rounding_mm))
            .collect();
    }
}

#[cfg(test)]
mod tests {
    use FormulationChoice::{Vbd, Xpbd};

    use super::*;

    fn course(formulation: FormulationChoice, ms_per_frame: f64, errors: &[f64]) -> Course {
        Course { formulation, ms_per_frame, errors: errors.to_vec() }
    }

    #[test]
    fn only_a_cheaper_one_of_the_same_formulation_that_was_much_nearer_by_then_ends_a_trial() {
        let halfway = course(Vbd, 2.0, &[0.9, 0.5]);
        for (other, ends) in [
            (course(Vbd, 1.0, &[0.9, 0.1, 0.1]), true),
            (course(Vbd, 1.0, &[0.1, 0.4, 0.1]), false),
            (course(Vbd, 1.0, &[0.1]), false),
            (course(Vbd, 3.0, &[0.1, 0.1, 0.1]), false),
            (course(Xpbd, 1.0, &[0.1, 0.1, 0.1]), false),
        ] {
            assert_eq!(halfway.is_hopeless_beside(&other), ends, "{:?}", other.errors);
        }
    }
}
