//! ChainMail on whole scans, and compared with position-based dynamics on the same scan with the
//! same drag.

mod compare;
mod runs;
mod tables;

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, ensure};
use clap::Parser;
use cutis::Override;

use crate::kit::{Checks, Failure, Page, Provenance, Row, Table, results, write_json};
use compare::Comparison;
use runs::WholeRun;

/// Compares ChainMail on scans with position-based dynamics. The exit code says whether all checks
/// hold.
#[derive(Clone, Debug, Parser)]
#[command(name = "chainmail", bin_name = "cargo xtask study chainmail")]
pub struct Options {
    /// Write the tables, charts and pictures of docs/results/chainmail.md. Needs all scans.
    #[arg(long)]
    pub write: bool,
    /// Write all figures to this file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Keep the run folders in this folder.
    #[arg(long, value_name = "FOLDER")]
    pub keep: Option<PathBuf>,
}

/// Scenes of `fixtures/scenes`, and the scan of each.
const SCENES: [(&str, Option<&str>); 3] = [
    ("demo-chainmail", None),
    ("abdomen-chainmail", Some("abdomen_ts_122x101x112.nii.gz")),
    ("thigh-chainmail", Some("leg_sts013_129x110x114.nii.gz")),
];
/// Scenes with a comparison of models.
const COMPARED: [&str; 2] = ["demo", "abdomen"];
/// Tables of the page.
pub const TABLES: [&str; 5] = ["provenance", "scenes", "demo", "abdomen", "checks"];

/// Runs the scenes and the comparisons. Returns whether all checks hold.
///
/// # Errors
/// A run fails, a scan is missing with `--write`, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("chainmail", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "chainmail --write" } else { "chainmail" });
    let scratch = tempfile::tempdir()?;
    let folder = options.keep.clone().unwrap_or_else(|| scratch.path().into());
    let (mut wholes, mut comparisons, mut checks) = (Vec::new(), Vec::new(), Checks::default());
    for (scene, scan) in SCENES {
        let scan = scan.map(|name| cutis_test_kit::scans::find(&format!("ct/{name}")));
        if scan == Some(None) {
            ensure!(!options.write, "{scene}: the page needs all scans (set CUTIS_TEST_DATA)");
            continue;
        }
        let own: Vec<Override> =
            scan.flatten().iter().map(|path| set("volume.path", &path.display().to_string())).collect();
        let whole = WholeRun::of(scene, &own, &folder.join(scene))?;
        writeln!(out, "{}", Table::of([&whole]).markdown())?;
        whole.check(&mut checks);
        wholes.push(whole);
        if COMPARED.contains(&scene.trim_end_matches("-chainmail")) {
            let comparison = Comparison::of(scene, &own, &folder)?;
            writeln!(out, "{}", tables::models(&comparison))?;
            comparison.check(&mut checks);
            comparisons.push(comparison);
        }
    }
    checks.print(out)?;
    if let Some(path) = &options.json {
        let row = |run: &WholeRun| -> serde_json::Value {
            WholeRun::COLUMNS.iter().map(|&column| column.to_owned()).zip(run.cells()).collect()
        };
        let scenes: Vec<_> = wholes.iter().map(row).collect();
        write_json(
            path,
            &serde_json::json!({ "provenance": provenance, "rows": scenes, "passed": checks.pass() }),
        )?;
    }
    if let Some(mut page) = page {
        page.set("provenance", &provenance.markdown())?;
        page.set("scenes", &Table::of(&wholes).markdown())?;
        page.set("checks", &checks.summary())?;
        for (name, comparison) in COMPARED.into_iter().zip(&comparisons) {
            page.set(name, &tables::models(comparison))?;
            fs::write(results().join(format!("chainmail-{name}.svg")), tables::chart(comparison))?;
        }
        for picture in ["before", "after", "slice"] {
            let from = folder.join("demo-chainmail").join(format!("{picture}.png"));
            let to = results().join(format!("chainmail-{picture}.png"));
            fs::copy(&from, to).with_context(|| from.display().to_string())?;
        }
        page.save(&results())?;
    }
    Ok(checks.pass())
}

fn set(key: &str, value: &str) -> Override {
    Override { key: key.into(), value: value.into() }
}
