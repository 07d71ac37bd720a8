//! What opens a wound and what closes it: the opening of a cut by its depth, length and tension,
//! and the force of sutures that close an excision.

use std::f64::consts::TAU;
use std::io::Write;
use std::path::PathBuf;

use clap::Parser;

use crate::kit::{Checks, Failure, Page, Program, Provenance, Table, number_at, results, scene, target_dir};

/// Measures the opening of cuts in the demo, and the force that closes an excision.
#[derive(Clone, Debug, Parser)]
#[command(name = "closing", bin_name = "cargo xtask study closing")]
pub struct Options {
    /// Write the tables of docs/results/closing.md.
    #[arg(long)]
    pub write: bool,
}

/// Tables of the page.
pub const TABLES: [&str; 4] = ["provenance", "cuts", "excisions", "checks"];

/// Step of the lattice of the excisions, mm.
const SPACING_MM: f64 = 4.0;
/// Half axes of the excised ellipse, mm.
const HALF_AXES_MM: [f64; 2] = [30.0, 8.0];
/// Depth of the excision, and of the undermining next to it, mm.
const DEPTHS_MM: [f64; 2] = [7.0, 6.0];
/// Distances over which the skin around the excision is undermined, mm.
const UNDERMINED_MM: [f64; 4] = [0.0, 8.0, 15.0, 22.0];
/// Largest opening of a closed wound, as a share of the width of the excision.
const CLOSED: f64 = 0.1;

/// Runs all cuts and excisions. Returns whether all checks hold.
///
/// # Errors
/// The program fails, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("closing", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "closing --write" } else { "closing" });
    let runs = Runs { program: Program::build()?, folder: target_dir()?.join("studies/closing") };
    let mut checks = Checks::default();
    let cuts = cuts(&runs, &mut checks)?;
    let excisions = excisions(&runs, &mut checks)?;
    writeln!(out, "{cuts}\n{excisions}")?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("cuts", &cuts)?;
        page.set("excisions", &excisions)?;
        page.set("provenance", &provenance.markdown())?;
        page.set("checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// The program, and the folder in which its runs write.
struct Runs {
    program: Program,
    folder: PathBuf,
}

/// A straight cut along the body.
#[derive(Clone, Copy)]
struct Cut {
    length_mm: f64,
    depth_mm: f64,
    /// Factor on the tension of the preset.
    tension: f64,
}

/// The cut of the demo.
const DEMO: Cut = Cut { length_mm: 100.0, depth_mm: 20.0, tension: 1.0 };
/// Tension of the preset `trunk` along and across its lines, N/m.
const TRUNK_N_PER_M: [f64; 2] = [15.0, 5.0];

impl Cut {
    /// Opening in the middle after the last frame, mm.
    fn opening_mm(self, runs: &Runs) -> Result<f64, Failure> {
        let half = 0.5 * self.length_mm;
        let [along, across] = TRUNK_N_PER_M.map(|tension| self.tension * tension);
        let set = [
            format!("incision.0.from_mm=[30.0, 110.0, {:.1}]", -half),
            format!("incision.0.to_mm=[30.0, 110.0, {half:.1}]"),
            format!("incision.0.depth_mm={:.1}", self.depth_mm),
            format!("constraints.membrane.tension_along_n_per_m={along:.3}"),
            format!("constraints.membrane.tension_across_n_per_m={across:.3}"),
            "output={report=true}".to_owned(),
            "lattice.region=whole".to_owned(),
        ];
        let report = runs.program.scene(&scene("demo"), &set, &["--frames", "90"], &runs.folder)?;
        number_at(&report, "/wound/mid_mm")
    }
}

/// Openings of cuts that differ from that of the demo in one respect each.
fn cuts(runs: &Runs, checks: &mut Checks) -> Result<String, Failure> {
    let mut table = Table::new(["length, mm", "depth, mm", "tension, N/m", "opening in the middle, mm"]);
    let mut series = |what: &str, cuts: &[Cut]| -> Result<(), Failure> {
        let mut openings = Vec::new();
        for cut in cuts {
            let opening = cut.opening_mm(runs)?;
            let [along, across] = TRUNK_N_PER_M.map(|tension| cut.tension * tension);
            table.add([
                format!("{}", cut.length_mm),
                format!("{}", cut.depth_mm),
                format!("{along}, {across}"),
                format!("{opening:.2}"),
            ]);
            openings.push(opening);
        }
        let grows = openings.is_sorted_by(|a, b| 1.02 * a < *b);
        checks.add(format!("the opening grows with the {what}: {openings:.2?} mm"), grows);
        openings.reverse();
        let reversed = openings.is_sorted_by(|a, b| 1.02 * a < *b);
        checks.control(format!("it does not fall with the {what}"), !reversed);
        Ok(())
    };
    series("length", &[40.0, 70.0, 100.0].map(|length_mm| Cut { length_mm, ..DEMO }))?;
    series("depth", &[8.0, 12.0, 16.0, 20.0].map(|depth_mm| Cut { depth_mm, ..DEMO }))?;
    series("tension", &[0.25, 0.5, 1.0].map(|tension| Cut { tension, ..DEMO }))?;
    Ok(table.markdown())
}

/// A closed wound.
struct Closed {
    force_n: f64,
    force_n_per_cm: f64,
    largest_n: f64,
    stitches: f64,
    opening_mm: f64,
}

/// The closed outline of an ellipse on the belly with these half axes in mm: to the side and along
/// the body.
fn ellipse([side, up]: [f64; 2]) -> String {
    let point = |n: usize| {
        let angle = TAU * n as f64 / 20.0;
        let (x, z) = (10.0 + side * angle.cos(), up * angle.sin());
        format!("[{x:.2}, {:.2}, {z:.2}]", 102.5 - x * x / 700.0)
    };
    let points: Vec<String> = (0..20).chain([0]).map(point).collect();
    format!("[{}]", points.join(", "))
}

/// Excises, undermines and closes. Without `sewn` the wound stays open.
fn excise(runs: &Runs, half_axes: [f64; 2], undermined_mm: f64, sewn: bool) -> Result<Closed, Failure> {
    let [depth, below] = DEPTHS_MM;
    let mut steps = vec![format!(
        "{{ kind = 'excise', name = 'lesion', path_mm = {}, depth_mm = {depth:.1}, at_s = 0.2 }}",
        ellipse(half_axes)
    )];
    if undermined_mm > 0.0 {
        steps.push(format!(
            "{{ kind = 'undermine', wound = 'lesion', distance_mm = {undermined_mm:.1}, depth_mm = {below:.1}, \
             at_s = 0.2 }}"
        ));
    }
    if sewn {
        let keys = "every_mm = 6.0, bite_mm = 5.0, at_s = 0.6, tighten_s = 0.8, tighten_to = 0.9";
        steps.push(format!("{{ kind = 'suture', wound = 'lesion', {keys} }}"));
    }
    let set = [
        format!("step=[{}]", steps.join(", ")),
        format!(
            "lattice={{ spacing_mm = {SPACING_MM:.1}, split = 'five', region = {{ around_mm = 60.0 }} }}"
        ),
        "output={report=true}".to_owned(),
    ];
    let report = runs.program.scene(&scene("excision"), &set, &["--frames", "150"], &runs.folder)?;
    let suture = |key: &str| number_at(&report, &format!("/sutures/0/{key}"));
    let sewn = |key: &str| if sewn { suture(key) } else { Ok(0.0) };
    Ok(Closed {
        force_n: sewn("force_n")?,
        force_n_per_cm: sewn("force_n_per_cm")?,
        largest_n: sewn("largest_n")?,
        stitches: sewn("stitches")?,
        opening_mm: number_at(&report, "/wound/mid_mm")?,
    })
}

/// Forces that close an ellipse along and across the lines of tension.
fn excisions(runs: &Runs, checks: &mut Checks) -> Result<String, Failure> {
    let [long, short] = HALF_AXES_MM;
    let width = 2.0 * short;
    let mut table = Table::new([
        "long axis",
        "undermined, mm",
        "stitches",
        "force, N",
        "N per cm",
        "largest in one, N",
        "opening in the middle, mm",
    ]);
    let mut forces = [const { Vec::new() }; 2];
    let names = ["along the lines", "across the lines"];
    for ((name, half_axes), forces) in names.into_iter().zip([[long, short], [short, long]]).zip(&mut forces)
    {
        for undermined in UNDERMINED_MM {
            let closed = excise(runs, half_axes, undermined, true)?;
            table.add([
                name.to_owned(),
                undermined.to_string(),
                closed.stitches.to_string(),
                format!("{:.2}", closed.force_n),
                format!("{:.2}", closed.force_n_per_cm),
                format!("{:.2}", closed.largest_n),
                format!("{:.2}", closed.opening_mm),
            ]);
            let opening = closed.opening_mm;
            let what = format!("{name}, undermined by {undermined} mm: {opening:.2} mm open");
            checks.add(what, opening.abs() < CLOSED * width);
            forces.push(closed.force_n);
        }
        let falls = forces.is_sorted_by(|a, b| *a > 1.02 * b);
        checks.add(format!("{name}: undermining lowers the force, {forces:.2?} N"), falls);
        let open = excise(runs, half_axes, UNDERMINED_MM[0], false)?.opening_mm;
        checks.control(format!("{name}, without sutures: {open:.2} mm open"), open > width);
    }
    let [along, across] = &forces;
    let harder = along.iter().zip(across).all(|(along, across)| *across > 1.1 * along);
    checks.add(format!("a wound across the lines needs more force: {across:.2?} and {along:.2?} N"), harder);
    Ok(table.markdown())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_is_closed_and_has_its_axes() {
        let path: Vec<[f64; 3]> = serde_json::from_str(&ellipse([30.0, 8.0])).unwrap();
        assert_eq!(path[0], path[20]);
        let extent = |axis: usize| {
            let values = path.iter().map(|point| point[axis]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        assert!((extent(0) - 60.0).abs() < 1e-9 && (extent(2) - 16.0).abs() < 1e-9);
    }
}
