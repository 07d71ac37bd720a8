//! What a cut of no width costs: frames of a body without a cut, with one, and while one grows.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use clap::Parser;

use crate::kit::{Checks, Failure, Page, Program, Provenance, Table, number_at, results, scene, target_dir};

/// Measures frames of the demo without a cut, with one, and while it grows.
#[derive(Clone, Debug, Parser)]
#[command(name = "wound", bin_name = "cargo xtask study wound")]
pub struct Options {
    /// Write the table of docs/results/wound.md.
    #[arg(long)]
    pub write: bool,
}

/// Tables of the page.
pub const TABLES: [&str; 3] = ["provenance", "frames", "checks"];

/// Variants of the demo: name, and what `--set` changes. In the last one the blade moves during all
/// frames.
const VARIANTS: [(&str, &[&str]); 3] =
    [("no cut", &["incision=[]"]), ("cut", &[]), ("cut that grows", &["incision.0.speed_mm_s=100"])];
/// Frames of a run.
const FRAMES: &str = "20";
/// Rounds over all variants, in turns. The shortest mean counts.
const ROUNDS: usize = 3;
/// Largest time of a frame with a cut, relative to one without.
const MOST: f64 = 1.2;
/// Largest time of an increment of the cut, ms.
const MOST_CUT_MS: f64 = 5.0;

/// Measures all variants in turns. Returns whether all checks hold.
///
/// # Errors
/// The program fails, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("wound", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "wound --write" } else { "wound" });
    let program = Program::build()?;
    let folder = target_dir()?.join("studies/wound");
    let mut frames =
        VARIANTS.map(|(name, _)| Frames { name, vertices: 0.0, ms: f64::INFINITY, cut_ms: None });
    for _ in 0..ROUNDS {
        for (frames, (_, changes)) in frames.iter_mut().zip(VARIANTS) {
            frames.measure(&program, changes, &folder)?;
        }
    }
    let mut table = Table::new(["demo", "vertices", "ms/frame", "relative", "cutting, ms/frame"]);
    let mut checks = Checks::default();
    for Frames { name, vertices, ms, cut_ms } in &frames {
        let share = ms / frames[0].ms;
        table.add([
            (*name).to_owned(),
            vertices.to_string(),
            format!("{ms:.1}"),
            format!("{share:.2}"),
            cut_ms.map_or_else(|| "–".to_owned(), |ms| format!("{ms:.2}")),
        ]);
        checks.add(format!("{name}: {share:.3} of a frame without a cut, at most {MOST}"), share <= MOST);
    }
    let cut_ms = frames[2].cut_ms.unwrap_or(f64::NAN);
    checks.add(format!("an increment takes {cut_ms:.2} ms, at most {MOST_CUT_MS}"), cut_ms <= MOST_CUT_MS);
    checks.control("a cut that does not grow takes no time".to_owned(), frames[1].cut_ms.is_none());
    let copies = frames[1].vertices - frames[0].vertices;
    checks.control(format!("the cut has {copies} vertices of its own"), copies > 0.0);
    let table = table.markdown();
    writeln!(out, "{table}")?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("frames", &table)?;
        page.set("provenance", &provenance.markdown())?;
        page.set("checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// Frames of one variant.
struct Frames {
    name: &'static str,
    vertices: f64,
    /// The shortest mean of a round.
    ms: f64,
    /// The shortest mean time of the cut in a frame; none if nothing is cut in a frame.
    cut_ms: Option<f64>,
}

impl Frames {
    fn measure(&mut self, program: &Program, changes: &[&str], folder: &Path) -> Result<(), Failure> {
        let mut set = ["output={report=true}", "solver.backend=cpu", "lattice.region=whole"]
            .map(str::to_owned)
            .to_vec();
        set.extend(changes.iter().map(|change| (*change).to_owned()));
        let report = program.scene(&scene("demo"), &set, &["--frames", FRAMES], folder)?;
        self.vertices = number_at(&report, "/sizes/vertices")?;
        self.ms = self.ms.min(number_at(&report, "/frames/ms_mean")?);
        let parts = report["ledger"]["parts"].as_array().context("no cost report")?;
        let cut = parts.iter().find(|part| part["part"] == "cut");
        let cut_ms = cut.map(|part| number_at(part, "/ms_per_frame")).transpose()?;
        self.cut_ms = self.cut_ms.into_iter().chain(cut_ms).reduce(f64::min);
        Ok(())
    }
}
