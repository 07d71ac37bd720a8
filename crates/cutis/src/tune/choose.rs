//! Which of the measured settings to take.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Candidate, ReferenceReport};

/// Error that a setting is asked for by default: RMS of the positions over the RMS displacement.
const DEFAULT_ERROR: f64 = 0.05;

/// What is asked of a setting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Demand {
    /// The cheapest with an error of at most 5 %; if there is none, the one with the least error that costs no more than the
    /// scene's own setting, if the reference is fine enough to tell.
    #[default]
    Default,
    /// The one with the least error that takes at most so many milliseconds per frame.
    BudgetMs(f64),
    /// The cheapest with at most this error: RMS of the positions over the RMS displacement.
    Error(f64),
}

impl std::fmt::Display for Demand {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Default => {
                write!(f, "an error of at most {} %, or the least at no more cost", 100.0 * DEFAULT_ERROR)
            }
            Self::BudgetMs(ms) => write!(f, "at most {ms} ms per frame"),
            Self::Error(error) => write!(f, "an error of at most {} %", 100.0 * error),
        }
    }
}

impl Demand {
    /// The error that is asked for, if it is one.
    pub(super) fn error(self) -> Option<f64> {
        match self {
            Self::Default => Some(DEFAULT_ERROR),
            Self::BudgetMs(_) => None,
            Self::Error(error) => Some(error),
        }
    }

    /// The error that a reference may have: a tenth of what is asked for.
    pub(super) fn reference_error(self) -> f64 {
        0.1 * self.error().unwrap_or(DEFAULT_ERROR)
    }

    /// The place of the setting to take. `own` is the scene's. A setting meets an error only if it does so with the reference as
    /// wrong as it may be; and none is taken for being the nearest by default to a reference that is hardly finer than the scene.
    pub(super) fn choose(
        self,
        candidates: &[Candidate],
        own: usize,
        reference: &ReferenceReport,
    ) -> Option<usize> {
        let uncertain = reference.error;
        let best = |fits: &dyn Fn(f64, f64) -> bool, rank: fn((f64, f64)) -> f64| {
            let measured =
                candidates.iter().enumerate().filter_map(|(n, c)| Some((n, (c.ms_per_frame?, c.error?))));
            let fitting = measured.filter(|(_, (ms, error))| fits(*ms, *error));
            fitting.min_by(|a, b| rank(a.1).total_cmp(&rank(b.1))).map(|(n, _)| n)
        };
        let cheapest = |most: f64| best(&|_, error| error + uncertain <= most, |(ms, _)| ms);
        let nearest = |most: f64| best(&|ms, _| ms <= most, |(_, error)| error);
        match self {
            Self::BudgetMs(budget) => nearest(budget),
            Self::Error(error) => cheapest(error),
            Self::Default => cheapest(DEFAULT_ERROR).or_else(|| {
                let own_ms = candidates.get(own)?.ms_per_frame?;
                nearest(own_ms).filter(|_| reference.needs_minutes.is_none())
            }),
        }
    }
}

/// Marks what is on the front: no other measured setting is as cheap and as near, and better in one of the two.
pub(super) fn mark_front(candidates: &mut [Candidate]) {
    let measured: Vec<Option<(f64, f64)>> =
        candidates.iter().map(|c| Some((c.ms_per_frame?, c.error?))).collect();
    for (candidate, at) in candidates.iter_mut().zip(&measured) {
        let beaten = |(ms, error): (f64, f64)| {
            measured.iter().flatten().any(|&(m, e)| m <= ms && e <= error && (m < ms || e < error))
        };
        candidate.pareto = at.is_some_and(|at| !beaten(at));
    }
}

#[cfg(test)]
mod tests {
    use super::super::Setting;
    use super::*;

    fn measured(ms: f64, error: f64) -> Candidate {
        Candidate { ms_per_frame: Some(ms), error: Some(error), ..Candidate::planned(Setting::xpbd(1), ms) }
    }

    fn list() -> Vec<Candidate> {
        let abandoned = Candidate { error: None, ..measured(0.5, 0.0) };
        vec![abandoned, measured(1.0, 0.5), measured(2.0, 0.2), measured(2.5, 0.3), measured(4.0, 0.04)]
    }

    #[test]
    fn the_cheapest_that_is_near_enough_or_the_nearest_within_the_budget() {
        let reference = |error| ReferenceReport { error, ..ReferenceReport::default() };
        let pick = |demand: Demand, uncertain| demand.choose(&list(), 2, &reference(uncertain));
        assert_eq!(pick(Demand::Error(0.5), 0.0), Some(1));
        assert_eq!(pick(Demand::Error(0.5), 0.01), Some(2), "a reference that may be off");
        assert_eq!(pick(Demand::Error(0.01), 0.0), None);
        assert_eq!(pick(Demand::BudgetMs(3.0), 0.0), Some(2));
        assert_eq!(pick(Demand::BudgetMs(0.9), 0.0), None, "what was abandoned is not taken");
        assert_eq!(pick(Demand::Default, 0.0), Some(4));
        assert_eq!(pick(Demand::Default, 0.02), Some(2), "the scene's own cost");
        let coarse = |error| ReferenceReport { needs_minutes: Some(9.0), ..reference(error) };
        let pick = |demand: Demand, uncertain| demand.choose(&list(), 2, &coarse(uncertain));
        assert_eq!(pick(Demand::Default, 0.02), None, "nearest to what is no better than the scene");
        assert_eq!(pick(Demand::Default, 0.0), Some(4), "what meets the demand does so");
    }

    #[test]
    fn the_front_leaves_out_what_another_beats() {
        let mut list = list();
        mark_front(&mut list);
        let front: Vec<bool> = list.iter().map(|candidate| candidate.pareto).collect();
        assert_eq!(front, [false, true, true, false, true]);
    }
}
