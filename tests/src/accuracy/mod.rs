//! Accuracy: error against run time, for each problem and configuration, measured in the same run.
//!
//! | error | what is compared | with |
//! |---|---|---|
//! | E1 | one implicit substep from a moving state | its minimizer, by Newton's method in `f64` |
//! | E2 | the trajectory at a fixed time | an `f64` run with at least 64 times the substeps |
//! | E3 | the settled body | the equilibrium, by Newton's method in `f64` |
//! | E4 | residuals of the settled body | those of the equilibrium |
//!
//! The command prints the front of each problem, holds checks with controls, and writes page, table and charts with `--write`.

pub mod cases;
mod charts;
mod checks;
mod config;
mod errors;
mod front;
mod grid;
mod options;
mod page;
mod row;
mod running;
mod sweep;
mod trials;
mod words;
mod yardstick;

use std::error::Error;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use cutis_gpu::Gpu;

pub use options::Options;

use crate::origin::{commit, load};
use cases::Case;
use checks::Check;
use page::{Origin, Section};
use row::{Measure, Row};
use yardstick::Yardstick;

/// Whatever keeps a measurement from being made.
pub type Failure = Box<dyn Error>;

/// Measures, prints to `out`, and writes the results if that is asked for; whether all checks hold.
///
/// # Errors
/// A problem that cannot be built, a search that does not converge, a file that cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    if options.write && !options.trials {
        cases::scene::abdomen_scan().map_err(|reason| {
            format!("--write needs all problems, else it would take figures away; --out FOLDER needs none. {reason}")
        })?;
    }
    let (start, load_before) = (Instant::now(), load());
    let gpu = if options.no_gpu || options.trials { None } else { config::first_gpu()? };
    let (mut sections, mut skipped, mut tried, mut checks) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let wanted = |name: &&str| match &options.problem {
        Some(only) => only == name,
        None if options.trials => cases::TRIED.contains(name),
        None => !options.quick || cases::QUICK.contains(name),
    };
    for name in cases::NAMES.into_iter().filter(wanted) {
        let Some(case) = cases::named(name, options.quick)? else {
            skipped.push(name);
            continue;
        };
        if options.trials {
            let (found, held) = trials::run(&case)?;
            writeln!(out, "\n{}: {}\n\n{}", case.name, case.what, found.table())?;
            tried.push(found);
            checks.extend(held);
            continue;
        }
        let (section, held) = problem(&case, options.quick, gpu.as_ref(), out)?;
        writeln!(out, "\n{}", page::front_table(&section.rows))?;
        sections.push(section);
        checks.extend(held);
    }
    for check in &checks {
        writeln!(out, "{} {}", if check.holds { "holds: " } else { "FAILS: " }, check.what)?;
    }
    let good = !checks.is_empty() && checks.iter().all(|check| check.holds);
    writeln!(
        out,
        "\n{} s; {}",
        start.elapsed().as_secs(),
        if good { "all checks hold" } else { "CHECKS FAIL" }
    )?;
    let results = options.write.then(|| concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/results").into());
    if let Some(folder) = results.or(options.out.clone()) {
        let origin = Origin {
            command: options.command(),
            commit: commit(),
            load: [load_before, load()],
            gpu: gpu.as_ref().map_or_else(|| "none".into(), |gpu| gpu.adapter().name.clone()),
            took_s: start.elapsed().as_secs_f64(),
            skipped,
        };
        match options.trials {
            true => write_trials(&origin, &tried, &folder)?,
            false => write(&origin, &sections, &checks, &folder)?,
        }
    }
    Ok(good)
}

/// Measures one problem.
fn problem(
    case: &Case,
    quick: bool,
    gpu: Option<&Gpu>,
    out: &mut dyn Write,
) -> Result<(Section, Vec<Check>), Failure> {
    let start = Instant::now();
    let tell = |what: &str| eprintln!("  {:5.1} s  {}: {what}", start.elapsed().as_secs_f64(), case.name);
    let configs = grid::configs(case, quick, gpu);
    let mut substeps: Vec<u32> = configs.iter().map(|config| config.substeps).collect();
    substeps.sort_unstable();
    substeps.dedup();
    let constraints: usize = case.xpbd.kinds().iter().map(|kind| kind.len()).sum();
    writeln!(out, "\n{}: {}; {} configurations", case.name, case.what, configs.len())?;
    let mut yardstick = Yardstick::new(case, &substeps, &tell)?;
    tell("minimizers of implicit steps by Newton's method");
    for &substeps in &substeps {
        yardstick.minimize(substeps)?;
    }
    let rows: Vec<Row> = sweep::run(case, &configs, &yardstick, &tell)?;
    let checks = checks::of_problem(case, &yardstick, &rows)?;
    let opening = case
        .opening
        .as_ref()
        .map(|(opening, unit)| (opening(yardstick.equilibrium()) - opening(yardstick.rest()), *unit));
    let section = Section {
        name: case.name,
        what: case.what.clone(),
        sizes: [yardstick.free() as u64, constraints as u64, yardstick.fine_substeps.into()],
        frames: (case.instants.clone(), case.compared_at, case.most_frames),
        opening,
        rows,
    };
    Ok((section, checks))
}

/// Writes page, table and charts.
fn write(origin: &Origin, sections: &[Section], checks: &[Check], folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder)?;
    let rows: Vec<Row> = sections.iter().flat_map(|section| section.rows.iter().cloned()).collect();
    fs::write(folder.join("accuracy.csv"), row::csv(&rows))?;
    for section in sections {
        for measure in Measure::ALL {
            if let Some(svg) = charts::chart(section.name, &section.rows, measure) {
                let file = format!("accuracy-{}-{}.svg", section.name, measure.name().to_lowercase());
                fs::write(folder.join(file), svg)?;
            }
        }
    }
    fs::write(folder.join("accuracy.md"), page::page(origin, sections, checks))?;
    Ok(())
}

/// Writes page and table of the trials.
fn write_trials(origin: &Origin, tried: &[trials::Tried], folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder)?;
    fs::write(folder.join("accelerations.csv"), trials::csv(tried))?;
    fs::write(folder.join("accelerations.md"), trials::page(origin, tried))?;
    Ok(())
}
