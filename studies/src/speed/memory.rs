//! A whole run on a compressed CT of the paper's largest size: time and memory of its stages.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use crate::kit::{Checks, Failure, Program, Table, number_at, scene};

/// Voxels per axis of the paper's data set C.
const VOXELS: &str = "512,512,1152";
/// Longest time in which the CT may be read, s.
const MOST_READ_S: f64 = 3.0;
/// Largest memory while the CT is read, GB.
const MOST_READ_GB: f64 = 0.9;
/// Largest memory of the whole run, GB.
const MOST_GB: f64 = 6.0;

/// A stage of the run.
#[derive(Clone, Debug, Serialize)]
pub struct Stage {
    name: String,
    seconds: f64,
    /// Largest memory of the process during the stage, in 10⁹ bytes.
    peak_gb: f64,
}

/// Runs the demo on a phantom that is read from a `.nii.gz`, with the whole body and all outputs.
///
/// # Errors
/// The errors of [`Program::run`], or the system does not report the memory.
pub fn measure(program: &Program, folder: &Path, checks: &mut Checks) -> Result<Vec<Stage>, Failure> {
    std::fs::create_dir_all(folder)?;
    let ct = folder.join("large.nii.gz");
    program.run(|command| {
        command.args(["phantom", "--size", VOXELS, "--out"]).arg(&ct);
    })?;
    let set = [
        format!("volume={{path={ct:?}}}"),
        "lattice={vertices=[129,129,289],split=\"five\",region=\"whole\"}".to_owned(),
    ];
    let report = program.scene(&scene("demo"), &set, &["--frames", "10"], &folder.join("large"))?;
    std::fs::remove_file(&ct)?;
    let stages = report["stages"].as_array().into_iter().flatten();
    let stages: Vec<Stage> = stages.map(Stage::of).collect::<Result<_, _>>()?;
    let read = &stages[0];
    checks.add(
        format!(
            "C: the compressed CT is read in {:.2} s (at most {MOST_READ_S}) and {:.2} GB (at most {MOST_READ_GB})",
            read.seconds, read.peak_gb
        ),
        read.seconds <= MOST_READ_S && read.peak_gb <= MOST_READ_GB,
    );
    let peak = stages.iter().map(|stage| stage.peak_gb).fold(0.0, f64::max);
    checks.add(format!("C: the whole run takes {peak:.2} GB (at most {MOST_GB})"), peak <= MOST_GB);
    let voxels_gb = 2.0 * 512.0 * 512.0 * 1152.0 / 1e9;
    checks.control(
        format!("C: reading takes no less than the {voxels_gb:.2} GB of the voxels"),
        read.peak_gb > voxels_gb,
    );
    Ok(stages)
}

impl Stage {
    fn of(stage: &Value) -> Result<Self, Failure> {
        Ok(Self {
            name: stage["name"].as_str().unwrap_or_default().to_owned(),
            seconds: number_at(stage, "/ms")? / 1e3,
            peak_gb: number_at(stage, "/peak_bytes")? / 1e9,
        })
    }
}

/// The table of all stages.
pub fn table(stages: &[Stage]) -> Table {
    let mut table = Table::new(["stage", "time, s", "largest memory, GB"]);
    for Stage { name, seconds, peak_gb } in stages {
        table.add([name.clone(), format!("{seconds:.2}"), format!("{peak_gb:.2}")]);
    }
    table
}
