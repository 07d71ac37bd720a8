//! Runs of scenes, and what they leave.

use std::path::Path;

use cutis::report::Report;
use cutis::{Override, RunOptions, Scene, Silent};
use nalgebra::Point3;

use super::{Failure, set};

/// Bytes of a checkpoint before the positions.
const HEADER: usize = 52;

/// Runs a scene of `fixtures/scenes`.
pub(super) fn run(scene: &str, set: &[Override], out: &Path) -> Result<Report, Failure> {
    eprintln!(
        "  {scene} {}",
        set.iter().map(|o| format!("{}={}", o.key, o.value)).collect::<Vec<_>>().join(" ")
    );
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/scenes")).join(scene);
    let loaded = Scene::load(&file.with_extension("toml"), set)?;
    Ok(cutis::run(&loaded, &RunOptions { out: out.into(), resume: false }, &Silent)?)
}

/// As [`run`], with no output but the longest frame, in ms, and where the vertices end up, in local meters.
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

/// A scene as it stands, with all outputs.
pub(super) struct Whole {
    pub(super) scene: String,
    pub(super) report: Report,
    /// Longest frame, ms.
    pub(super) slowest_ms: f64,
    /// Opening of the wound, mm: just before the cut, and at the end.
    pub(super) opening_mm: [f64; 2],
}

impl Whole {
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

    /// Milliseconds of a frame in one part.
    pub(super) fn part_ms(&self, name: &str) -> f64 {
        let parts = &self.report.costs.parts;
        parts.iter().filter(|part| part.part == name).filter_map(|part| part.ms_per_frame).sum()
    }

    pub(super) fn stage_s(&self, name: &str) -> f64 {
        let stages = self.report.stages.iter();
        stages.filter(|stage| stage.name == name).map(|stage| stage.ms).sum::<f64>() / 1e3
    }

    pub(super) fn summary(&self) -> String {
        format!(
            "{}: {:.2} ms per frame, opening {:.2} -> {:.2} mm, {:?}",
            self.scene,
            self.report.frames.ms_mean,
            self.opening_mm[0],
            self.opening_mm[1],
            self.report.chainmail
        )
    }

    pub(super) fn checks(&self) -> Vec<(String, bool)> {
        let Some(told) = &self.report.chainmail else {
            return vec![(format!("{}: the model is ChainMail", self.scene), false)];
        };
        let asked = self
            .report
            .scene
            .handle
            .iter()
            .map(|handle| handle.move_mm.iter().map(|mm| mm * mm).sum::<f64>().sqrt());
        let asked = asked.fold(0.0, f64::max);
        let off = (self.report.max_displacement_mm - asked).abs();
        [
            ("no link is beyond its limits", told.violated_links == 0),
            ("what is dragged farthest is where it was told, within 0.1 µm", off < 1e-4),
            (
                "the energy is lower at the end than after the last drag",
                told.energy_after < told.energy_before,
            ),
            ("relaxation came to its end", told.settled),
            ("the cut lets the wound open by at least 1 mm", self.opening_mm[1] > self.opening_mm[0] + 1.0),
        ]
        .map(|(what, holds)| (format!("{}: {what}", self.scene), holds))
        .into()
    }
}
