//! The scan at rest: ways to hold the tension of the skin in XPBD, compared by error against time,
//! how far the skin moves over a layer of fat, against solutions of plane strain, and how far from
//! the wound the skin of scans moves.

pub(crate) mod block;
mod far_field;
mod layer;
mod scans;
mod slab;
mod ways;

use std::io::Write;

use clap::Parser;
use cutis_coloring::greedy;
use cutis_constraints::{Constraint, SkinStrip, SkinStripAtRest, SkinStripTurn};
use cutis_newton::{Options as Newton, Problem, relative_rms};
use cutis_solver::{Stiffness, SystemBuilder, Values};
use nalgebra::{Point3, Vector3};

use block::{Block, Elements, SIZE};
use far_field::FarField;
pub use far_field::{DECAY_TOLERANCE, ELEMENT_ROWS, PROFILE_TOLERANCE, ROWS, Skin, fat, thin};
pub use layer::Layer;
use scans::Scans;
pub use slab::Slab;
use ways::{Setting, Way};

use crate::kit::{Checks, Failure, Page, Provenance, Table, results};

/// Compares ways to hold a scan at rest in XPBD, or measures scans.
#[derive(Clone, Debug, Parser)]
#[command(name = "at-rest", bin_name = "cargo xtask study at-rest")]
pub struct Options {
    /// Measure how far the skin of scans moves, and openings by the direction of the tension,
    /// instead. It takes up to an hour.
    #[arg(long)]
    pub scans: bool,
    /// Write the tables of docs/results/at-rest.md. With --scans it needs all scans.
    #[arg(long)]
    pub write: bool,
}

/// Tables of the page.
pub const TABLES: [&str; 10] = [
    "provenance",
    "uncut",
    "cut",
    "far-field",
    "decay",
    "checks",
    "scans-provenance",
    "scans",
    "directions",
    "scans-checks",
];
/// Settings of the runs.
const SETTINGS: [Setting; 8] = [[1, 1], [2, 1], [5, 1], [10, 1], [20, 1], [40, 1], [5, 4], [10, 4]];
/// Index of the setting with the most substeps.
const FINEST: usize = 5;
/// Frames until the block is at rest.
const FRAMES: u32 = 90;
/// Largest displacement that counts as rounding, m.
const ROUNDING: f64 = 1e-9;
/// Displacement above which a way does not hold the block, m.
const MOVES: f64 = 1e-4;
/// Largest relative error with the most substeps.
const MOST_ERROR: f64 = 0.1;
/// Largest error of the way that Cutis uses, over the least of the others.
const MOST_OVER_BEST: f64 = 1.2;

/// Measures all ways. Returns whether all checks hold.
///
/// # Errors
/// No equilibrium is found, or the page cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("at-rest", &TABLES)).transpose()?;
    if options.scans {
        return scans(page, out);
    }
    let provenance = Provenance::start(if options.write { "at-rest --write" } else { "at-rest" });
    let mut checks = Checks::default();
    let uncut = uncut(&mut checks)?;
    let cut = cut(&mut checks)?;
    let far_field = FarField::measure()?;
    let [uncut, cut, far, decay] =
        [uncut, cut, far_field.profile, far_field.decay].map(|table| table.markdown());
    checks.append(far_field.checks);
    writeln!(out, "{uncut}\n{cut}\n{far}\n{decay}")?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("provenance", &provenance.markdown())?;
        page.set("uncut", &uncut)?;
        page.set("cut", &cut)?;
        page.set("far-field", &far)?;
        page.set("decay", &decay)?;
        page.set("checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// Measures scans. Returns whether all checks hold.
fn scans(page: Option<Page>, out: &mut dyn Write) -> Result<bool, Failure> {
    let provenance = Provenance::start("at-rest --scans --write");
    let Scans { reaches, directions, checks } = Scans::measure(page.is_some())?;
    let [reaches, directions] = [reaches, directions].map(|table| table.markdown());
    writeln!(out, "{reaches}\n{directions}")?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("scans-provenance", &provenance.markdown())?;
        page.set("scans", &reaches)?;
        page.set("directions", &directions)?;
        page.set("scans-checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// Largest displacement of the uncut block.
fn uncut(checks: &mut Checks) -> Result<Table, Failure> {
    let block = Block::new(SIZE, false)?;
    let mut table = Table::new(["substeps", "iterations"].into_iter().chain(Way::ALL.map(Way::name)));
    let mut all = Vec::new();
    for setting in SETTINGS {
        let moved = Way::ALL.map(|way| largest(&way.run(&block, setting, FRAMES).positions, &block.scan));
        let cells =
            moved.map(|moved| if moved == 0.0 { "0".into() } else { format!("{:.1e} mm", moved * 1e3) });
        table.add(setting.map(|n| n.to_string()).into_iter().chain(cells));
        all.push(moved);
    }
    for (n, way) in Way::ALL.into_iter().enumerate() {
        let (name, coarsest, finest) = (way.name(), all[0][n], all[FINEST][n]);
        let what = format!(
            "uncut, {name}: {coarsest:.1e} m with the fewest projections, {finest:.1e} m with the most"
        );
        match way {
            Way::LoadOnly => checks.control(what, finest > MOVES),
            Way::Started | Way::Kept => checks.add(what, coarsest > MOVES && finest < ROUNDING),
            Way::Contained => checks.add(what, all.iter().all(|moved| moved[n] == 0.0)),
        }
    }
    Ok(table)
}

/// Relative error of the displacements after the cut, and wall time.
fn cut(checks: &mut Checks) -> Result<Table, Failure> {
    let block = Block::new(SIZE, true)?;
    let [wanted, contained] = [equilibrium(&block, false)?, equilibrium(&block, true)?];
    let difference = relative_rms(&contained, &wanted, &block.scan);
    let what = format!("cut: both energies have one equilibrium ({difference:.1e})");
    checks.add(what, difference < 1e-6);
    let heads = Way::ALL.map(|way| [format!("{}: error", way.name()), "ms/frame".into()]);
    let heads = ["substeps".into(), "iterations".into()].into_iter().chain(heads.into_iter().flatten());
    let mut table = Table::new(heads);
    let mut all = Vec::new();
    for setting in SETTINGS {
        let runs = Way::ALL.map(|way| way.run(&block, setting, FRAMES));
        let errors = runs.each_ref().map(|run| relative_rms(&run.positions, &wanted, &block.scan));
        let cells = runs
            .iter()
            .zip(errors)
            .flat_map(|(run, error)| [format!("{:.3}", error), format!("{:.2}", run.ms_per_frame)]);
        table.add(setting.map(|n| n.to_string()).into_iter().chain(cells));
        all.push(errors);
    }
    let [load_only, .., contained] = all[FINEST];
    let what = format!("cut, load inside the constraint: error {contained:.3} with the most substeps");
    checks.add(what, contained < MOST_ERROR);
    checks.control(format!("cut, load only: error {load_only:.3}"), load_only > MOST_ERROR);
    let over_best = |[_, started, kept, contained]: [f64; 4]| contained / started.min(kept);
    let worst = all.into_iter().map(over_best).fold(0.0, f64::max);
    let what = format!("cut: the error of the load inside is at most {worst:.2} times that of the others");
    checks.add(what, worst < MOST_OVER_BEST);
    Ok(table)
}

/// The equilibrium of the cut block by Newton's method: of strips and loads, or of the constraints
/// that contain their loads.
fn equilibrium(block: &Block, contained: bool) -> Result<Vec<Point3<f64>>, Failure> {
    let [kept, removed] = block.loads();
    let mut builder = SystemBuilder::<f64>::new(&block.scan, &block.inverse_masses)?;
    builder = add(builder, &block.springs)?;
    builder = add(builder, &block.volumes)?;
    let strips = &block.strips[0];
    let loads: Vec<Vector3<f64>> = if contained {
        builder = add(builder, &strips.of_type::<SkinStripAtRest>(&block.scan))?;
        builder = add(builder, &strips.of_type::<SkinStripTurn>(&block.scan))?;
        removed
    } else {
        builder = add(builder, &strips.of_type::<SkinStrip>(&block.scan))?;
        kept.iter().zip(&removed).map(|(kept, removed)| kept + removed).collect()
    };
    let problem = Problem::of(&builder.loads(&loads)?.build(), [0.0; 3])?;
    Ok(problem.equilibrium(&block.scan, &Newton::default())?.positions)
}

fn add<C: Constraint<N>, const N: usize>(
    builder: SystemBuilder<f64>,
    elements: &Elements<C, N>,
) -> Result<SystemBuilder<f64>, Failure> {
    let Elements { vertices, params, compliances } = elements;
    let groups = greedy(vertices, 1 + vertices.iter().flatten().max().map_or(0, |&v| v as usize))?;
    let stiffness = Stiffness::Compliance(Values::Each(compliances.clone()));
    Ok(builder.add::<C, N>(vertices, params, stiffness, &groups)?)
}

fn largest(found: &[Point3<f64>], scan: &[Point3<f64>]) -> f64 {
    found.iter().zip(scan).map(|(found, scan)| (found - scan).norm()).fold(0.0, f64::max)
}
