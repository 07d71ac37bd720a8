//! How long it takes to find out where a wound ends up: the search for the state of rest, and
//! frames with the settings of the scene.

mod frames;
mod front;
mod search;

use std::io::Write;
use std::path::PathBuf;

use anyhow::ensure;
use clap::Parser;
use serde_json::json;

use crate::kit::{Checks, Failure, Page, Provenance, results, write_json};

/// Measures the search for the state of rest on bodies of all sizes, and frames of the demo.
#[derive(Clone, Debug, Parser)]
#[command(name = "rest", bin_name = "cargo xtask study rest")]
pub struct Options {
    /// Only bodies with at most this many vertices that can move.
    #[arg(long, value_name = "COUNT")]
    pub most_vertices: Option<usize>,
    /// Write all figures to this file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Only the search against frames with many settings, on problems of the study of accuracy.
    /// Takes about eight minutes.
    #[arg(long, conflicts_with = "most_vertices")]
    pub front: bool,
    /// Write docs/results/rest.md, which needs the scan of the abdomen. With `--front`, write
    /// docs/results/rest-front.md and its charts.
    #[arg(long, conflicts_with = "most_vertices")]
    pub write: bool,
}

/// Tables of the page.
pub const TABLES: [&str; 6] = ["provenance", "bodies", "sizes", "stiffnesses", "frames", "checks"];
/// Tables of the page of `--front`.
pub const FRONT_TABLES: [&str; 3] = ["provenance", "front", "checks"];

/// Measures everything. Returns whether all checks hold.
///
/// # Errors
/// A scene is refused, a search does not end, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    if options.front {
        return run_front(options, out);
    }
    let page = options.write.then(|| Page::open("rest", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "rest --write" } else { "rest" });
    let most = options.most_vertices.unwrap_or(usize::MAX);
    let mut checks = Checks::default();
    let demo = search::demo()?;
    let frames = frames::measure(&demo, &mut checks)?;
    let frames_table = frames::table(&demo.found, &frames).markdown();
    writeln!(out, "{frames_table}")?;
    let bodies = search::bodies(demo.found.clone(), most)?;
    ensure!(!options.write || bodies.iter().any(search::Found::is_abdomen), "the page needs the abdomen");
    let bodies_table = search::table(&bodies).markdown();
    writeln!(out, "{bodies_table}")?;
    let sizes = search::sizes(most)?;
    let sizes_table = search::table(&sizes).markdown() + "\n" + &search::growth(&sizes);
    writeln!(out, "{sizes_table}")?;
    let stiffnesses = search::stiffnesses(most)?;
    let stiffness_table = search::table(&stiffnesses).markdown() + "\n" + &search::spread(&stiffnesses);
    writeln!(out, "{stiffness_table}")?;
    search::check(&[&bodies, &sizes, &stiffnesses], &mut checks);
    checks.print(out)?;
    if let Some(path) = &options.json {
        let figures = json!({"provenance": provenance, "bodies": bodies, "sizes": sizes, "stiffnesses": stiffnesses, "frames": frames});
        write_json(path, &figures)?;
    }
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("bodies", &bodies_table)?;
        page.set("sizes", &sizes_table)?;
        page.set("stiffnesses", &stiffness_table)?;
        page.set("frames", &frames_table)?;
        page.set("provenance", &provenance.markdown())?;
        page.set("checks", &checks.summary())?;
        let chart = frames::chart(&demo.found, &frames);
        std::fs::write(results().join("rest-demo.svg"), chart)?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// Measures the search against frames with many settings.
fn run_front(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("rest-front", &FRONT_TABLES)).transpose()?;
    let command = if options.write { "rest --front --write" } else { "rest --front" };
    let provenance = Provenance::start(command);
    let mut checks = Checks::default();
    let fronts = front::measure(&mut checks)?;
    let table = front::table(&fronts).markdown();
    writeln!(out, "{table}")?;
    checks.print(out)?;
    if let Some(path) = &options.json {
        write_json(path, &json!({"provenance": provenance, "fronts": fronts}))?;
    }
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("front", &table)?;
        page.set("provenance", &provenance.markdown())?;
        page.set("checks", &checks.summary())?;
        for front in &fronts {
            std::fs::write(results().join(front::file(front)), front::chart(front))?;
        }
        page.save(&results())?;
    }
    Ok(checks.pass())
}
