//! The main job on the phantom and on real scans, with skin tension and without it. The study fails
//! if a wound does not open, does not settle, or opens without skin tension.

use std::fs;
use std::io::Write;
use std::path::Path;

use anyhow::{Context, ensure};
use clap::Parser;
use cutis::report::fixed;
use serde_json::Value;

use crate::kit::{
    Checks, Failure, Page, Program, Provenance, Row, Table, number_at, results, scene, target_dir,
};

/// Runs the main job with skin tension and without it.
#[derive(Clone, Debug, Parser)]
#[command(name = "main-job", bin_name = "cargo xtask study main-job")]
pub struct Options {
    /// Write the tables and pictures of docs/results/main-job.md. Needs all scans.
    #[arg(long)]
    pub write: bool,
}

/// Scenes of `fixtures/scenes`, and the scan of each.
pub const SCENES: [(&str, Option<&str>); 4] = [
    ("demo", None),
    ("abdomen-incision", Some("abdomen_ts_122x101x112.nii.gz")),
    ("thigh-incision", Some("leg_sts013_129x110x114.nii.gz")),
    ("head-incision", Some("headphantom_imagex_512x512x209.nii.gz")),
];
/// Tables of the page.
pub const TABLES: [&str; 4] = ["provenance", "scenes", "substeps", "checks"];

/// Smallest growth of the opening by skin tension, mm.
const LEAST_GROWTH_MM: f64 = 2.0;
/// Largest relative change of the opening over the last ten frames.
const MOST_CHANGE: f64 = 0.01;
/// Largest change of the opening without skin tension, mm.
const MOST_DRIFT_MM: f64 = 0.01;
/// Frames of the comparison of thread counts.
const THREAD_FRAMES: &str = "30";

/// `volume.path=FILE` for a scan, or nothing for a phantom. `None` if the scan is missing.
pub fn volume(scan: Option<&str>) -> Option<Vec<String>> {
    let Some(name) = scan else { return Some(Vec::new()) };
    let path = cutis_test_kit::scans::find(&format!("ct/{name}"))?;
    Some(vec![format!("volume.path={}", path.display())])
}

/// Runs the scenes. Returns whether all checks hold.
///
/// # Errors
/// The program fails, a scan is missing with `--write`, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("main-job", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "main-job --write" } else { "main-job" });
    let program = Program::build()?;
    let folder = target_dir()?.join("studies/main-job");
    let (mut jobs, mut checks) = (Vec::new(), Checks::default());
    for (name, scan) in SCENES {
        let Some(set) = volume(scan) else {
            ensure!(!options.write, "{name}: the page needs all scans (set CUTIS_TEST_DATA)");
            continue;
        };
        let job = Job {
            name,
            with: Opening::of(&program, name, &set, &[], &folder.join(name))?,
            without: Opening::of(
                &program,
                name,
                &[&set[..], &["output={report=true}".into()]].concat(),
                &["--without", "membrane"],
                &folder.join(format!("{name}-without")),
            )?,
        };
        job.check(&mut checks);
        jobs.push(job);
        if name == "abdomen-incision" {
            compare_thread_counts(&program, name, &set, &folder, &mut checks)?;
        }
    }
    let substeps = substeps(&program, &folder)?;
    writeln!(out, "{}\n{}", Table::of(&jobs).markdown(), substeps.markdown())?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("provenance", &provenance.markdown())?;
        page.set("scenes", &Table::of(&jobs).markdown())?;
        page.set("substeps", &substeps.markdown())?;
        page.set("checks", &checks.summary())?;
        for picture in ["before", "after", "slice"] {
            let from = folder.join("demo").join(format!("{picture}.png"));
            let to = results().join(format!("demo-{picture}.png"));
            fs::copy(&from, to).with_context(|| from.display().to_string())?;
        }
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// A run: its report, and the mean opening of the wound by frame.
struct Opening {
    report: Value,
    by_frame_mm: Vec<f64>,
}

impl Opening {
    fn of(
        program: &Program,
        name: &str,
        set: &[String],
        options: &[&str],
        out: &Path,
    ) -> Result<Self, Failure> {
        let report = program.scene(&scene(name), set, options, out)?;
        let table = fs::read_to_string(out.join("frames.csv"))?;
        let gape = |line: &str| line.split(',').nth(3).and_then(|value| value.parse().ok());
        let by_frame: Option<Vec<f64>> = table.lines().skip(1).map(gape).collect();
        Ok(Self { report, by_frame_mm: by_frame.context("frames.csv has no column of openings")? })
    }

    fn figure(&self, pointer: &str) -> f64 {
        number_at(&self.report, pointer).unwrap_or(f64::NAN)
    }

    fn growth_mm(&self) -> f64 {
        self.figure("/wound/final_mm") - self.figure("/wound/initial_mm")
    }

    /// Largest relative difference of the opening from its last value over the last ten frames.
    fn change(&self) -> f64 {
        let last = self.figure("/wound/final_mm");
        self.by_frame_mm.iter().rev().take(11).map(|gape| ((gape - last) / last).abs()).fold(0.0, f64::max)
    }
}

/// A scene with skin tension and without it.
struct Job {
    name: &'static str,
    with: Opening,
    without: Opening,
}

impl Job {
    fn check(&self, checks: &mut Checks) {
        let (name, growth, change) = (self.name, self.with.growth_mm(), self.with.change());
        let drift_mm = self.without.growth_mm().abs();
        checks.add(
            format!("{name}: the wound opens by at least {LEAST_GROWTH_MM} mm ({growth:.2})"),
            growth >= LEAST_GROWTH_MM,
        );
        checks.add(
            format!(
                "{name}: the opening changes by less than {MOST_CHANGE} in the last ten frames ({change:.4})"
            ),
            change < MOST_CHANGE,
        );
        checks.control(
            format!(
                "{name}: without skin tension the opening changes by at most {MOST_DRIFT_MM} mm ({drift_mm:.4})"
            ),
            drift_mm <= MOST_DRIFT_MM,
        );
    }
}

impl Row for Job {
    const COLUMNS: &'static [&'static str] = &[
        "scene",
        "vertices",
        "tetrahedra",
        "opening, mm",
        "growth, mm",
        "change at the end",
        "growth without skin tension, mm",
        "ms/frame",
        "whole run, s",
        "folded tetrahedra",
    ];

    fn cells(&self) -> Vec<String> {
        let figure = |pointer: &str| self.with.figure(pointer);
        let millimeters = |pointer: &str| fixed(figure(pointer), 2);
        let stages = self.with.report["stages"].as_array().into_iter().flatten();
        let total_ms: f64 = stages.filter_map(|stage| stage["ms"].as_f64()).sum();
        vec![
            self.name.into(),
            figure("/sizes/vertices").to_string(),
            figure("/sizes/tets").to_string(),
            format!("{} → {}", millimeters("/wound/initial_mm"), millimeters("/wound/final_mm")),
            format!("**{:.2}**", self.with.growth_mm()),
            format!("{:.2} %", 100.0 * self.with.change()),
            format!("{:.2}", self.without.growth_mm()),
            format!("{:.0}", figure("/frames/ms_mean")),
            format!("{:.0}", total_ms / 1e3),
            figure("/resample/folds").to_string(),
        ]
    }
}

/// The opening of the demo in XPBD by the number of substeps.
fn substeps(program: &Program, folder: &Path) -> Result<Table, Failure> {
    let mut table = Table::new(["substeps", "growth, mm", "ms/frame"]);
    for substeps in [5, 10, 20, 40, 80] {
        let fixed = ["solver.formulation=xpbd", "solver.iterations=1", "output={report=true}"];
        let set = [&fixed.map(str::to_owned)[..], &[format!("solver.substeps={substeps}")]].concat();
        let opening = Opening::of(program, "demo", &set, &[], &folder.join("demo-substeps"))?;
        let ms = opening.figure("/frames/ms_mean");
        table.add([substeps.to_string(), format!("{:.2}", opening.growth_mm()), format!("{ms:.0}")]);
    }
    Ok(table)
}

/// Compares the final states of runs with 1, 2, 3 and 8 threads byte by byte.
fn compare_thread_counts(
    program: &Program,
    name: &str,
    set: &[String],
    folder: &Path,
    checks: &mut Checks,
) -> Result<(), Failure> {
    let state = |run: &str, change: &str| -> Result<Vec<u8>, Failure> {
        let out = folder.join(format!("{name}-{run}"));
        let more = ["run.checkpoint_every=1000", "solver.substeps=5", "output={report=true}", change];
        let set = [set, &more.map(str::to_owned)].concat();
        program.scene(&scene(name), &set, &["--frames", THREAD_FRAMES], &out)?;
        // Without the header, whose fingerprint differs between the scenes, and without the
        // checksum.
        let bytes = fs::read(out.join("checkpoint.bin"))?;
        Ok(bytes[52..bytes.len() - 32].to_vec())
    };
    let one = state("1-thread", "solver.threads=1")?;
    for threads in [2, 3, 8] {
        let other = state(&format!("{threads}-threads"), &format!("solver.threads={threads}"))?;
        checks.add(format!("{name}: {threads} threads give the bits of one thread"), one == other);
    }
    let tenser = state("control", "constraints.membrane.tension_along_n_per_m=15.1")?;
    checks.control(format!("{name}: another tension gives other bits"), one != tenser);
    Ok(())
}
