//! States of rest one after the other: after the frames, and after each thing that is still to be
//! done to the body.

use cutis_rest::Step;

use super::frames::FrameRow;
use super::rests::Rests;
use crate::output::rest_report::{RestReport, StopReport};
use crate::output::step_report::StepReport;
use crate::scene::Scene;

/// Units of progress of a search.
pub(super) const SEARCH: u64 = 100;

/// A time at which something that is done to the body ends.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stop {
    pub(super) time_s: f64,
    /// What ends, as the scene names it.
    pub(super) done: Vec<String>,
}

impl Stop {
    /// The stops of a scene, in the order of time. What never ends has none.
    pub(super) fn all(steps: &[StepReport], scene: &Scene) -> Vec<Self> {
        let ends = steps.iter().map(|step| (step.until_s, step.section.clone()));
        let released = scene
            .suture
            .iter()
            .enumerate()
            .filter_map(|(n, suture)| Some((suture.release_s?, format!("release of suture[{n}]"))));
        let last_s = scene.last_frame_s();
        let mut ends: Vec<(f64, String)> = ends.chain(released).filter(|(end, _)| *end <= last_s).collect();
        ends.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut stops: Vec<Self> = Vec::new();
        for (time_s, what) in ends {
            match stops.last_mut() {
                Some(stop) if stop.time_s == time_s => stop.done.push(what),
                _ => stops.push(Self { time_s, done: vec![what] }),
            }
        }
        stops
    }
}

/// The states of rest of a run.
#[derive(Default)]
pub(super) struct Settled {
    pub(super) stops: Vec<StopReport>,
    /// The search for the last state, and its wounds.
    pub(super) last: Option<(RestReport, FrameRow)>,
}

impl Settled {
    /// The states of rest of a checkpoint. `row` is that of the last one.
    pub(super) fn resumed(rests: &Rests, row: FrameRow) -> Self {
        Self { stops: rests.stops.clone(), last: Some((rests.last.clone(), row)) }
    }

    /// The states of rest for a checkpoint.
    pub(super) fn saved(&self) -> Option<Rests> {
        self.last.as_ref().map(|(last, _)| Rests { stops: self.stops.clone(), last: last.clone() })
    }

    /// Adds a state after `done`.
    pub(super) fn add(&mut self, rest: RestReport, row: FrameRow, done: Vec<String>) {
        self.stops.push(StopReport {
            time_s: row.time_s,
            done,
            mean_mm: row.gapes.iter().map(|gape| gape.mean_mm).collect(),
            mid_mm: row.gapes.iter().map(|gape| gape.mid_mm).collect(),
            sutures_n: row.sutures.iter().map(|[sum, _]| *sum).collect(),
            handles_n: row.handles.clone(),
            error: rest.error,
            steps: rest.steps.len(),
            cycles: rest.cycles(),
            ms: rest.ms,
        });
        self.last = Some((rest, row));
    }
}

/// How far a search has come.
pub(super) struct SearchBar {
    target: f64,
    /// The force before the first step.
    first: Option<f64>,
    done: f64,
}

impl SearchBar {
    /// For a search that ends at an error.
    pub(super) fn new(target: f64) -> Self {
        Self { target, first: None, done: 0.0 }
    }

    /// Units of [`SEARCH`] after a step: by the digits of the error, or of the force before the
    /// error is known. It never goes back.
    pub(super) fn after(&mut self, step: &Step) -> u64 {
        let first = *self.first.get_or_insert(step.force);
        let left = if step.error.is_finite() { step.error } else { step.force / first };
        let share = left.max(1e-300).log10() / self.target.min(0.5).log10();
        self.done = self.done.max(share.clamp(0.0, 1.0));
        (self.done * SEARCH as f64) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::RunEnd;

    #[test]
    fn ends_at_the_same_time_are_one_stop() {
        let step = |section: &str, at_s: f64, until_s: f64| StepReport {
            section: section.into(),
            at_s,
            until_s,
            what: String::new(),
        };
        let steps = [step("handle[0]", 0.2, 0.7), step("incision[0]", 0.0, 0.5), step("suture[0]", 0.6, 0.7)];
        let mut scene = crate::demo(&[]).unwrap().scene;
        scene.run.until = RunEnd::Rest;
        let found: Vec<(f64, usize)> =
            Stop::all(&steps, &scene).iter().map(|stop| (stop.time_s, stop.done.len())).collect();
        assert_eq!(found, [(0.5, 1), (0.7, 2)]);
        scene.solver.dt_s = 1e-11;
        assert!(Stop::all(&steps, &scene).is_empty());
    }

    #[test]
    fn the_bar_of_a_search_does_not_go_back() {
        let mut bar = SearchBar::new(1e-2);
        let step = |force, error| Step { force, moved_m: 0.0, cycles: 1, length: 1.0, error };
        let found = [(1.0, f64::INFINITY), (0.1, f64::INFINITY), (0.9, f64::INFINITY), (0.0, 1e-2)]
            .map(|(force, error)| bar.after(&step(force, error)));
        assert_eq!(found, [0, 50, 50, 100]);
        assert_eq!(SearchBar::new(1.0).after(&step(1.0, 0.25)), 100);
    }
}
