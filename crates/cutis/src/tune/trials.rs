//! Runs the candidates, cheapest first, and abandons those that cannot win.

use std::ops::ControlFlow;
use std::time::Instant;

use cutis_solver::Formulation;

use super::bench::{Bench, Run};
use super::document::NO_TIME_LEFT;
use super::field::Field;
use super::reference::Reference;
use super::{Candidate, Demand, Setting, WoundError, setting};
use crate::Error;
use crate::run::clock::Clock;

/// A candidate is abandoned if a cheaper one of its formulation had an error smaller by this factor
/// at the same frame.
const MUCH_NEARER: f64 = 0.7;
/// A candidate is abandoned if it exceeds the budget by this factor.
const OVER_BUDGET: f64 = 1.2;
/// Settings whose expected cost exceeds that of a passing one by this factor are not tried.
const DEARER: f64 = 1.5;

/// The candidates that were tried so far.
pub(super) struct Trials<'a> {
    pub bench: &'a Bench<'a>,
    pub reference: &'a Reference,
    pub demand: Demand,
    pub done: Vec<Candidate>,
}

/// Errors of a run over time.
struct ErrorHistory {
    formulation: Formulation,
    ms_per_frame: f64,
    /// Relative error at each sampled frame.
    errors: Vec<f64>,
}

impl ErrorHistory {
    /// True if a cheaper run was much more accurate at the same frame. Only runs of one formulation
    /// are compared: vertex block descent with few substeps has a large error while the body moves
    /// and a small one when it comes to rest.
    fn is_dominated_by(&self, other: &Self) -> bool {
        let moment = self.errors.len() - 1;
        other.formulation == self.formulation
            && other.ms_per_frame <= self.ms_per_frame
            && other.errors.get(moment).is_some_and(|error| *error < MUCH_NEARER * self.errors[moment])
    }
}

impl Trials<'_> {
    /// Tries candidates, cheapest first, for about `limit_s` seconds. The scene's own setting is
    /// always tried.
    pub fn run(&mut self, own: Setting, limit_s: f64, clock: &mut Clock<'_>) -> Result<(), Error> {
        let model = clock.stage("cost of a substep", 0, |_| self.bench.model())?;
        let finest = self.reference.report.substeps.last().copied().unwrap_or(1) / 2;
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
            // A setting that diverges is a result, not a failure of the tuning.
            match run {
                Ok(run) => {
                    courses.push(self.history(setting, &run));
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

    /// The errors of a run at the sampled frames.
    fn history(&self, setting: Setting, run: &Run) -> ErrorHistory {
        let error = |(found, reference): (&Field, &Field)| found.rms_to(reference) / reference.rms();
        ErrorHistory {
            formulation: setting.formulation,
            ms_per_frame: run.ms_per_frame,
            errors: run.fields.iter().zip(&self.reference.fields).map(error).collect(),
        }
    }

    /// The reason to skip a candidate if a much cheaper one meets the target.
    fn not_needed(&self, candidate: &Candidate) -> Option<String> {
        let demanded = self.demand.error().filter(|_| !candidate.own)?;
        let meets =
            |done: &&Candidate| done.error.is_some_and(|e| e + self.reference.report.error <= demanded);
        let cheapest =
            self.done.iter().filter(meets).min_by(|a, b| a.expected_ms.total_cmp(&b.expected_ms))?;
        (candidate.expected_ms > DEARER * cheapest.expected_ms)
            .then(|| format!("not run, {} meets the target for less", cheapest.setting))
    }

    /// Decides whether a running candidate continues.
    fn verdict(&self, candidate: &mut Candidate, run: &Run, others: &[ErrorHistory]) -> ControlFlow<()> {
        if candidate.own {
            return ControlFlow::Continue(());
        }
        let history = self.history(candidate.setting, run);
        let moment = history.errors.len() - 1;
        let share = format!("{} of {} frames", self.bench.moments()[moment], self.bench.frames);
        let over = match self.demand {
            Demand::BudgetMs(ms) => run.ms_per_frame > OVER_BUDGET * ms,
            Demand::Default | Demand::Error(_) => false,
        };
        let nearer = others.iter().any(|other| history.is_dominated_by(other));
        if over {
            candidate.abandoned = Some(format!("abandoned after {share}: over budget"));
        } else if nearer {
            candidate.abandoned = Some(format!(
                "abandoned after {share}: the error was {:.1} %, and a cheaper setting was much more accurate",
                100.0 * history.errors[moment]
            ));
        }
        if over || nearer { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Stores the result of a run.
    fn enter(&self, candidate: &mut Candidate, run: &Run) {
        candidate.ms_per_frame = Some(run.ms_per_frame);
        if !run.finished() {
            return;
        }
        candidate.error = self.history(candidate.setting, run).errors.last().copied();
        let rounding_mm = 1e3 * self.bench.movable.rounding();
        candidate.wounds = run
            .growths_mm
            .iter()
            .zip(&self.reference.report.growths_mm)
            .map(|(&growth_mm, &expected_mm)| WoundError::of(growth_mm, expected_mm, rounding_mm))
            .collect();
    }
}

#[cfg(test)]
mod tests {
    use Formulation::{Vbd, Xpbd};

    use super::*;

    fn history(formulation: Formulation, ms_per_frame: f64, errors: &[f64]) -> ErrorHistory {
        ErrorHistory { formulation, ms_per_frame, errors: errors.to_vec() }
    }

    #[test]
    fn only_a_cheaper_and_much_more_accurate_run_of_the_same_formulation_ends_a_trial() {
        let halfway = history(Vbd, 2.0, &[0.9, 0.5]);
        for (other, ends) in [
            (history(Vbd, 1.0, &[0.9, 0.1, 0.1]), true),
            (history(Vbd, 1.0, &[0.1, 0.4, 0.1]), false),
            (history(Vbd, 1.0, &[0.1]), false),
            (history(Vbd, 3.0, &[0.1, 0.1, 0.1]), false),
            (history(Xpbd, 1.0, &[0.1, 0.1, 0.1]), false),
        ] {
            assert_eq!(halfway.is_dominated_by(&other), ends, "{:?}", other.errors);
        }
    }
}
