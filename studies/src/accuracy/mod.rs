//! Accuracy: error against run time, for each problem and configuration, measured in the same run.
//!
//! | error | compares | with |
//! |---|---|---|
//! | E1 | one implicit substep from a moving state | its minimizer, by Newton's method in `f64` |
//! | E2 | the trajectory at a fixed time | an `f64` run with at least 64 times the substeps |
//! | E3 | the body at rest | the equilibrium, by Newton's method in `f64` |
//! | E4 | residuals of the body at rest | the residuals of the equilibrium |
//!
//! The command prints the Pareto front of each problem, and checks with controls.

mod charts;
mod checks;
mod config;
mod errors;
pub mod front;
mod grid;
mod measurement;
mod options;
pub mod problems;
mod reference;
mod running;
mod sweep;
mod tables;

use std::fs;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use cutis_gpu::Gpu;

pub use options::Options;

use crate::kit::{Checks, Failure, Page, Provenance, Table, results, write_json};
use measurement::{Measure, Measurement};
use problems::Problem;
use reference::Reference;
use tables::Section;

/// Tables of the page.
pub const TABLES: [&str; 10] = [
    "provenance",
    "problems",
    "choices",
    "limits",
    "checks",
    "membrane-provenance",
    "membrane-problems",
    "membrane-choices",
    "membrane-limits",
    "membrane-checks",
];
/// Charts of the page; `--out` writes one for each error.
const CHARTS: [Measure; 2] = [Measure::E1, Measure::E3];

/// What a page says about the times of a build that is not a release.
const DEV_BUILD: &str =
    " Built with the dev profile: its times are longer than those of a release, its errors are not.";

/// Measures, prints to `out`, and writes what the options ask for. Returns whether all checks hold.
///
/// # Errors
/// A problem cannot be built, a search does not converge, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    if options.write && !options.membrane {
        // A page without one of the problems would lose figures.
        problems::scene::abdomen_scan()?;
    }
    let page =
        (options.write || options.out.is_some()).then(|| Page::open("accuracy", &TABLES)).transpose()?;
    let mut provenance = Provenance::start(&options.command());
    let gpu = if options.no_gpu { None } else { config::first_gpu()? };
    if let Some(gpu) = &gpu {
        provenance.adapter(&gpu.adapter().name);
    }
    let (mut sections, mut checks) = (Vec::new(), Checks::default());
    let wanted = |name: &&str| match &options.problem {
        Some(only) => only == name,
        None => !options.quick || problems::QUICK.contains(name),
    };
    let names: Vec<&str> = match options.membrane {
        true => vec![problems::MEMBRANE],
        false => problems::NAMES.into_iter().filter(wanted).collect(),
    };
    for name in names {
        let Some(problem) = problems::named(name, options.quick)? else { continue };
        let (section, held) = measure(&problem, options.quick, gpu.as_ref(), out)?;
        writeln!(out, "\n{}", tables::front_table(&section.rows).markdown())?;
        sections.push(section);
        checks.append(held);
    }
    checks.print(out)?;
    let rows: Vec<&Measurement> = sections.iter().flat_map(|section| &section.rows).collect();
    if let Some(path) = &options.json {
        let passed = checks.pass();
        write_json(path, &serde_json::json!({ "provenance": provenance, "rows": rows, "passed": passed }))?;
    }
    if let Some(mut page) = page {
        let part = if options.membrane { "membrane-" } else { "" };
        let build = if cfg!(debug_assertions) { DEV_BUILD } else { "" };
        for (table, content) in [
            ("provenance", provenance.markdown() + build),
            ("problems", Table::of(&sections).markdown()),
            ("choices", tables::choices(&sections).markdown()),
            ("limits", tables::limits(&sections).markdown()),
            ("checks", checks.summary()),
        ] {
            page.set(&format!("{part}{table}"), &content)?;
        }
        let folder = options.out.clone().unwrap_or_else(results);
        let measures = if options.write { &CHARTS[..] } else { &Measure::ALL };
        page.save(&folder)?;
        let csv = if options.membrane { "accuracy-membrane.csv" } else { "accuracy.csv" };
        fs::write(folder.join(csv), Table::of(rows.iter().copied()).csv())?;
        write_charts(&sections, measures, &folder)?;
    }
    Ok(checks.pass())
}

/// Measures one problem.
fn measure(
    problem: &Problem,
    quick: bool,
    gpu: Option<&Gpu>,
    out: &mut dyn Write,
) -> Result<(Section, Checks), Failure> {
    let start = Instant::now();
    let progress =
        |what: &str| eprintln!("  {:5.1} s  {}: {what}", start.elapsed().as_secs_f64(), problem.name);
    let configs = grid::configs(problem, quick, gpu);
    let mut substeps: Vec<u32> = configs.iter().map(|config| config.substeps).collect();
    substeps.sort_unstable();
    substeps.dedup();
    let constraints: usize = problem.xpbd.kinds().iter().map(|kind| kind.len()).sum();
    writeln!(out, "\n{}: {}; {} configurations", problem.name, problem.what, configs.len())?;
    let mut reference = Reference::new(problem, &substeps, &progress)?;
    progress("minimizers of implicit steps by Newton's method");
    for &substeps in &substeps {
        reference.minimize(substeps)?;
    }
    let rows = sweep::run(problem, &configs, &reference, &progress)?;
    let checks = checks::check(problem, &reference, &rows)?;
    let opening = problem
        .opening
        .as_ref()
        .map(|(opening, unit)| (opening(reference.equilibrium()) - opening(reference.rest()), *unit));
    let section = Section {
        name: problem.name,
        what: problem.what.clone(),
        sizes: [reference.free() as u64, constraints as u64, reference.fine_substeps.into()],
        opening,
        rows,
    };
    Ok((section, checks))
}

/// Writes the charts of these errors for each problem.
fn write_charts(sections: &[Section], measures: &[Measure], folder: &Path) -> Result<(), Failure> {
    for section in sections {
        for &measure in measures {
            if let Some(svg) = charts::chart(section.name, &section.rows, measure) {
                let file = format!("accuracy-{}-{}.svg", section.name, measure.name().to_lowercase());
                fs::write(folder.join(file), svg)?;
            }
        }
    }
    Ok(())
}
