//! Finds the fastest region of interest in which the wounds open as far as in the whole body.
//!
//! A region that is too small holds the wound back, so the opening grows with the size of the
//! region toward that of the whole body. Sizes are tried from small to large until one passes,
//! first on the scene's own lattice and then with cells that grow outside a fine zone.

use std::time::Instant;

use nalgebra::{Point3, distance};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::WoundError;
use super::baseline::{Baseline, Comparison, Reuse};
use crate::run::clock::Clock;
use crate::scene::{GradingSection, LatticeSection, RegionSection, Scene};

/// Sizes of regions, over the reach of the action.
const SIZES: [f64; 5] = [0.5, 0.75, 1.0, 1.25, 2.0];
/// Size of the fine zone of a graded lattice, over the reach of the action.
const FINE: f64 = 0.4;
/// A region with more than this share of the tetrahedra saves too little to be tried.
const MOST_SHARE: f64 = 0.8;

/// A region of interest that was tried, compared with the whole body at the same setting.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegionTrial {
    /// Tissue within this distance of the action is simulated, mm (`lattice.region.around_mm`).
    pub around_mm: f64,
    /// Size of the fine zone of a graded lattice, mm (`lattice.grading.around_mm`); none if the
    /// cells are those of the scene.
    pub grading_mm: Option<f64>,
    /// Tetrahedra over those of the whole body; none if it was not measured.
    pub tets_share: Option<f64>,
    /// Mean wall time of a frame, ms.
    pub ms_per_frame: Option<f64>,
    /// Time of a frame over that of the whole body.
    pub time_share: Option<f64>,
    /// Memory of the solver saved on host and device, bytes.
    pub saved_bytes: i64,
    /// Largest relative difference of a wound's opening from the whole body. If no wound opens, the
    /// RMS change of the displacements over the RMS displacement.
    pub error: Option<f64>,
    /// Growth of each wound, compared with the whole body.
    pub wounds: Vec<WoundError>,
    /// True for the region in the tuned scene.
    pub picked: bool,
    /// Reason if it was not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skipped: Option<String>,
}

impl RegionTrial {
    fn passes(&self, most: f64) -> bool {
        self.error.is_some_and(|error| error <= most)
    }

    /// A copy of `lattice` with this region.
    pub(super) fn applied_to(&self, lattice: &LatticeSection) -> LatticeSection {
        let graded = self.grading_mm.map(GradingSection::around);
        LatticeSection {
            region: Some(RegionSection::around(self.around_mm)),
            grading: graded.or_else(|| lattice.grading.clone()),
            ..lattice.clone()
        }
    }

    /// A line about the region for the tuned scene.
    pub(super) fn promise(&self) -> String {
        let percent = |share: Option<f64>| 100.0 * share.unwrap_or(f64::NAN);
        format!(
            "The region differs from the whole body by {:.1} % and takes {:.0} % of its time: {:.1} ms per frame.",
            percent(self.error),
            percent(self.time_share),
            self.ms_per_frame.unwrap_or(f64::NAN)
        )
    }
}

impl Baseline<'_> {
    /// Tries regions within about `limit_s` seconds, and marks the fastest with an error of at most
    /// `most`. None is tried if the scene has a region, or neither an incision nor a handle.
    pub(super) fn regions(&self, most: f64, limit_s: f64, clock: &mut Clock<'_>) -> Vec<RegionTrial> {
        let scene = &self.loaded.scene;
        let is_whole = scene.lattice.region.as_ref().is_none_or(|region| region.zone().is_none());
        let Some(reach_mm) = self.reach_mm().filter(|_| is_whole) else { return Vec::new() };
        let fine = scene.lattice.grading.is_none().then_some((FINE * reach_mm).ceil());
        let zones: &[Option<f64>] = if fine.is_some() { &[None, fine] } else { &[None] };
        let (mut list, mut left_s) = (Vec::new(), limit_s);
        for &grading_mm in zones {
            for size in SIZES.map(|size| (size * reach_mm).ceil()) {
                // The region has to be larger than the fine zone for the cells to grow.
                if grading_mm.is_some_and(|fine| size < 2.0 * fine) {
                    continue;
                }
                let planned = RegionTrial { around_mm: size, grading_mm, ..RegionTrial::default() };
                let share = self.body.share_around(&scene.handle, size);
                if let Some(why) = self.not_worth(share, left_s) {
                    list.push(RegionTrial { skipped: Some(why), ..planned });
                    break;
                }
                let begun = Instant::now();
                let trial = self.try_region(planned, share, clock);
                left_s -= begun.elapsed().as_secs_f64();
                let passes = trial.passes(most);
                list.push(trial);
                if passes {
                    break;
                }
            }
        }
        mark_fastest(&mut list, most);
        list
    }

    /// The reason not to try a region with this share of the tetrahedra, or a larger one.
    fn not_worth(&self, share: f64, left_s: f64) -> Option<String> {
        if share > MOST_SHARE {
            return Some(format!("it has {:.0} % of the tetrahedra", 100.0 * share));
        }
        (self.seconds(Reuse::Another { share }) > left_s).then(|| "no time left; increase --minutes".into())
    }

    fn try_region(&self, planned: RegionTrial, share: f64, clock: &mut Clock<'_>) -> RegionTrial {
        let scene = &self.loaded.scene;
        let name = match planned.grading_mm {
            None => format!("region of {} mm", planned.around_mm),
            Some(fine) => format!("region of {} mm, graded from {fine} mm", planned.around_mm),
        };
        let changed = Scene {
            solver: self.setting.applied_to(&scene.solver),
            lattice: planned.applied_to(&scene.lattice),
            ..scene.clone()
        };
        let compared = clock.stage(&name, self.bench.frames.into(), |progress| {
            self.compare(&changed, Reuse::Another { share }, progress)
        });
        match compared {
            Ok(Comparison { run, tets, change, wounds }) => RegionTrial {
                tets_share: Some(tets as f64 / self.body.mesh.tets.len().max(1) as f64),
                ms_per_frame: Some(run.ms_per_frame),
                time_share: Some(run.ms_per_frame / self.run.ms_per_frame),
                saved_bytes: self.run.bytes as i64 - run.bytes as i64,
                error: Some(largest(&wounds).unwrap_or(change)),
                wounds,
                ..planned
            },
            // A region that cannot be built or run is a result, not a failure.
            Err(error) => RegionTrial { skipped: Some(error.to_string()), ..planned },
        }
    }

    /// Largest distance between points of an incision or excision, or twice the radius of the
    /// largest handle, mm.
    fn reach_mm(&self) -> Option<f64> {
        let scene = &self.loaded.scene;
        let extent = |path: Vec<[f64; 3]>| {
            let points = || path.iter().copied().map(Point3::from);
            points().flat_map(|a| points().map(move |b| distance(&a, &b))).fold(0.0, f64::max)
        };
        let incisions = scene.incision.iter().map(|incision| extent(incision.path()));
        let handles = scene.handle.iter().map(|handle| 2.0 * handle.radius_mm);
        let excisions = scene.excision.iter().map(|excision| extent(excision.path_mm.clone()));
        incisions.chain(excisions).chain(handles).reduce(f64::max)
    }
}

/// Largest relative difference of a wound's opening; none if no wound opens.
fn largest(wounds: &[WoundError]) -> Option<f64> {
    let share = |wound: &WoundError| wound.difference_percent.map(|percent| percent.abs() / 100.0);
    wounds.iter().filter_map(share).reduce(f64::max)
}

/// Marks the fastest region with an error of at most `most`, if it is faster than the whole body.
fn mark_fastest(list: &mut [RegionTrial], most: f64) {
    let passing = list.iter_mut().filter(|trial| trial.passes(most));
    let share = |trial: &RegionTrial| trial.time_share.unwrap_or(f64::INFINITY);
    let fastest = passing.min_by(|a, b| share(a).total_cmp(&share(b))).filter(|trial| share(trial) < 1.0);
    fastest.into_iter().for_each(|trial| trial.picked = true);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(time_share: f64, error: f64) -> RegionTrial {
        RegionTrial { time_share: Some(time_share), error: Some(error), ..RegionTrial::default() }
    }

    #[test]
    fn the_fastest_region_that_passes_is_marked() {
        let skipped = RegionTrial { skipped: Some("no time".into()), ..RegionTrial::default() };
        let list = [skipped, trial(0.1, 0.2), trial(0.4, 0.04), trial(0.3, 0.05), trial(1.1, 0.01)];
        let marked = |most: f64| {
            let mut list = list.clone();
            mark_fastest(&mut list, most);
            assert!(list.iter().filter(|trial| trial.picked).count() <= 1);
            list.iter().position(|trial| trial.picked)
        };
        assert_eq!(marked(0.3), Some(1));
        assert_eq!(marked(0.05), Some(3));
        assert_eq!(marked(0.045), Some(2));
        assert_eq!(marked(0.02), None, "a region that is slower than the whole body");
        assert_eq!(marked(0.001), None);
    }

    #[test]
    fn the_error_is_that_of_the_wound_that_differs_most() {
        let wound = |growth, with| WoundError::of(growth, with, 1e-4);
        assert_eq!(largest(&[]), None);
        assert_eq!(largest(&[wound(0.0, 0.0)]), None);
        let error = largest(&[wound(9.0, 10.0), wound(12.0, 10.0), wound(0.0, 0.0)]).unwrap();
        assert!((error - 0.2).abs() < 1e-12, "{error}");
    }

    #[test]
    fn a_region_keeps_the_other_keys_of_the_lattice() {
        let own = GradingSection { growth: 1.2, ..GradingSection::around(9.0) };
        let lattice =
            LatticeSection { spacing_mm: Some(3.0), grading: Some(own.clone()), ..LatticeSection::default() };
        let plain = RegionTrial { around_mm: 80.0, ..RegionTrial::default() };
        let graded = RegionTrial { grading_mm: Some(40.0), ..plain.clone() };
        for (trial, grading) in [(plain, own), (graded, GradingSection::around(40.0))] {
            let found = trial.applied_to(&lattice);
            assert_eq!(found.region, Some(RegionSection::around(80.0)));
            assert_eq!((found.grading, found.spacing_mm), (Some(grading), Some(3.0)));
        }
    }
}
