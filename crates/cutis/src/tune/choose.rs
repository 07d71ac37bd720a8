//! Picks one of the measured settings.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Candidate, ReferenceReport};

/// Default target: RMS position error over RMS displacement.
const DEFAULT_ERROR: f64 = 0.05;

/// Target for a setting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Demand {
    /// The cheapest setting with an error of at most 5 %. If there is none: the most accurate
    /// setting that costs no more than the scene's own, provided that the reference is fine enough.
    #[default]
    Default,
    /// The most accurate setting that takes at most this time per frame, ms.
    BudgetMs(f64),
    /// The cheapest setting with at most this error: RMS position error over RMS displacement.
    Error(f64),
}

impl std::fmt::Display for Demand {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Default => {
                write!(
                    f,
                    "an error of at most {} %, or the smallest error at no more cost",
                    100.0 * DEFAULT_ERROR
                )
            }
            Self::BudgetMs(ms) => write!(f, "at most {ms} ms per frame"),
            Self::Error(error) => write!(f, "an error of at most {} %", 100.0 * error),
        }
    }
}

impl Demand {
    /// The target error, if the target is an error.
    pub(super) fn error(self) -> Option<f64> {
        match self {
            Self::Default => Some(DEFAULT_ERROR),
            Self::BudgetMs(_) => None,
            Self::Error(error) => Some(error),
        }
    }

    /// The error that a reference may have: a tenth of the target.
    pub(super) fn reference_error(self) -> f64 {
        0.1 * self.error().unwrap_or(DEFAULT_ERROR)
    }

    /// The error that a region may add to that of the setting.
    pub(super) fn region_error(self) -> f64 {
        self.error().unwrap_or(DEFAULT_ERROR)
    }

    /// Index of the picked setting. `own` is the index of the scene's own setting. A setting passes
    /// only if its error plus the reference's uncertainty is below the target. The default target
    /// picks nothing if the reference is hardly finer than the scene.
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
        let most_accurate = |most: f64| best(&|ms, _| ms <= most, |(_, error)| error);
        match self {
            Self::BudgetMs(budget) => most_accurate(budget),
            Self::Error(error) => cheapest(error),
            Self::Default => cheapest(DEFAULT_ERROR).or_else(|| {
                let own_ms = candidates.get(own)?.ms_per_frame?;
                most_accurate(own_ms).filter(|_| reference.needs_minutes.is_none())
            }),
        }
    }
}

/// Marks the Pareto front: no other setting is at least as cheap and as accurate, and better in one
/// of the two.
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
    fn picks_the_cheapest_accurate_setting_or_the_most_accurate_affordable_one() {
        let reference = |error| ReferenceReport { error, ..ReferenceReport::default() };
        let pick = |demand: Demand, uncertain| demand.choose(&list(), 2, &reference(uncertain));
        assert_eq!(pick(Demand::Error(0.5), 0.0), Some(1));
        assert_eq!(pick(Demand::Error(0.5), 0.01), Some(2), "the uncertainty of the reference counts");
        assert_eq!(pick(Demand::Error(0.01), 0.0), None);
        assert_eq!(pick(Demand::BudgetMs(3.0), 0.0), Some(2));
        assert_eq!(pick(Demand::BudgetMs(0.9), 0.0), None, "an abandoned setting is not picked");
        assert_eq!(pick(Demand::Default, 0.0), Some(4));
        assert_eq!(pick(Demand::Default, 0.02), Some(2), "falls back to the cost of the scene's own setting");
        let coarse = |error| ReferenceReport { needs_minutes: Some(9.0), ..reference(error) };
        let pick = |demand: Demand, uncertain| demand.choose(&list(), 2, &coarse(uncertain));
        assert_eq!(pick(Demand::Default, 0.02), None, "the reference is too coarse for the fallback");
        assert_eq!(
            pick(Demand::Default, 0.0),
            Some(4),
            "a setting that meets the target is picked all the same"
        );
    }

    #[test]
    fn dominated_settings_are_not_on_the_front() {
        let mut list = list();
        mark_front(&mut list);
        let front: Vec<bool> = list.iter().map(|candidate| candidate.pareto).collect();
        assert_eq!(front, [false, true, true, false, true]);
    }
}
