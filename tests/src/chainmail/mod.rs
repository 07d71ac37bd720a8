//! ChainMail on whole scans, and beside position-based dynamics on the same scan with the same drag.

mod compare;
mod page;
mod runs;

use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Parser;
use cutis::Override;

use crate::origin;
use compare::Comparison;
use runs::Whole;

/// Whatever keeps a measurement from being made.
pub type Failure = Box<dyn Error + Send + Sync>;

/// What `chainmail` is asked for.
#[derive(Clone, Debug, Parser)]
#[command(name = "chainmail")]
pub struct Options {
    /// Write page, table, chart and the pictures of the phantom to docs/results.
    #[arg(long)]
    pub write: bool,
    /// Keep the run folders here, to look at them.
    #[arg(long, value_name = "FOLDER")]
    pub keep: Option<PathBuf>,
}

/// Scenes of `fixtures/scenes` and the real scan that each is laid out for.
const SCENES: [(&str, Option<&str>); 3] = [
    ("demo-chainmail", None),
    ("abdomen-chainmail", Some("abdomen_ts_122x101x112.nii.gz")),
    ("thigh-chainmail", Some("leg_sts013_129x110x114.nii.gz")),
];

/// Where figures come from.
struct Origin {
    commit: Option<String>,
    load: [Option<String>; 2],
    took_s: f64,
    skipped: Vec<String>,
}

/// Runs the scenes and the comparisons; whether every check holds.
///
/// # Errors
/// What a run or the writing of a file refuses.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let (start, load) = (Instant::now(), origin::load());
    let scratch = tempfile::tempdir()?;
    let folder = options.keep.clone().unwrap_or_else(|| scratch.path().into());
    let (mut wholes, mut comparisons, mut skipped) = (Vec::new(), Vec::new(), Vec::new());
    for (scene, scan) in SCENES {
        let set: Vec<Override> = match scan.map(origin::scan).transpose() {
            Ok(path) => path.iter().map(|path| set("volume.path", &path.display().to_string())).collect(),
            Err(reason) => {
                skipped.push(format!("{scene}: {reason}"));
                continue;
            }
        };
        let whole = Whole::of(scene, &set, &folder.join(scene))?;
        writeln!(out, "{}", whole.summary())?;
        wholes.push(whole);
        if scene != "thigh-chainmail" {
            let comparison = Comparison::of(scene, &set, &folder)?;
            writeln!(out, "{}", page::table(&comparison))?;
            comparisons.push(comparison);
        }
    }
    let checks: Vec<(String, bool)> = wholes
        .iter()
        .flat_map(Whole::checks)
        .chain(comparisons.iter().flat_map(Comparison::checks))
        .collect();
    for (what, holds) in &checks {
        writeln!(out, "{} {what}", if *holds { "holds: " } else { "FAILS: " })?;
    }
    let origin = Origin {
        commit: origin::commit(),
        load: [load, origin::load()],
        took_s: start.elapsed().as_secs_f64(),
        skipped,
    };
    if options.write {
        let results = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/results"));
        page::write(&origin, &wholes, &comparisons, &checks, &folder.join("demo-chainmail"), results)?;
    }
    Ok(checks.iter().all(|(_, holds)| *holds))
}

fn set(key: &str, value: &str) -> Override {
    Override { key: key.into(), value: value.into() }
}
