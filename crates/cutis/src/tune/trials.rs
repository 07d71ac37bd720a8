//! The trials of the candidates, cheapest first, and when one is given up.

use std::ops::ControlFlow;

use super::bench::{Bench, Run};
use super::reference::Reference;
use super::{Candidate, Demand, Setting, WoundError, field, setting};
use crate::Error;
use crate::clock::Clock;

/// A candidate is given up when a cheaper one's error is smaller by this factor at the same moment.
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
        let (mut left_s, mut errors) = (limit_s, Vec::new());
        for setting in setting::candidates(own, finest, most_ms, &model) {
            let expected_ms = model.frame_ms(setting);
            let mut candidate = Candidate { own: setting == own, ..Candidate::planned(setting, expected_ms) };
            let expected_s = 1e-3 * expected_ms * frames;
            let why_not = self.not_needed(&candidate).or_else(|| {
                let late = expected_s > left_s && !candidate.own;
                late.then(|| "not run, no time left (--minutes)".to_owned())
            });
            if let Some(why) = why_not {
                candidate.abandoned = Some(why);
                self.done.push(candidate);
                continue;
            }
            let run = clock.stage(&format!("try {setting}"), self.bench.frames.into(), |progress| {
                self.bench.run(setting, progress, |run| self.verdict(&mut candidate, run, &errors))
            });
            // What explodes is a finding about the setting, unless it is the scene's own.
            match run {
                Ok(run) => {
                    left_s -= 1e-3 * run.ms_per_frame * frames * run.fields.len() as f64
                        / self.bench.moments().len() as f64;
                    errors.push((run.ms_per_frame, self.errors(&run)));
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

    /// Error at each moment that a run reached.
    fn errors(&self, run: &Run) -> Vec<f64> {
        let error =
            |(found, reference): (&field::Field, &field::Field)| found.rms_to(reference) / reference.rms();
        run.fields.iter().zip(&self.reference.fields).map(error).collect()
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
    fn verdict(&self, candidate: &mut Candidate, run: &Run, others: &[(f64, Vec<f64>)]) -> ControlFlow<()> {
        if candidate.own {
            return ControlFlow::Continue(());
        }
        let errors = self.errors(run);
        let moment = errors.len() - 1;
        let share = format!("{} of {} frames", self.bench.moments()[moment], self.bench.frames);
        let over = match self.demand {
            Demand::BudgetMs(ms) => run.ms_per_frame > OVER_BUDGET * ms,
            Demand::Default | Demand::Error(_) => false,
        };
        let nearer = others.iter().any(|(ms, other)| {
            *ms <= run.ms_per_frame && other.get(moment).is_some_and(|e| *e < MUCH_NEARER * errors[moment])
        });
        if over {
            candidate.abandoned = Some(format!("given up after {share}: over the budget"));
        } else if nearer {
            candidate.abandoned = Some(format!(
                "given up after {share}: {:.1} % off by then, and a cheaper one much less",
                100.0 * errors[moment]
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
        candidate.error = self.errors(run).last().copied();
        candidate.wounds = run
            .growths_mm
            .iter()
            .zip(&self.reference.told.growths_mm)
            .map(|(&growth_mm, &expected_mm)| WoundError::of(growth_mm, expected_mm))
            .collect();
    }
}
