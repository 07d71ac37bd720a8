//! `cargo xtask tuning`: `cutis tune` on the demo, and a full run of the tuned copy beside it. Writes `docs/results/tuning.md` and the
//! calibration itself, `tuning.json`. Ends with an error if the run does not keep what was promised.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::workspace::Workspace;

const SCENE: &str = "fixtures/scenes/demo.toml";
/// Time and opening of the run are within this share of what was promised.
const KEPT: f64 = 0.2;

/// Tunes, runs, compares, and writes the page.
pub fn run(workspace: &Workspace) -> Result<()> {
    let scratch = workspace.target_dir()?.join("tuning");
    fs::create_dir_all(&scratch)?;
    // The program runs in the root; what it writes into the calibration is then no path of this machine.
    let copy = scratch.strip_prefix(&workspace.root).unwrap_or(&scratch).join("demo-tuned.toml");
    println!("cutis tune {SCENE}");
    let document = workspace.run_program(|command| {
        command.args(["tune", SCENE, "--json", "--force", "--out"]).arg(&copy);
    })?;
    let tuning: Value = serde_json::from_slice(&document).context("the calibration is no JSON")?;
    let picked = &tuning["picked"];
    let promised =
        Opening { ms: number(picked, "/ms_per_frame")?, mm: number(picked, "/wounds/0/growth_mm")? };
    println!("cutis run {}", copy.display());
    let found = Opening::of_run(workspace, &copy, &scratch.join("run"), &[])?;
    ensure!(found.keeps(&promised), "promised {promised:?}, found {found:?}");
    println!("control: the same with one substep");
    let control = Opening::of_run(workspace, &copy, &scratch.join("control"), &["solver.substeps=1"])?;
    ensure!(!control.keeps(&promised), "the comparison cannot fail: {control:?} keeps {promised:?} too");

    let docs = workspace.root.join("docs/results");
    let page = page(workspace, &tuning, &promised, &found, &control)?;
    fs::write(docs.join("tuning.json"), &document)?;
    fs::write(docs.join("tuning.md"), page)?;
    println!("written: {}", docs.join("tuning.md").display());
    Ok(())
}

/// What a run takes, and what the wound opens by.
#[derive(Debug)]
struct Opening {
    ms: f64,
    mm: f64,
}

impl Opening {
    fn of_run(workspace: &Workspace, scene: &Path, out: &Path, set: &[&str]) -> Result<Self> {
        workspace.run_program(|command| {
            command.arg("run").arg(scene).arg("--out").arg(out).args(["--set", "output={report=true}"]);
            command.args(set.iter().flat_map(|change| ["--set", change]));
        })?;
        let report: Value = serde_json::from_slice(&fs::read(out.join("report.json"))?)?;
        let growth = number(&report, "/wound/final_mm")? - number(&report, "/wound/initial_mm")?;
        Ok(Self { ms: number(&report, "/frames/ms_mean")?, mm: growth })
    }

    fn keeps(&self, promised: &Self) -> bool {
        let near = |found: f64, promised: f64| (found / promised - 1.0).abs() <= KEPT;
        near(self.ms, promised.ms) && near(self.mm, promised.mm)
    }
}

fn number(value: &Value, path: &str) -> Result<f64> {
    value.pointer(path).and_then(Value::as_f64).with_context(|| format!("there is no number at {path}"))
}

fn page(
    workspace: &Workspace,
    tuning: &Value,
    promised: &Opening,
    found: &Opening,
    control: &Opening,
) -> Result<String> {
    let commit = workspace.commit()?;
    let reference = &tuning["reference"];
    let finest = reference["substeps"].as_array().and_then(|runs| runs.last()).and_then(Value::as_u64);
    let picked = &tuning["picked"];
    let mut page = format!(
        "# The demo, tuned\n\n\
         Written by `cargo xtask tuning` at commit {} on {} ({} cores, {}): `cutis tune {SCENE}`, then `cutis run` with the copy that it \
         wrote. The calibration itself is [tuning.json](tuning.json).\n\n\
         | {} | ms/frame | the wound opens by, mm |\n|---|---|---|\n\
         | promised | {:.1} | {:.4} |\n| the full run | {:.1} | {:.4} |\n| control: one substep | {:.1} | {:.4} |\n\n\
         The command fails if the full run is off by more than {:.0} % in either, or the control is not. The error promised, {}, is one of \
         displacements, which the run repeats.\n\n\
         ## Settings\n\n\
         The reference: {} substeps of one iteration in `f64`, extrapolated; off by at most {}.\n\n\
         | setting | ms/frame | error | the wound opens by, mm | |\n|---|---|---|---|---|\n",
        commit,
        tuning["machine"]["cpu"].as_str().unwrap_or("an unknown processor"),
        tuning["machine"]["cores"],
        tuning["machine"]["system"].as_str().unwrap_or_default(),
        setting(picked),
        promised.ms,
        promised.mm,
        found.ms,
        found.mm,
        control.ms,
        control.mm,
        100.0 * KEPT,
        percent(&picked["error"]),
        finest.unwrap_or_default(),
        percent(&reference["error"]),
    );
    let mut given_up: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for candidate in tuning["candidates"].as_array().into_iter().flatten() {
        if let Some(why) = candidate["abandoned"].as_str() {
            given_up.entry(why).or_default().push(setting(candidate));
            continue;
        }
        let _ = writeln!(
            page,
            "| {} | {} | {} | {} | {} |",
            setting(candidate),
            figure(&candidate["ms_per_frame"], 1),
            percent(&candidate["error"]),
            figure(&candidate["wounds"][0]["growth_mm"], 3),
            if candidate["own"] == true { "the scene's own" } else { "" },
        );
    }
    for (why, settings) in given_up {
        let _ = write!(page, "\nNot measured to the end ({why}): {}.\n", settings.join("; "));
    }
    for warning in tuning["warnings"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        let _ = write!(page, "\nThe program notes: {warning}.\n");
    }
    page.push_str(
        "\n## What can be left out\n\nAt the setting picked.\n\n\
         | what | saves, ms/frame | saves, MB | changes displacements by | the wound then opens by, mm | |\n|---|---|---|---|---|---|\n",
    );
    for omission in tuning["omissions"].as_array().into_iter().flatten() {
        let _ = writeln!(
            page,
            "| {} | {} | {:.1} | {} | {} | {} |",
            omission["what"].as_str().unwrap_or_default(),
            figure(&omission["saved_ms_per_frame"], 1),
            omission["saved_bytes"].as_f64().unwrap_or(f64::NAN) / 1e6,
            percent(&omission["change"]),
            figure(&omission["wounds"][0]["growth_mm"], 3),
            omission["skipped"].as_str().unwrap_or_default(),
        );
    }
    Ok(page)
}

/// As in a scene, in words.
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

fn figure(value: &Value, digits: usize) -> String {
    value.as_f64().map_or_else(|| "–".into(), |value| format!("{value:.digits$}"))
}

fn percent(share: &Value) -> String {
    share.as_f64().map_or_else(|| "–".into(), |share| format!("{:.2} %", 100.0 * share))
}
