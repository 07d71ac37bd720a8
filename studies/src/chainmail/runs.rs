//! Runs of scenes and their results.

use std::path::Path;

use cutis::report::Report;
use cutis::{Override, RunOptions, Scene, Silent};
use nalgebra::Point3;

use super::{Failure, set};
use crate::kit::Checks;

/// Bytes of a checkpoint before the positions.
const HEADER: usize = 52;

/// Runs a scene of `fixtures/scenes`.
pub(super) fn run(scene: &str, set: &[Override], out: &Path) -> Result<Report, Failure> {
    eprintln!(
        "  {scene} {}",
        set.iter().map(|o| format!("{}={}", o.key, o.value)).collect::<Vec<_>>().join(" ")
    );
    let loaded = Scene::load(&crate::kit::scene(scene), set)?;
    Ok(cutis::run(&loaded, &RunOptions { out: out.into(), resume: false }, &Silent)?)
}

/// Runs a scene without outputs. Returns the report, the longest frame in ms, and the final
/// positions in local meters.
pub(super) fn positions(
    scene: &str,
    changes: &[Override],
    out: &Path,
) -> Result<(Report, f64, Vec<Point3<f32>>), Failure> {
    let bare = [
        set("output", "{ report = true }"),
        set("run.checkpoint_every", "1000000"),
        set("solver.backend", "\"cpu\""),
    ];
    let report = run(scene, &[changes, &bare].concat(), out)?;
    let bytes = std::fs::read(cutis::RunFolder(out.into()).checkpoint())?;
    let numbers: Vec<f32> = bytes[HEADER..]
        .chunks_exact(4)
        .take(3 * report.sizes.vertices)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    let slowest_ms = column(out, 2)?.into_iter().fold(0.0, f64::max);
    Ok((report, slowest_ms, numbers.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])).collect()))
}

/// A column of a run's `frames.csv`.
fn column(out: &Path, n: usize) -> Result<Vec<f64>, Failure> {
    let table = std::fs::read_to_string(cutis::RunFolder(out.into()).frames())?;
    let value = |line: &str| line.split(',').nth(n).and_then(|value| value.parse().ok());
    Ok(table.lines().skip(1).filter_map(value).collect())
}

/// A run of an unchanged scene with all outputs.
pub(super) struct WholeRun {
    pub(super) scene: String,
    pub(super) report: Report,
    /// Longest frame, ms.
    pub(super) slowest_ms: f64,
    /// Opening of the wound just before the cut and at the end, mm.
    pub(super) opening_mm: [f64; 2],
}

impl WholeRun {
    pub(super) fn of(scene: &str, set: &[Override], out: &Path) -> Result<Self, Failure> {
        let report = run(scene, set, out)?;
        let (times, frames, gapes) = (column(out, 1)?, column(out, 2)?, column(out, 3)?);
        let at_s = report.scene.incision.first().map_or(0.0, |incision| incision.at_s);
        let before = times.iter().rposition(|&time| time <= at_s).unwrap_or(0);
        let opening = |row: usize| gapes.get(row).copied().unwrap_or(f64::NAN);
        Ok(Self {
            scene: scene.into(),
            slowest_ms: frames.iter().copied().fold(0.0, f64::max),
            opening_mm: [opening(before), opening(times.len().saturating_sub(1))],
            report,
        })
    }

    /// Time of one part of a frame, ms.
    pub(super) fn part_ms(&self, name: &str) -> f64 {
        let parts = &self.report.costs.parts;
        parts.iter().filter(|part| part.part == name).filter_map(|part| part.ms_per_frame).sum()
    }

    pub(super) fn stage_s(&self, name: &str) -> f64 {
        let stages = self.report.stages.iter();
        stages.filter(|stage| stage.name == name).map(|stage| stage.ms).sum::<f64>() / 1e3
    }

    pub(super) fn check(&self, checks: &mut Checks) {
        let scene = &self.scene;
        let Some(model) = &self.report.chainmail else {
            return checks.add(format!("{scene}: the model is ChainMail"), false);
        };
        let target = self
            .report
            .scene
            .handle
            .iter()
            .map(|handle| handle.displacement_mm().iter().map(|mm| mm * mm).sum::<f64>().sqrt());
        let target = target.fold(0.0, f64::max);
        let off = (self.report.max_displacement_mm - target).abs();
        let mut add = |what: &str, holds| checks.add(format!("{scene}: {what}"), holds);
        add("no link is beyond its limits", model.violated_links == 0);
        add("the farthest dragged element is at its target within 0.1 µm", off < 1e-4);
        add(
            "the energy at the end is below the energy after the last drag",
            model.energy_after < model.energy_before,
        );
        add("relaxation has converged", model.settled);
        let opens = self.opening_mm[1] > self.opening_mm[0] + 1.0;
        add("the wound opens by at least 1 mm after the cut", opens);
    }
}
