//! `cutis tune` on the demo, and full runs of the tuned scene and of the demo with the picked
//! setting. The study fails if the runs differ from the prediction. The load of the machine
//! changes, so that the two scenes run in turns, and the ratio of their times counts too.

use std::fs;
use std::io::Write;
use std::path::Path;

use anyhow::{Context, bail};
use clap::Parser;
use serde_json::Value;

use crate::kit::{
    Checks, Failure, Page, Program, Provenance, Table, number, number_at, optional, percent, results, root,
    target_dir,
};

/// Tunes the demo and compares a full run with the prediction.
#[derive(Clone, Debug, Parser)]
#[command(name = "tuning", bin_name = "cargo xtask study tuning")]
pub struct Options {
    /// Write the tables of docs/results/tuning.md.
    #[arg(long)]
    pub write: bool,
}

const SCENE: &str = "fixtures/scenes/demo.toml";
/// Largest relative difference of the ratio of times and of the openings from the prediction.
const TOLERANCE: f64 = 0.2;
/// Runs of each scene, in turns. The shortest mean time of a frame counts.
const TURNS: usize = 3;
/// Tables of the page.
pub const TABLES: [&str; 6] = ["provenance", "prediction", "settings", "regions", "omissions", "checks"];

/// Tunes, runs and compares. Returns whether all checks hold.
///
/// # Errors
/// The program fails, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("tuning", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "tuning --write" } else { "tuning" });
    let program = Program::build()?;
    let folder = target_dir()?.join("studies/tuning");
    fs::create_dir_all(&folder)?;
    // A path relative to the root, so that the calibration contains no path of this machine.
    let copy = folder.strip_prefix(root()).unwrap_or(&folder).join("demo-tuned.toml");
    eprintln!("cutis tune {SCENE}");
    let document = program.run(|command| {
        command.args(["tune", SCENE, "--json", "--force", "--out"]).arg(&copy);
    })?;
    let tuning: Value = serde_json::from_slice(&document).context("the calibration is not JSON")?;
    let picked = &tuning["picked"];
    let region = tuning["regions"].as_array().into_iter().flatten().find(|region| region["picked"] == true);
    let measured = region.unwrap_or(picked);
    let run_of = |value: &Value| -> Result<TunedRun, Failure> {
        let growth_mm = number_at(value, "/wounds/0/growth_mm")?;
        Ok(TunedRun { ms: number_at(value, "/ms_per_frame")?, growth_mm })
    };
    let (predicted, predicted_whole) = (run_of(measured)?, run_of(picked)?);
    let set = [solver(picked)?.to_vec(), vec!["lattice.region=whole".to_owned()]].concat();
    let one_substep = ["solver.substeps=1".to_owned()];
    let whole_scene = root().join(SCENE);
    let jobs: [(&Path, &[String]); 3] = [(&whole_scene, &set), (&copy, &[]), (&copy, &one_substep)];
    let mut runs: [Option<TunedRun>; 3] = [None, None, None];
    for _ in 0..TURNS {
        for (run, (scene, set)) in runs.iter_mut().zip(jobs) {
            let again = TunedRun::of_run(&program, scene, &folder.join("run"), set)?;
            *run = Some(run.take().filter(|first| first.ms <= again.ms).unwrap_or(again));
        }
    }
    let [Some(whole), Some(found), Some(control)] = runs else { bail!("no turns") };

    let mut checks = Checks::default();
    let within = percent(TOLERANCE);
    let share = predicted.ms / predicted_whole.ms;
    let agrees = |run: &TunedRun| near(run.growth_mm, predicted.growth_mm) && near(run.ms / whole.ms, share);
    checks.add(format!("share of the time and opening of the run are within {within}"), agrees(&found));
    checks.add(format!("time of the run is within {within}"), near(found.ms, predicted.ms));
    let opening = near(whole.growth_mm, predicted_whole.growth_mm);
    checks.add(format!("the opening of the whole body is within {within}"), opening);
    checks.control(format!("one substep is not within {within}"), !agrees(&control));
    let head = match region {
        None => setting(picked),
        Some(region) => format!("{}, region of {}", setting(picked), size(region)),
    };
    let mut prediction = Table::new([head.as_str(), "ms/frame", "growth of the opening, mm"]);
    for (name, TunedRun { ms, growth_mm }) in [
        ("whole body, predicted", &predicted_whole),
        ("whole body, full run", &whole),
        ("tuned scene, predicted", &predicted),
        ("tuned scene, full run", &found),
        ("control: one substep", &control),
    ] {
        prediction.add([name.to_owned(), format!("{ms:.1}"), format!("{growth_mm:.4}")]);
    }
    writeln!(out, "{}", prediction.markdown())?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("provenance", &provenance.markdown())?;
        page.set("prediction", &prediction.markdown())?;
        page.set("settings", &settings(&tuning))?;
        page.set("regions", &regions(&tuning).markdown())?;
        page.set("omissions", &omissions(&tuning).markdown())?;
        page.set("checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// Time of a frame and growth of the opening.
struct TunedRun {
    ms: f64,
    growth_mm: f64,
}

impl TunedRun {
    fn of_run(program: &Program, scene: &Path, out: &Path, set: &[String]) -> Result<Self, Failure> {
        let set = [set, &["output={report=true}".to_owned()]].concat();
        let report = program.scene(scene, &set, &[], out)?;
        let growth_mm = number_at(&report, "/wound/final_mm")? - number_at(&report, "/wound/initial_mm")?;
        Ok(Self { ms: number_at(&report, "/frames/ms_mean")?, growth_mm })
    }
}

fn near(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() <= TOLERANCE
}

/// Values for `--set` of a measured setting.
fn solver(candidate: &Value) -> Result<[String; 4], Failure> {
    let setting = &candidate["setting"];
    let formulation = setting["formulation"].as_str().context("no formulation")?;
    let number = |key: &str| format!("solver.{key}={}", setting[key]);
    let formulation = format!("solver.formulation={formulation}");
    Ok([formulation, number("substeps"), number("iterations"), number("relaxation")])
}

/// The measured settings, the reference, and the number of settings that were not finished.
fn settings(tuning: &Value) -> String {
    let reference = &tuning["reference"];
    let finest = reference["substeps"].as_array().and_then(|runs| runs.last()).and_then(Value::as_u64);
    let mut table = Table::new(["setting", "ms/frame", "error", "growth of the opening, mm", "note"]);
    let mut unfinished = 0;
    for candidate in tuning["candidates"].as_array().into_iter().flatten() {
        if candidate["abandoned"].is_string() {
            unfinished += 1;
            continue;
        }
        table.add([
            setting(candidate),
            optional(candidate["ms_per_frame"].as_f64(), number),
            optional(candidate["error"].as_f64(), percent),
            optional(candidate["wounds"][0]["growth_mm"].as_f64(), number),
            if candidate["own"] == true { "setting of the scene".into() } else { String::new() },
        ]);
    }
    let warnings = tuning["warnings"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let warnings: String = warnings.map(|warning| format!("\n> {warning}\n")).collect();
    format!(
        "{}\nReference: {} substeps of one iteration in `f64`, extrapolated, with an error of at most {}. \
         {unfinished} settings were not measured to the end. Warnings of the program:\n{warnings}",
        table.markdown(),
        finest.unwrap_or_default(),
        optional(reference["error"].as_f64(), percent),
    )
}

/// The regions that were tried.
fn regions(tuning: &Value) -> Table {
    let mut table = Table::new([
        "region",
        "ms/frame",
        "share of the time",
        "saved MB",
        "error of the opening",
        "growth of the opening, mm",
        "note",
    ]);
    for region in tuning["regions"].as_array().into_iter().flatten() {
        let note = if region["picked"] == true { "picked" } else { "" };
        table.add([
            size(region),
            optional(region["ms_per_frame"].as_f64(), number),
            optional(region["time_share"].as_f64(), percent),
            optional(region["saved_bytes"].as_f64(), |bytes| format!("{:.1}", bytes / 1e6)),
            optional(region["error"].as_f64(), percent),
            optional(region["wounds"][0]["growth_mm"].as_f64(), number),
            region["skipped"].as_str().unwrap_or(note).into(),
        ]);
    }
    table
}

/// Size of a region, and of its fine zone if its lattice is graded.
fn size(region: &Value) -> String {
    let graded = region["grading_mm"].as_f64();
    let graded = graded.map_or_else(String::new, |mm| format!(", graded from {mm} mm"));
    format!("{} mm{graded}", region["around_mm"])
}

/// Cost and effect of each part of the scene.
fn omissions(tuning: &Value) -> Table {
    let mut table = Table::new([
        "omitted part",
        "saved ms/frame",
        "saved MB",
        "change of displacements",
        "growth of the opening, mm",
    ]);
    for omission in tuning["omissions"].as_array().into_iter().flatten() {
        table.add([
            omission["what"].as_str().unwrap_or_default().into(),
            optional(omission["saved_ms_per_frame"].as_f64(), number),
            optional(omission["saved_bytes"].as_f64(), |bytes| format!("{:.1}", bytes / 1e6)),
            optional(omission["change"].as_f64(), percent),
            optional(omission["wounds"][0]["growth_mm"].as_f64(), number),
        ]);
    }
    table
}

/// Formulation, substeps × iterations, and over-relaxation if there is any.
fn setting(candidate: &Value) -> String {
    let setting = &candidate["setting"];
    let relaxation = setting["relaxation"].as_f64().filter(|relaxation| *relaxation != 1.0);
    format!(
        "{} {} × {}{}",
        setting["formulation"].as_str().unwrap_or_default(),
        setting["substeps"],
        setting["iterations"],
        relaxation.map_or_else(String::new, |relaxation| format!(", ω {relaxation}"))
    )
}
