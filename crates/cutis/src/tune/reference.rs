//! The reference for tuning: the scene in double precision with more and more substeps,
//! extrapolated, with an estimate of its uncertainty.
//!
//! Displacements with `S`, `2S` and `4S` substeps converge as `x + c/Sᵖ`. Two differences give the
//! order `p` and the limit `x` (Richardson extrapolation). The uncertainty is the distance between
//! the limit and the finest run. This estimate relies on the direction of the extrapolation, not on
//! its length.
//!
//! If the differences do not shrink, or shrink faster than any method converges, no limit is
//! visible. The finest run is then the reference. Its uncertainty is its difference from the run
//! before, or half of the difference before that, if that is larger.

use std::collections::VecDeque;

use cutis_solver::System;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::REFERENCE_SHARE;
use super::bench::{Bench, Run};
use super::field::Field;
use super::setting::Setting;
use crate::Error;
use crate::run::clock::Clock;

/// Differences must shrink by this factor per level for a visible limit.
const CONVERGES: f64 = 1.5;
/// Highest order of convergence of the methods.
const HIGHEST_ORDER: f64 = 2.0;
/// Differences that shrink by more than this factor do so by chance: errors cancel.
const CHANCE: f64 = 6.0;
/// Minimum number of substeps of the first level.
const FEWEST: u32 = 4;
/// Maximum number of substeps of a level. Beyond it the substep nears the resolution of the scene's
/// time.
const MOST: u32 = 1 << 20;

/// The last level must have this many times the substeps of the scene's own setting to judge it.
const FINER_THAN_OWN: f64 = 2.0;
/// Safety factor on the estimated time, because the load of a machine varies.
const SPARE: f64 = 1.2;

/// The solution that candidates are compared with.
pub(super) struct Reference {
    /// One displacement field per sampled frame.
    pub(super) fields: Vec<Field>,
    pub(super) report: ReferenceReport,
}

impl Reference {
    /// Displacements at the last frame.
    pub(super) fn at_end(&self) -> &Field {
        static NONE: Field = Field(Vec::new());
        self.fields.last().unwrap_or(&NONE)
    }
}

/// Quality and cost of the reference.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct ReferenceReport {
    /// Substeps of its runs: XPBD with one iteration, in double precision on the CPU.
    pub substeps: Vec<u32>,
    /// Difference between each run and the one before: RMS of the positions over RMS displacement.
    pub differences: Vec<f64>,
    /// Order of convergence of the last three runs; none if no limit is visible.
    pub order: Option<f64>,
    /// Uncertainty of the reference: RMS of the positions over RMS displacement.
    pub error: f64,
    /// RMS displacement of the movable vertices, mm.
    pub displacement_mm: f64,
    /// Growth of each wound, mm: mean distance of its lips at the end minus that at the start.
    pub growths_mm: Vec<f64>,
    /// Wall time of all its runs, s.
    pub seconds: f64,
    /// Estimated minutes for a reference with twice the scene's own substeps, if the time was too
    /// short for it.
    pub needs_minutes: Option<f64>,
}

impl ReferenceReport {
    /// A warning if the last run is hardly finer than the scene itself.
    pub(super) fn coarse(&self, own: Setting) -> Option<String> {
        self.needs_minutes.map(|minutes| {
            format!(
                "the reference reached only {} substeps a frame and the scene has {}; it needs about {} minutes (--minutes)",
                self.substeps.last().copied().unwrap_or(0),
                own.substeps,
                minutes.ceil()
            )
        })
    }

    /// Expected number of substeps for which XPBD with one iteration has this error, from the order
    /// of convergence. None if no limit is visible.
    pub(super) fn substeps_for(&self, error: f64) -> Option<u32> {
        let finest = f64::from(*self.substeps.last()?);
        Some((finest * (self.error / error).powf(1.0 / self.order?)).ceil() as u32)
    }
}

/// Runs levels, each with twice the substeps of the one before, until the uncertainty is below
/// `enough` or the next level would exceed `limit_s` seconds. There are at least three levels.
pub(super) fn run(
    bench: &Bench<'_>,
    own: Setting,
    enough: f64,
    limit_s: f64,
    clock: &mut Clock<'_>,
) -> Result<Reference, Error> {
    let system: System<f64> = bench.system.to_f64();
    let frame_s = 1e-3 * bench.substep_f64_ms(&system)? * f64::from(bench.frames);
    // Three levels take seven times as long as the first one.
    let affordable = (limit_s / 7.0 / frame_s.max(f64::MIN_POSITIVE)) as u32;
    let mut substeps = own.sweeps().min(affordable).max(FEWEST);
    let mut levels = Levels::default();
    loop {
        let name = format!("reference: {substeps} substeps, f64");
        let setting = Setting::xpbd(substeps);
        let run =
            clock.stage(&name, bench.frames.into(), |progress| bench.run_f64(&system, setting, progress))?;
        if run.at_end().rms() <= bench.movable.rounding() {
            let why = "nothing in this scene moves by more than rounding, so no error can be measured";
            return Err(Error::Request { what: "tuning".into(), why: why.into() });
        }
        levels.push(substeps, run, bench.frames);
        if let Some(reference) = levels.limit() {
            let next_s =
                levels.seconds / f64::from(levels.substeps.iter().sum::<u32>()) * f64::from(2 * substeps);
            if reference.report.error <= enough || levels.seconds + next_s > limit_s || substeps > MOST {
                let needs_minutes = levels.needs_minutes(own.substeps);
                return Ok(Reference {
                    report: ReferenceReport { needs_minutes, ..reference.report },
                    ..reference
                });
            }
        }
        substeps *= 2;
    }
}

/// The runs so far, and the displacement fields of the last three.
#[derive(Default)]
struct Levels {
    substeps: Vec<u32>,
    differences: Vec<f64>,
    last: VecDeque<Run>,
    seconds: f64,
}

impl Levels {
    fn push(&mut self, substeps: u32, run: Run, frames: u32) {
        self.seconds += 1e-3 * run.ms_per_frame * f64::from(frames);
        if let Some(before) = self.last.back() {
            let (now, before) = (run.at_end(), before.at_end());
            self.differences.push(now.rms_to(before) / now.rms());
        }
        self.substeps.push(substeps);
        self.last.push_back(run);
        if self.last.len() > 3 {
            self.last.pop_front();
        }
    }

    /// The reference from the last three runs; none if there are fewer.
    fn limit(&self) -> Option<Reference> {
        let [first, second, third] = [self.last.front()?, self.last.get(1)?, self.last.get(2)?];
        let [before, last] = [second.at_end().rms_to(first.at_end()), third.at_end().rms_to(second.at_end())];
        let shrinks = before / last;
        let order = (CONVERGES..CHANCE).contains(&shrinks).then(|| shrinks.log2().min(HIGHEST_ORDER));
        let factor = order.map_or(0.0, |order| 1.0 / (2_f64.powf(order) - 1.0));
        let pairs = third.fields.iter().zip(&second.fields);
        let fields: Vec<Field> = pairs.map(|(now, before)| now.beyond(before, factor)).collect();
        let limit = fields.last()?;
        let off = if order.is_some() { limit.rms_to(third.at_end()) } else { f64::max(last, 0.5 * before) };
        let report = ReferenceReport {
            substeps: self.substeps.clone(),
            differences: self.differences.clone(),
            order,
            error: off / limit.rms(),
            displacement_mm: 1e3 * limit.rms(),
            growths_mm: third
                .growths_mm
                .iter()
                .zip(&second.growths_mm)
                .map(|(now, before)| now + factor * (now - before))
                .collect(),
            seconds: self.seconds,
            needs_minutes: None,
        };
        Some(Reference { fields, report })
    }

    /// Estimated minutes until the last level has twice the scene's substeps; none if it has them.
    fn needs_minutes(&self, own_substeps: u32) -> Option<f64> {
        let enough = f64::from(own_substeps) * FINER_THAN_OWN;
        let last = f64::from(self.substeps.last().copied()?);
        let substep_s = self.seconds / self.substeps.iter().map(|&n| f64::from(n)).sum::<f64>();
        // Three levels take 7/4 of the time of the last one.
        let needed_s = SPARE * 1.75 * enough * substep_s / REFERENCE_SHARE;
        (last < enough).then(|| (needed_s / 60.0).max(f64::MIN_POSITIVE))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    /// Runs that end at `x(substeps)`, for three vertices.
    fn limit(x: impl Fn(f64) -> [f64; 3]) -> Reference {
        let mut levels = Levels::default();
        for substeps in [8, 16, 32, 64] {
            let x = x(f64::from(substeps));
            let field = Field(x.map(|x| Vector3::new(x as f32, 0.0, 1.0)).to_vec());
            let run =
                Run { ms_per_frame: 1.0, fields: vec![field], growths_mm: vec![x[0]], ..Run::default() };
            levels.push(substeps, run, 10);
        }
        levels.limit().unwrap()
    }

    #[test]
    fn the_limit_of_a_converging_sequence_is_found_with_its_order() {
        for order in [1.0, 2.0] {
            let found = limit(|s| [3.0 + s.powf(-order), 2.0 - 5.0 * s.powf(-order), 1.0]);
            let [x, y, _] = [found.fields[0].0[0].x, found.fields[0].0[1].x, 0.0];
            assert!((x - 3.0).abs() < 1e-5 && (y - 2.0).abs() < 1e-5, "{x} {y}");
            assert!((found.report.order.unwrap() - order).abs() < 1e-2);
            assert!(found.report.error < 1.1 * 5.0 / 64_f64.powf(order));
            assert!((found.report.growths_mm[0] - 3.0).abs() < 1e-4);
            let (error, factor) = (found.report.error, 2_f64.powf(order));
            for (error, substeps) in [(error, 64.0), (factor * error, 32.0), (error / factor, 128.0)] {
                assert!((f64::from(found.report.substeps_for(error).unwrap()) - substeps).abs() <= 1.0);
            }
            assert_eq!((found.report.differences.len(), found.report.substeps.len()), (3, 4));
        }
    }

    /// With a second power the estimated order is wrong. The reported uncertainty must still cover
    /// the true error.
    #[test]
    fn the_uncertainty_covers_the_true_error() {
        for c in [-20.0, -3.0, 3.0, 20.0] {
            let found = limit(|s| [3.0 + 1.0 / s + c / (s * s), 2.0 - c / s.powi(3), 1.0]);
            let exact = Field(vec![
                Vector3::new(3.0, 0.0, 1.0),
                Vector3::new(2.0, 0.0, 1.0),
                Vector3::new(1.0, 0.0, 1.0),
            ]);
            let error = found.fields[0].rms_to(&exact) / exact.rms();
            assert!(error <= found.report.error + 1e-7, "{c}: {error} {}", found.report.error);
        }
    }

    #[test]
    fn a_reference_that_is_not_finer_than_the_scene_says_what_it_needs() {
        let mut levels = Levels::default();
        for substeps in [8, 16, 32] {
            // Ten frames; each substep takes 1 s in all of them together.
            levels.push(substeps, Run { ms_per_frame: 100.0 * f64::from(substeps), ..Run::default() }, 10);
        }
        assert_eq!((levels.needs_minutes(8), levels.needs_minutes(16)), (None, None));
        // The levels 50, 100 and 200 take 350 s.
        let minutes = levels.needs_minutes(100).unwrap();
        assert!((minutes - SPARE * 350.0 / REFERENCE_SHARE / 60.0).abs() < 1e-9, "{minutes}");
    }

    #[test]
    fn a_sequence_that_does_not_converge_is_not_extrapolated() {
        let found = limit(|s| [3.0 + 0.1 * s.log2(), 2.0, 1.0]);
        assert_eq!((found.report.order, found.report.substeps_for(0.1)), (None, None));
        assert!((f64::from(found.fields[0].0[0].x) - 3.6).abs() < 1e-6);
        assert!((found.report.error - found.report.differences[2]).abs() < 1e-6 && found.report.error > 0.01);
    }
}
