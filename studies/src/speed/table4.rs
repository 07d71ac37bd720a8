//! The sizes of the paper's Table 4, on the phantom.

use std::path::Path;
use std::time::Instant;

use cutis::solver::Solver;
use cutis::solver_cpu::SolverCpu;
use cutis::{Override, Scene};
use serde::Serialize;
use serde_json::Value;

use crate::kit::{Checks, Failure, Program, Table, number_at, scene};

/// A data set of the paper with its figures, on an RTX 3090. A pair is without and with STC.
struct DataSet {
    name: &'static str,
    volume: [usize; 3],
    lattice: [usize; 3],
    grouping_ms: [f64; 2],
    /// Solving and resampling.
    frame_ms: [f64; 2],
}

const DATA_SETS: [DataSet; 3] = [
    DataSet {
        name: "A",
        volume: [512, 512, 300],
        lattice: [129, 129, 76],
        grouping_ms: [1447.0, 1493.0],
        frame_ms: [74.06, 79.73],
    },
    DataSet {
        name: "B",
        volume: [512, 512, 544],
        lattice: [129, 129, 138],
        grouping_ms: [2753.0, 2773.0],
        frame_ms: [126.52, 131.89],
    },
    DataSet {
        name: "C",
        volume: [512, 512, 1152],
        lattice: [129, 129, 289],
        grouping_ms: [5384.0, 5438.0],
        frame_ms: [257.75, 266.08],
    },
];

/// Frames of a run, as in the paper.
const FRAMES: usize = 10;
/// Rounds over the variants, in turns. The shortest time counts.
const ROUNDS: usize = 2;

/// One data set on one backend. Pairs are without and with STC.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    data_set: &'static str,
    backend: String,
    lattice: [usize; 3],
    vertices: f64,
    edges: f64,
    skin_triangles: f64,
    grouping_ms: [f64; 2],
    frame_ms: [f64; 2],
    /// Update of a kept output after each frame. `None` on a GPU, which has no updates.
    update_ms: Option<[f64; 2]>,
    whole_ms: [f64; 2],
    paper_grouping_ms: [f64; 2],
    paper_frame_ms: [f64; 2],
}

/// Measures all data sets on all backends.
///
/// # Errors
/// The errors of [`Program::scene`].
pub fn measure(
    program: &Program,
    backends: &[String],
    folder: &Path,
    checks: &mut Checks,
) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for backend in backends {
        for set in &DATA_SETS {
            let mut row = Row {
                data_set: set.name,
                backend: backend.clone(),
                lattice: set.lattice,
                vertices: 0.0,
                edges: 0.0,
                skin_triangles: 0.0,
                grouping_ms: [f64::INFINITY; 2],
                frame_ms: [f64::INFINITY; 2],
                update_ms: None,
                whole_ms: [f64::INFINITY; 2],
                paper_grouping_ms: set.grouping_ms,
                paper_frame_ms: set.frame_ms,
            };
            let mut growth_mm = [0.0; 2];
            for _ in 0..ROUNDS {
                for (n, without) in [&["--without", "stc"][..], &[]].into_iter().enumerate() {
                    growth_mm[n] = row.run(n, set, program, without, folder)?;
                }
            }
            let name = format!("{} on {backend}", set.name);
            let [without, with] = growth_mm;
            checks.add(
                format!("{name}: with STC the wound grows, by {with:.2} mm in {FRAMES} frames"),
                with > 0.5,
            );
            checks.control(format!("{name}: without STC it does not, {without:.2} mm"), without.abs() < 0.05);
            if backend == "cpu" {
                row.update_ms = Some([row.updates(set, &["stc"], checks)?, row.updates(set, &[], checks)?]);
            }
            rows.push(row);
        }
    }
    Ok(rows)
}

impl Row {
    /// Runs the paper's frame without (0) or with (1) STC. Returns the growth of the wound, mm.
    fn run(
        &mut self,
        n: usize,
        set: &DataSet,
        program: &Program,
        without: &[&str],
        folder: &Path,
    ) -> Result<f64, Failure> {
        let changes = self.changes(set).map(|[key, value]| format!("{key}={value}"));
        let frames = FRAMES.to_string();
        let options = [&["--frames", frames.as_str(), "--without", "volume"], without].concat();
        let report = program.scene(&scene("demo-paper"), &changes, &options, folder)?;
        self.vertices = number_at(&report, "/sizes/vertices")?;
        self.edges = number_at(&report, "/sizes/edges")?;
        self.skin_triangles = number_at(&report, "/sizes/skin_triangles")?;
        let least = |old: &mut f64, new: f64| *old = old.min(new);
        least(&mut self.grouping_ms[n], stage_ms(&report, "constraints and colors")?);
        least(&mut self.frame_ms[n], number_at(&report, "/frames/ms_mean")?);
        least(&mut self.whole_ms[n], stage_ms(&report, "resample the CT")?);
        Ok(number_at(&report, "/wound/final_mm")? - number_at(&report, "/wound/initial_mm")?)
    }
}

impl Row {
    /// The paper's formulation, as keys of the scene and their values.
    fn changes(&self, set: &DataSet) -> [[String; 2]; 7] {
        [
            ["volume.phantom", &format!("{{size={:?},seed=1}}", set.volume)],
            ["lattice", &format!("{{vertices={:?}}}", set.lattice)],
            ["solver.formulation", "pbd"],
            ["solver.substeps", "1"],
            ["solver.iterations", "5"],
            ["solver.backend", &self.backend],
            ["output", "{report=true,volume=true}"],
        ]
        .map(|change| change.map(str::to_owned))
    }

    /// Time in ms to update a kept output after a frame, in the mean of all frames. Checks that the
    /// last output is that of a resampling from the beginning.
    fn updates(&self, set: &DataSet, without: &[&str], checks: &mut Checks) -> Result<f64, Failure> {
        let overrides = self.changes(set).map(|[key, value]| Override { key, value });
        let mut loaded = Scene::load(&scene("demo-paper"), &overrides)?;
        for kind in [&["volume"], without].concat() {
            loaded.scene.constraints.remove(kind);
        }
        let (built, ct) = cutis::build_system_and_ct(&loaded)?;
        let mut solver = SolverCpu::new(built.system, built.settings, None)?;
        let mut resampler = ct.resampler()?;
        resampler.update(&ct.follow(&solver.positions()?))?;
        let at_rest = resampler.voxels().to_vec();
        let mut seconds = 0.0;
        for _ in 0..FRAMES {
            solver.step(1)?;
            let positions = solver.positions()?;
            let start = Instant::now();
            resampler.update(&ct.follow(&positions))?;
            seconds += start.elapsed().as_secs_f64();
        }
        let (whole, _) = ct.resample(&ct.follow(&solver.positions()?))?;
        let name = if without.is_empty() { "with" } else { "without" };
        checks.add(
            format!("{}: {name} STC the updated output has the bits of a new one", set.name),
            resampler.voxels() == whole.voxels(),
        );
        if without.is_empty() {
            let changed = resampler.voxels().iter().zip(&at_rest).filter(|(now, rest)| now != rest).count();
            checks
                .control(format!("{}: {changed} voxels differ from those at rest", set.name), changed > 1000);
        }
        Ok(seconds * 1e3 / FRAMES as f64)
    }
}

/// Time of a stage of a run, ms.
fn stage_ms(report: &Value, name: &str) -> Result<f64, Failure> {
    let stages = report["stages"].as_array().into_iter().flatten();
    let stage = stages.into_iter().find(|stage| stage["name"] == name);
    number_at(stage.unwrap_or(&Value::Null), "/ms")
}

/// The table of all rows.
pub fn table(rows: &[Row]) -> Table {
    let mut table = Table::new([
        "data set",
        "backend",
        "lattice",
        "vertices",
        "edges",
        "skin triangles",
        "constraints and groups, ms",
        "paper: grouping, ms",
        "solving a frame, ms",
        "resampling of what moved, ms",
        "resampling of the whole volume, ms",
        "paper: solving and resampling, ms",
    ]);
    let pair = |[without, with]: [f64; 2]| format!("{without:.0} / {with:.0}");
    for row in rows {
        let [i, j, k] = row.lattice;
        table.add([
            row.data_set.to_owned(),
            row.backend.clone(),
            format!("{i} × {j} × {k}"),
            row.vertices.to_string(),
            row.edges.to_string(),
            row.skin_triangles.to_string(),
            pair(row.grouping_ms),
            pair(row.paper_grouping_ms),
            pair(row.frame_ms),
            row.update_ms.map_or("–".into(), pair),
            pair(row.whole_ms),
            pair(row.paper_frame_ms),
        ]);
    }
    table
}
