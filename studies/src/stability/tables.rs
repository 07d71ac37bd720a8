//! Lines on the terminal, and summary tables of the page.

use std::collections::{BTreeMap, BTreeSet};

use super::trial::{Outcome, Trial};
use crate::kit::{Table, larger, number, optional};

/// The trial as one line of text.
pub fn line(trial: &Trial) -> String {
    let figure = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.3e}"));
    format!(
        "{:8} {:58} {:14} {:>6} energy {:>9} recovery {:>9} error {:>9} {:6.2} s  {}",
        trial.outcome.to_string(),
        trial.case,
        trial.backend,
        trial.scale.map_or_else(|| "-".to_owned(), |scale| format!("{scale:e}")),
        figure(trial.energy_ratio),
        figure(trial.recovery_s),
        figure(trial.error),
        trial.wall_s,
        trial.outcome.note(),
    )
}

/// Number of trials by outcome for each group of trials, with the largest energy ratio.
pub fn summary(trials: &[Trial], head: &str, group: impl Fn(&Trial) -> Option<String>) -> Table {
    let mut groups: BTreeMap<String, Vec<&Trial>> = BTreeMap::new();
    for trial in trials {
        if let Some(name) = group(trial) {
            groups.entry(name).or_default().push(trial);
        }
    }
    let mut table = Table::new([
        head,
        "trials",
        "settled",
        "bounded",
        "named",
        "failed",
        "largest energy ratio",
        "wall, s",
    ]);
    for (name, trials) in groups {
        let count = |wanted: &str| trials.iter().filter(|trial| trial.outcome.to_string() == wanted).count();
        let ratio = trials.iter().filter_map(|trial| trial.energy_ratio).fold(0.0, larger);
        let wall: f64 = trials.iter().map(|trial| trial.wall_s).sum();
        let counts = ["settled", "bounded", "named", "FAILED"].map(|wanted| count(wanted).to_string());
        let ends = [number(ratio), number(wall)];
        table.add([name, trials.len().to_string()].into_iter().chain(counts).chain(ends));
    }
    table
}

/// The formulation in the name of a case that was simulated.
pub fn formulation(trial: &Trial) -> Option<String> {
    trial.scale?;
    let found = ["XPBD", "VBD", "PBD"].into_iter().find(|name| trial.case.contains(name));
    Some(found.unwrap_or("other").to_owned())
}

/// The cases with the largest energy ratio, one line for each case: its worst backend and scale.
/// Known failures have their own table.
pub fn worst(trials: &[Trial], count: usize) -> Table {
    let mut by_case: BTreeMap<&str, &Trial> = BTreeMap::new();
    let ratio = |trial: &Trial| trial.energy_ratio.unwrap_or(0.0);
    for trial in trials.iter().filter(|trial| trial.known_failure.is_none()) {
        let entry = by_case.entry(&trial.case).or_insert(trial);
        if ratio(trial) > ratio(entry) {
            *entry = trial;
        }
    }
    let mut trials: Vec<&Trial> = by_case.into_values().collect();
    trials.sort_by(|a, b| ratio(b).total_cmp(&ratio(a)));
    let mut table = Table::new([
        "case",
        "backend",
        "scale",
        "outcome",
        "energy ratio",
        "recovery, s",
        "error at the end",
    ]);
    for trial in trials.into_iter().take(count) {
        table.add([
            trial.case.clone(),
            trial.backend.clone(),
            optional(trial.scale, |scale| format!("{scale:e}")),
            trial.outcome.to_string(),
            optional(trial.energy_ratio, number),
            optional(trial.recovery_s, number),
            optional(trial.error, number),
        ]);
    }
    table
}

/// The inputs that were refused, with the error.
pub fn refused(trials: &[Trial]) -> Table {
    let mut table = Table::new(["input", "outcome", "error"]);
    for trial in trials.iter().filter(|trial| trial.scale.is_none()) {
        table.add([trial.case.as_str(), &trial.outcome.to_string(), trial.outcome.note()]);
    }
    table
}

/// Number of trials that failed without a known reason.
pub fn failures(trials: &[Trial]) -> usize {
    trials.iter().filter(|trial| !trial.outcome.is_good() && trial.known_failure.is_none()).count()
}

/// The cases that are known to fail, with the trial of the largest energy ratio among those that
/// failed.
pub fn known_failures(trials: &[Trial]) -> Table {
    let mut by_case: BTreeMap<&str, Vec<&Trial>> = BTreeMap::new();
    for trial in trials.iter().filter(|trial| trial.known_failure.is_some()) {
        by_case.entry(&trial.case).or_default().push(trial);
    }
    let ratio = |trial: &Trial| trial.energy_ratio.unwrap_or(f64::INFINITY);
    let mut table =
        Table::new(["case", "trials", "failed", "backend", "scale", "energy ratio", "failure", "reason"]);
    for (case, trials) in by_case {
        let failed: Vec<&&Trial> = trials.iter().filter(|trial| !trial.outcome.is_good()).collect();
        let worst = failed.iter().max_by(|a, b| ratio(a).total_cmp(&ratio(b)));
        table.add([
            case.to_owned(),
            trials.len().to_string(),
            failed.len().to_string(),
            optional(worst, |trial| trial.backend.clone()),
            optional(worst.and_then(|trial| trial.scale), |scale| format!("{scale:e}")),
            optional(worst.and_then(|trial| trial.energy_ratio), number),
            optional(worst, |trial| trial.outcome.note().to_owned()),
            trials[0].known_failure.unwrap_or_default().to_owned(),
        ]);
    }
    table
}

/// Number of trials by outcome for each length scale.
pub fn ends(trials: &[Trial], scale: impl Fn(&Trial) -> Option<String>) -> Table {
    let mut table = Table::new(["scale", "trials", "at rest", "a typed error", "failed", "wall, s"]);
    let scales: BTreeSet<String> = trials.iter().filter_map(&scale).collect();
    for name in scales {
        let of_scale: Vec<&Trial> =
            trials.iter().filter(|trial| scale(trial).as_deref() == Some(&name)).collect();
        let count =
            |wanted: &str| of_scale.iter().filter(|trial| trial.outcome.to_string() == wanted).count();
        let [settled, named, failed] = ["settled", "named", "FAILED"].map(|wanted| count(wanted).to_string());
        let wall: f64 = of_scale.iter().map(|trial| trial.wall_s).sum();
        table.add([name, of_scale.len().to_string(), settled, named, failed, number(wall)]);
    }
    table
}

/// The cases that ended with a typed error, and the error at the first scale that has one.
pub fn named(trials: &[Trial]) -> Table {
    let mut by_case: BTreeMap<&str, Vec<&Trial>> = BTreeMap::new();
    for trial in trials.iter().filter(|trial| matches!(trial.outcome, Outcome::Named(_))) {
        by_case.entry(&trial.case).or_default().push(trial);
    }
    let mut table = Table::new(["case", "scales", "error"]);
    for (case, trials) in by_case {
        let scales: Vec<String> =
            trials.iter().filter_map(|trial| Some(format!("{:e}", trial.scale?))).collect();
        table.add([case.to_owned(), scales.join(", "), trials[0].outcome.note().to_owned()]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::Outcome;

    #[test]
    fn a_summary_counts_outcomes_and_keeps_the_worst_ratio() {
        let trial = |case: &str, scale, ratio, outcome| Trial {
            energy_ratio: Some(ratio),
            outcome,
            ..Trial::new(case, "cpu f32", Some(scale))
        };
        let mut refused_input = Trial::new("a mass, NaN", "builder", None);
        refused_input.outcome = Outcome::Refused("vertex 1: \"mass\"".into());
        let trials = [
            trial("springs, XPBD", 1e-3, 2.0, Outcome::Failed("grew".into())),
            trial("springs, XPBD", 1.0, f64::NAN, Outcome::Bounded),
            trial("springs, VBD", 1.0, 1.0, Outcome::Settled),
            refused_input,
        ];
        let text = summary(&trials, "formulation", formulation).markdown();
        assert!(text.contains("| XPBD | 2 | 0 | 1 | 0 | 1 | NaN | 0 |"), "{text}");
        assert!(text.contains("| VBD | 1 | 1 | 0 | 0 | 0 | 1.00 | 0 |"), "{text}");
        assert_eq!(failures(&trials), 1);
        let text = worst(&trials[..2], 9).markdown();
        assert!(text.contains("| springs, XPBD | cpu f32 | 1e-3 | FAILED | 2.00 |"), "{text}");
        let known = Trial { known_failure: Some("too stiff"), ..trials[0].clone() };
        assert_eq!(failures(std::slice::from_ref(&known)), 0);
        let text = known_failures(&[known, trials[1].clone()]).markdown();
        assert!(
            text.contains("| springs, XPBD | 1 | 1 | cpu f32 | 1e-3 | 2.00 | grew | too stiff |"),
            "{text}"
        );
        assert!(refused(&trials).markdown().contains("| a mass, NaN | refused | vertex 1: \"mass\" |"));
    }
}
