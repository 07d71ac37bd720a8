//! `cargo xtask results`: the main job on the phantom and on the real volumes, with skin tension and without, written to
//! `docs/results/`. Ends with an error if a wound does not open, does not settle, or opens without skin tension.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::workspace::Workspace;

/// Scenes of `fixtures/scenes` and the real volume that each is laid out for.
const SCENES: [(&str, Option<&str>); 4] = [
    ("demo", None),
    ("abdomen-incision", Some("abdomen_ts_122x101x112.nii.gz")),
    ("thigh-incision", Some("leg_sts013_129x110x114.nii.gz")),
    ("head-incision", Some("headphantom_imagex_512x512x209.nii.gz")),
];

/// With skin tension the lips part by at least this much, mm.
const LEAST_GROWTH_MM: f64 = 2.0;
/// Largest relative change of the opening over the last ten frames.
const MOST_CHANGE: f64 = 0.01;
/// Without skin tension the opening stays within this share of the initial one.
const MOST_DRIFT: f64 = 0.05;
/// Frames of the comparison between numbers of threads.
const THREAD_FRAMES: &str = "30";

/// Runs the scenes and writes the page and the phantom's pictures.
pub fn run(workspace: &Workspace) -> Result<()> {
    let data = workspace.test_data()?;
    let scratch = workspace.target_dir()?.join("results");
    let docs = workspace.root.join("docs/results");
    fs::create_dir_all(&docs)?;
    let (mut rows, mut machine) = (String::new(), Value::Null);
    let mut notes = Vec::new();
    for (scene, volume) in SCENES {
        let set = match (&data, volume) {
            (_, None) => Vec::new(),
            (Some(data), Some(name)) => {
                vec!["--set".into(), format!("volume.path={}", data.join("ct").join(name).display())]
            }
            (None, Some(name)) => {
                notes.push(format!("`{scene}` was left out: {name} is not on this machine."));
                continue;
            }
        };
        let with = Outcome::of(workspace, scene, &set, &scratch.join(scene))?;
        let mut without_set = set.clone();
        without_set.extend(["--without".into(), "stc".into(), "--set".into(), "output={report=true}".into()]);
        let without = Outcome::of(workspace, scene, &without_set, &scratch.join(format!("{scene}-without")))?;
        with.check(scene, &without)?;
        rows.push_str(&with.row(scene, &without));
        machine = with.report["machine"].clone();
        if volume.is_none() {
            notes.push(convergence(workspace, scene, &scratch)?);
            for picture in ["before", "after", "slice"] {
                let from = scratch.join(scene).join(format!("{picture}.png"));
                fs::copy(&from, docs.join(format!("demo-{picture}.png"))).context("copying a picture")?;
            }
        }
        if scene == "abdomen-incision" {
            same_for_any_thread_count(workspace, scene, &set, &scratch)?;
            notes.push(format!(
                "`{scene}`, {THREAD_FRAMES} frames of 5 substeps: the same bits for 1, 2, 3 and 8 threads, and other bits for another \
                 stiffness (the control)."
            ));
        }
    }
    fs::write(docs.join("main-job.md"), page(workspace, &rows, &machine, &notes)?)?;
    println!("written: {}", docs.join("main-job.md").display());
    Ok(())
}

/// One run: its report and the mean opening of the wound by frame.
struct Outcome {
    report: Value,
    gapes: Vec<f64>,
}

impl Outcome {
    fn of(workspace: &Workspace, scene: &str, set: &[String], out: &Path) -> Result<Self> {
        println!("{scene} {}", set.join(" "));
        run_program(workspace, scene, set, out)?;
        let report = serde_json::from_slice(&fs::read(out.join("report.json"))?)?;
        let table = fs::read_to_string(out.join("frames.csv"))?;
        let gape = |line: &str| line.split(',').nth(3).and_then(|value| value.parse().ok());
        let gapes: Option<Vec<f64>> = table.lines().skip(1).map(gape).collect();
        Ok(Self { report, gapes: gapes.context("frames.csv has no column of openings")? })
    }

    fn wound(&self, key: &str) -> f64 {
        self.report["wound"][key].as_f64().unwrap_or(f64::NAN)
    }

    fn growth(&self) -> f64 {
        self.wound("final_mm") - self.wound("initial_mm")
    }

    /// Largest distance of the opening in the last ten frames from its last value, as a share of that.
    fn change(&self) -> f64 {
        let last = self.wound("final_mm");
        self.gapes.iter().rev().take(11).map(|gape| ((gape - last) / last).abs()).fold(0.0, f64::max)
    }

    fn check(&self, scene: &str, without: &Self) -> Result<()> {
        let (growth, change) = (self.growth(), self.change());
        ensure!(growth >= LEAST_GROWTH_MM, "{scene}: the wound opens by {growth:.2} mm only");
        ensure!(change < MOST_CHANGE, "{scene}: the wound still changes by {:.2} %", 100.0 * change);
        let drift = (without.growth() / without.wound("initial_mm")).abs();
        ensure!(
            drift <= MOST_DRIFT,
            "{scene}: without skin tension the wound changes by {:.1} %",
            100.0 * drift
        );
        Ok(())
    }

    fn row(&self, scene: &str, without: &Self) -> String {
        let number = |path: &str| self.report.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN);
        let stages = self.report["stages"].as_array().map(Vec::as_slice).unwrap_or_default();
        let total: f64 = stages.iter().filter_map(|stage| stage["ms"].as_f64()).sum();
        format!(
            "| {scene} | {} | {} | {:.2} → {:.2} | **{:.2}** | {:.2} % | {:.2} | {:.0} | {:.0} | {} |\n",
            number("/sizes/vertices"),
            number("/sizes/tets"),
            self.wound("initial_mm"),
            self.wound("final_mm"),
            self.growth(),
            100.0 * self.change(),
            without.growth(),
            number("/frames/ms_mean"),
            total / 1e3,
            number("/resample/folds"),
        )
    }
}

fn run_program(workspace: &Workspace, scene: &str, set: &[String], out: &Path) -> Result<()> {
    let run = |command: &mut Command| {
        command.arg("run").arg(format!("fixtures/scenes/{scene}.toml")).args(set).arg("--out").arg(out);
    };
    workspace.run_program(run).map(drop)
}

/// The opening of a scene's wound by the number of substeps: how far its own setting is from the limit.
fn convergence(workspace: &Workspace, scene: &str, scratch: &Path) -> Result<String> {
    let mut table = format!(
        "How the opening of `{scene}` depends on the substeps:\n\n| substeps | growth, mm | ms/frame |\n|---|---|---|\n"
    );
    for substeps in [5, 10, 20, 40, 80] {
        let change = format!("solver.substeps={substeps}");
        let set = ["--set".into(), change, "--set".into(), "output={report=true}".into()];
        let outcome = Outcome::of(workspace, scene, &set, &scratch.join(format!("{scene}-substeps")))?;
        let ms = outcome.report.pointer("/frames/ms_mean").and_then(Value::as_f64).unwrap_or(f64::NAN);
        let _ = writeln!(table, "| {substeps} | {:.2} | {ms:.0} |", outcome.growth());
    }
    table.push_str(
        "\nWith too few substeps skin tension acts softer than its modulus: a projection moves a vertex only as far as its \
         inertia allows within a substep. `cutis check` and `cutis run` say so, with the number that would do.",
    );
    Ok(table)
}

/// Compares the last states of runs with 1, 2, 3 and 8 threads byte for byte.
fn same_for_any_thread_count(
    workspace: &Workspace,
    scene: &str,
    set: &[String],
    scratch: &Path,
) -> Result<()> {
    let state = |name: &str, change: &str| -> Result<Vec<u8>> {
        println!("{scene} {change}");
        let out = scratch.join(format!("{scene}-{name}"));
        let mut set = set.to_vec();
        let more = ["run.checkpoint_every=1000", "solver.substeps=5", "output={report=true}", change];
        set.extend(more.iter().flat_map(|change| ["--set".into(), (*change).into()]));
        set.extend(["--frames".into(), THREAD_FRAMES.into()]);
        run_program(workspace, scene, &set, &out)?;
        // Past the header, whose fingerprint tells the scenes apart, and before the checksum.
        let bytes = fs::read(out.join("checkpoint.bin"))?;
        Ok(bytes[52..bytes.len() - 32].to_vec())
    };
    let one = state("1-thread", "solver.threads=1")?;
    for threads in [2, 3, 8] {
        let other = state(&format!("{threads}-threads"), &format!("solver.threads={threads}"))?;
        ensure!(one == other, "{scene}: {threads} threads give other bits than 1");
    }
    let control = state("control", "constraints.distance.youngs_modulus_pa=5.1e3")?;
    ensure!(one != control, "the comparison between numbers of threads cannot fail");
    Ok(())
}

fn page(workspace: &Workspace, rows: &str, machine: &Value, notes: &[String]) -> Result<String> {
    let commit = workspace.commit()?;
    let mut page = format!(
        "# The main job: with skin tension and without\n\n\
         Written by `cargo xtask results` at commit {} on {} ({} cores, {}).\n\
         Scenes: `fixtures/scenes/`. *growth* is what skin tension opens the wound by (mean distance of the lips, mm); \
         *change* the largest difference from the last value over the last ten frames; *without* the growth in the same \
         scene with `--without stc`. Times are wall time on a machine that did other work too.\n\n\
         | scene | vertices | tetrahedra | opening, mm | growth | change | without | ms/frame | whole run, s | folds |\n\
         |---|---|---|---|---|---|---|---|---|---|\n{rows}\n",
        commit,
        machine["cpu"].as_str().unwrap_or("an unknown processor"),
        machine["cores"],
        machine["system"].as_str().unwrap_or_default(),
    );
    for note in notes {
        let _ = writeln!(page, "{note}\n");
    }
    page.push_str(
        "The command fails unless each wound grows by at least 2 mm, changes by less than 1 % at the end, and stays within \
         5 % of its initial opening without skin tension.\n\n\
         The phantom, cut and before the first frame, and after the last one:\n\n\
         ![before](demo-before.png) ![after](demo-after.png)\n\n\
         ![slice across the wound](demo-slice.png)\n",
    );
    Ok(page)
}
