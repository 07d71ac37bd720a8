//! Cost and error of a region of interest and of a graded lattice, compared with the whole body, on
//! the phantom and on a real abdomen. And the error of regions in a body that is not at rest in the
//! scan.

use std::io::Write;

use anyhow::{Context, ensure};
use clap::Parser;
use serde_json::Value;

use crate::kit::{
    Checks, Failure, Page, Program, Provenance, Table, number_at, optional, results, scene, target_dir,
};
use crate::main_job::{SCENES, volume};

/// Measures cost and error of regions of interest and graded lattices.
#[derive(Clone, Debug, Parser)]
#[command(name = "region", bin_name = "cargo xtask study region")]
pub struct Options {
    /// Write the tables of docs/results/region.md. Needs all scans.
    #[arg(long)]
    pub write: bool,
    /// Only the region that the program picks by itself.
    #[arg(long)]
    pub default: bool,
}

/// Number of scenes of the main job in this study.
const COMPARED: usize = 2;
/// Tables of the page.
pub const TABLES: [&str; 9] = [
    "provenance",
    "default-provenance",
    "default",
    "picked",
    "demo",
    "demo-not-at-rest",
    "abdomen-incision",
    "abdomen-incision-not-at-rest",
    "checks",
];

/// Region and grading of each variant, as TOML. The first is the whole body, then the regions by
/// size.
const VARIANTS: [(Option<&str>, Option<&str>); 15] = [
    (None, None),
    (Some("{ around_mm = 20 }"), None),
    (Some("{ around_mm = 30 }"), None),
    (Some("{ around_mm = 40 }"), None),
    (Some("{ around_mm = 60 }"), None),
    (Some("{ around_mm = 80 }"), None),
    (Some("{ around_mm = 120 }"), None),
    (None, Some("{ around_mm = 20, growth = 1.5, coarsest = 4 }")),
    (None, Some("{ around_mm = 40, growth = 1.2, coarsest = 2 }")),
    (None, Some("{ around_mm = 40, growth = 1.5, coarsest = 4 }")),
    (None, Some("{ around_mm = 40, growth = 2, coarsest = 8 }")),
    (None, Some("{ around_mm = 80, growth = 1.5, coarsest = 4 }")),
    (Some("{ around_mm = 60 }"), Some("{ around_mm = 20, growth = 1.5, coarsest = 4 }")),
    (Some("{ around_mm = 80 }"), Some("{ around_mm = 40, growth = 1.5, coarsest = 4 }")),
    (Some("{ around_mm = 120 }"), Some("{ around_mm = 40, growth = 1.5, coarsest = 4 }")),
];
/// Index of the smallest and of the largest region.
const REGIONS: [usize; 2] = [1, 6];
/// Largest relative error of the growth that the picked variants may have.
const LARGEST_ERROR: f64 = 0.05;
/// Frames of the second run of each variant, which only measures time.
const TIMED_FRAMES: &str = "10";

/// Runs the scenes with each variant. Returns whether all checks hold.
///
/// # Errors
/// The program fails, a scan is missing with `--write`, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    if options.default {
        return by_default(options, out);
    }
    let mut page = options.write.then(|| Page::open("region", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "region --write" } else { "region" });
    let program = Program::build()?;
    let folder = target_dir()?.join("studies/region");
    let mut checks = Checks::default();
    let mut picked = Table::new(["scene", "region", "grading", "error", "ms/frame", "share of the time"]);
    for (name, scan) in SCENES.into_iter().take(COMPARED) {
        let Some(own) = volume(scan) else {
            ensure!(!options.write, "{name}: the page needs all scans (set CUTIS_TEST_DATA)");
            continue;
        };
        let simulate = |(region, grading): (Option<&str>, Option<&str>), options: &[&str]| {
            let mut set = vec!["output={report=true}".to_owned(), "solver.backend=cpu".to_owned()];
            set.extend(own.iter().cloned());
            set.push(format!("lattice.region={}", region.unwrap_or("whole")));
            set.extend(grading.map(|grading| format!("lattice.grading={grading}")));
            program.scene(&scene(name), &set, options, &folder)
        };
        let mut variants = Vec::new();
        for (region, grading) in VARIANTS {
            variants.push(Variant::of(region, grading, &simulate((region, grading), &[])?)?);
        }
        // Run everything again in the opposite order, because other programs may slow down parts of
        // the first run.
        for (&choice, variant) in VARIANTS.iter().zip(&mut variants).rev() {
            let again = simulate(choice, &["--frames", TIMED_FRAMES])?;
            variant.ms_min = variant.ms_min.min(number_at(&again, "/frames/ms_min")?);
        }
        check(name, &variants, &mut checks);
        for kind in [Kind::Region, Kind::Any] {
            picked.add(pick(name, &variants, kind)?);
        }
        let table = table(&variants).markdown();
        writeln!(out, "{name}\n\n{table}")?;
        let mut moving = Vec::new();
        for (region, grading) in VARIANTS.into_iter().take(REGIONS[1] + 1) {
            let report = simulate((region, grading), &["--set", "scan_is_at_rest=false"])?;
            moving.push(Variant::of(region, grading, &report)?);
        }
        let errors = errors(&moving).markdown();
        writeln!(out, "{errors}")?;
        if let Some(page) = &mut page {
            page.set(name, &table)?;
            page.set(&format!("{name}-not-at-rest"), &errors)?;
        }
    }
    let picked = picked.markdown();
    writeln!(out, "{picked}")?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("provenance", &provenance.markdown())?;
        page.set("picked", &picked)?;
        page.set("checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// Cuts of the demo that differ from its own, by half their length in mm.
const SHORTER_MM: [f64; 2] = [20.0, 35.0];
/// Largest relative error of the growth in the region that the program picks.
const DEFAULT_ERROR: f64 = 0.025;

/// Compares the region that the program picks with the whole body.
fn by_default(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("region", &TABLES)).transpose()?;
    let name = if options.write { "region --default --write" } else { "region --default" };
    let provenance = Provenance::start(name);
    let program = Program::build()?;
    let folder = target_dir()?.join("studies/region");
    let mut table = Table::new([
        "scene",
        "tetrahedra, share",
        "ms/frame, share",
        "growth, whole body, mm",
        "growth, mm",
        "error",
    ]);
    let mut checks = Checks::default();
    let mut cases: Vec<(String, &str, Vec<String>)> = Vec::new();
    for (name, scan) in SCENES {
        let Some(own) = volume(scan) else {
            ensure!(!options.write, "{name}: the page needs all scans (set CUTIS_TEST_DATA)");
            continue;
        };
        cases.push((name.to_owned(), name, own));
    }
    for half in SHORTER_MM {
        let end = |side: f64| format!("[30.0, 110.0, {:.1}]", side * half);
        let cut = [format!("incision.0.from_mm={}", end(-1.0)), format!("incision.0.to_mm={}", end(1.0))];
        cases.push((format!("demo, cut of {} mm", 2.0 * half), "demo", cut.to_vec()));
    }
    for (what, name, own) in &cases {
        let simulate = |region: Option<&str>| {
            let mut set = vec!["output={report=true}".to_owned(), "solver.backend=cpu".to_owned()];
            set.extend(own.iter().cloned());
            set.extend(region.map(|region| format!("lattice.region={region}")));
            Variant::of(region, None, &program.scene(&scene(name), &set, &[], &folder)?)
        };
        let [whole, picked, small] =
            [simulate(Some("whole"))?, simulate(None)?, simulate(Some("{around_mm=40}"))?];
        let error = |variant: &Variant| variant.growth_mm / whole.growth_mm - 1.0;
        table.add([
            what.clone(),
            format!("{:.0} %", 100.0 * picked.tets / whole.tets),
            format!("{:.0} %", 100.0 * picked.ms_min / whole.ms_min),
            format!("{:.2}", whole.growth_mm),
            format!("{:.2}", picked.growth_mm),
            format!("{:+.1} %", 100.0 * error(&picked)),
        ]);
        let line =
            |error: f64| format!("{what}: {:+.2} %, at most {} %", 100.0 * error, 100.0 * DEFAULT_ERROR);
        checks.add(line(error(&picked)), error(&picked).abs() <= DEFAULT_ERROR);
        let line = format!("{what}: {:+.2} % in a region of 40 mm", 100.0 * error(&small));
        checks.control(line, error(&small).abs() > DEFAULT_ERROR);
    }
    let table = table.markdown();
    writeln!(out, "{table}")?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("default-provenance", &provenance.markdown())?;
        page.set("default", &table)?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// Results of one variant.
struct Variant {
    region: String,
    grading: String,
    tets: f64,
    memory_mb: f64,
    ms_min: f64,
    growth_mm: f64,
    /// Largest displacement next to frozen vertices. `None` if nothing is frozen.
    border_mm: Option<f64>,
    largest_mm: f64,
}

impl Variant {
    fn of(region: Option<&str>, grading: Option<&str>, report: &Value) -> Result<Self, Failure> {
        let number = |pointer: &str| number_at(report, pointer);
        let memory = report["memory"].as_array().context("the report has no memory")?;
        let text = |toml: Option<&str>| toml.map_or("none", |text| text.trim_matches(['{', '}', ' '])).into();
        Ok(Self {
            region: text(region),
            grading: text(grading),
            tets: number("/sizes/tets")?,
            memory_mb: memory.iter().filter_map(|part| part["bytes"].as_f64()).sum::<f64>() / 1e6,
            ms_min: number("/frames/ms_min")?,
            growth_mm: number("/wound/final_mm")? - number("/wound/initial_mm")?,
            border_mm: report["border_displacement_mm"].as_f64(),
            largest_mm: number("/max_displacement_mm")?,
        })
    }

    /// Relative difference of the growth from the growth of the whole body.
    fn error(&self, whole: &Self) -> f64 {
        self.growth_mm / whole.growth_mm - 1.0
    }
}

/// Variants to pick from.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Regions without a grading.
    Region,
    /// All variants.
    Any,
}

/// A row for the fastest variant of a kind whose error is at most [`LARGEST_ERROR`].
///
/// # Errors
/// No variant is that exact. The whole body is, so this is a NaN.
fn pick(name: &str, variants: &[Variant], kind: Kind) -> Result<[String; 6], Failure> {
    let whole = &variants[0];
    let fastest = variants
        .iter()
        .filter(|variant| kind == Kind::Any || variant.grading == whole.grading)
        .filter(|variant| variant.error(whole).abs() <= LARGEST_ERROR)
        .min_by(|a, b| a.ms_min.total_cmp(&b.ms_min))
        .with_context(|| format!("{name}: no variant has a known error"))?;
    Ok([
        name.to_owned(),
        fastest.region.clone(),
        fastest.grading.clone(),
        format!("{:+.1} %", 100.0 * fastest.error(whole)),
        format!("{:.1}", fastest.ms_min),
        format!("{:.0} %", 100.0 * fastest.ms_min / whole.ms_min),
    ])
}

/// Checks that the smallest region has fewer tetrahedra than the largest one, and that only the
/// largest one has a small error.
fn check(name: &str, variants: &[Variant], checks: &mut Checks) {
    let [whole, small, large] = [0, REGIONS[0], REGIONS[1]].map(|n| &variants[n]);
    let small_error = |variant: &Variant| variant.error(whole).abs() <= LARGEST_ERROR;
    checks.add(format!("{name}: the largest region has a small error"), small_error(large));
    checks.control(format!("{name}: the smallest region has a large error"), !small_error(small));
    checks.add(
        format!("{name}: a smaller region has fewer tetrahedra"),
        small.tets < large.tets && large.tets < whole.tets,
    );
}

fn table(variants: &[Variant]) -> Table {
    let mut table = Table::new([
        "region",
        "grading",
        "tetrahedra",
        "share",
        "MB",
        "ms/frame",
        "share",
        "growth, mm",
        "error",
        "displacement at the border, mm",
    ]);
    let whole = &variants[0];
    for variant in variants {
        table.add([
            variant.region.clone(),
            variant.grading.clone(),
            variant.tets.to_string(),
            format!("{:.0} %", 100.0 * variant.tets / whole.tets),
            format!("{:.1}", variant.memory_mb),
            format!("{:.1}", variant.ms_min),
            format!("{:.0} %", 100.0 * variant.ms_min / whole.ms_min),
            format!("{:.2}", variant.growth_mm),
            format!("{:+.1} %", 100.0 * variant.error(whole)),
            optional(variant.border_mm, |border| format!("{border:.2} of {:.2}", variant.largest_mm)),
        ]);
    }
    table
}

/// Growth of the opening and error by region.
fn errors(variants: &[Variant]) -> Table {
    let mut table = Table::new(["region", "growth, mm", "error", "displacement at the border, mm"]);
    for variant in variants {
        table.add([
            variant.region.clone(),
            format!("{:.2}", variant.growth_mm),
            format!("{:+.1} %", 100.0 * variant.error(&variants[0])),
            optional(variant.border_mm, |border| format!("{border:.2} of {:.2}", variant.largest_mm)),
        ]);
    }
    table
}
