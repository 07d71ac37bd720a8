//! Pictures of the scenes before and after: with the skin tension of the paper on a body that
//! shrinks, and with the membrane on a scan at rest.
//!
//! Pictures of patients are not kept in this repository, so each reader makes them.

use std::fmt::Write as _;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Parser;
use cutis::{Override, RunOptions, Scene, Silent};

use crate::kit::{Failure, scene, target_dir};
use crate::main_job::{SCENES, volume};

/// Runs the scenes with the tension of the paper and with the membrane, and shows the pictures side
/// by side.
#[derive(Clone, Debug, Parser)]
#[command(name = "pictures", bin_name = "cargo xtask study pictures")]
pub struct Options {
    /// Folder of the runs and of index.html [default: studies/pictures in the target folder]
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// The scene with the constraints and the solver of the paper.
const PAPER: &str = "abdomen-paper";
/// Pictures of a run: file and caption.
const PICTURES: [(&str, &str); 3] =
    [("before.png", "before"), ("after.png", "after"), ("slice.png", "slice")];

/// Runs all scenes whose scan is present. Returns whether all were.
///
/// # Errors
/// A run fails, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let folder = match &options.out {
        Some(folder) => folder.clone(),
        None => target_dir()?.join("studies/pictures"),
    };
    fs::create_dir_all(&folder)?;
    let mut page = String::from(
        "<!doctype html>\n<meta charset=\"utf-8\">\n<title>Before and after</title>\n\
         <style>body { font-family: sans-serif } img { width: 24em }</style>\n",
    );
    let mut complete = true;
    for (name, scan) in SCENES {
        let Some(set) = volume(scan) else {
            writeln!(out, "{name}: left out, its scan is missing (set CUTIS_TEST_DATA)")?;
            complete = false;
            continue;
        };
        writeln!(page, "<h2>{name}</h2>")?;
        for (way, title) in [
            ("paper", "The skin tension of the paper; all of the skin shrinks"),
            ("membrane", "The membrane; the scan is at rest"),
        ] {
            eprintln!("{name}: {title}");
            let run = format!("{name}-{way}");
            picture(name, &set, way == "paper", &folder.join(&run))?;
            writeln!(page, "<h3>{title}</h3>")?;
            for (file, caption) in PICTURES {
                writeln!(page, "<img src=\"{run}/{file}\" alt=\"{caption}\" title=\"{caption}\">")?;
            }
        }
    }
    let index = folder.join("index.html");
    fs::write(&index, page)?;
    writeln!(out, "{}", index.display())?;
    Ok(complete)
}

/// Runs a scene, with the constraints and the solver of the paper if `paper` is true.
fn picture(name: &str, set: &[String], paper: bool, out: &Path) -> Result<(), Failure> {
    let changes = set.iter().filter_map(|change| change.split_once('='));
    let changes = changes.map(|(key, value)| Override { key: key.into(), value: value.into() });
    let mut loaded = Scene::load(&scene(name), &changes.collect::<Vec<_>>())?;
    if paper {
        let Scene { scan_is_at_rest, materials, constraints, solver, .. } =
            Scene::load(&scene(PAPER), &[])?.scene;
        loaded.scene = Scene { scan_is_at_rest, materials, constraints, solver, ..loaded.scene };
        // All of the skin shrinks, also far from the cut.
        loaded.scene.lattice.region = None;
    }
    cutis::run(&loaded, &RunOptions { out: out.into(), resume: false }, &Silent)?;
    Ok(())
}
