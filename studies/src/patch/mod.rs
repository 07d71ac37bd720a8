//! Forms of skin tension on the staircase of a plane: tension and modulus in the plane, for planes
//! of random orientation.
//!
//! The skin of a lattice is a staircase. A form of skin tension should act on it as on the plane:
//! with the same tension and the same modulus in every direction for which they are equal. The
//! tension in the plane is the sum `Σ −f_i ⊗ X_i` over the forces of the constraints, divided by
//! the area of the plane.
//!
//! Slits and round holes in a flat sheet of strips open as far as closed forms say. A cut in a
//! phantom that is turned in the scanner sets the same load free for every turn.

mod forms;
mod holed_sheet;
mod measure;
mod openings;
mod skin;
mod turned;

use std::io::Write;

use clap::Parser;

pub use forms::Form;
pub use holed_sheet::{Held, Skin};
pub use measure::{Measured, Patch, Spread, Staircase, skins};
pub use openings::{
    OPENING_TOLERANCE, RATIO_TOLERANCE, around_hole, controls, error, isotropic, orthotropic, round_hole,
    slit,
};
pub use skin::PlaneSkin;
pub use turned::{Patient, TurnedSkin, TurnedWound};

use openings::Openings;
use turned::Turned;

use crate::kit::{Checks, Failure, Page, Provenance, Table, results};

/// Measures skin tension on the staircases of random planes.
#[derive(Clone, Debug, Parser)]
#[command(name = "patch", bin_name = "cargo xtask study patch")]
pub struct Options {
    /// Number of planes.
    #[arg(long, default_value_t = 50)]
    pub planes: usize,
    /// Measure the patient who lies turned in the scanner instead. It takes minutes.
    #[arg(long)]
    pub turned: bool,
    /// Write the tables of docs/results/tension.md.
    #[arg(long)]
    pub write: bool,
}

/// Name of the page.
pub const PAGE: &str = "tension";
/// Tables of the page.
pub const TABLES: [&str; 12] = [
    "provenance",
    "staircase",
    "patch",
    "slits",
    "holes",
    "sheets",
    "checks",
    "turned-provenance",
    "turned",
    "turns",
    "turned-lattices",
    "turned-checks",
];
/// Largest relative error of a tension or modulus of strips.
pub const TOLERANCE: f64 = 0.01;

/// Measures all forms. Returns whether all checks hold.
///
/// # Errors
/// There is no plane, a lattice is refused, or the page cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open(PAGE, &TABLES)).transpose()?;
    if options.turned {
        return turned(page, out);
    }
    let provenance = Provenance::start(if options.write { "patch --write" } else { "patch" });
    let skins = skins(options.planes)?;
    let measured: Vec<(Form, Measured)> =
        Form::ALL.into_iter().filter_map(|form| Some((form, Measured::of(form, &skins)?))).collect();
    let staircase = staircase(&skins).markdown();
    let patch = table(measured.iter().map(|(_, measured)| measured)).markdown();
    let openings = Openings::measure()?;
    let [slits, holes, sheets] =
        [&openings.slits, &openings.holes, &openings.sheets].map(|table| table.markdown());
    let mut checks = checks(&measured);
    checks.append(openings.checks);
    writeln!(out, "{staircase}\n{patch}\n{slits}\n{holes}\n{sheets}")?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("provenance", &provenance.markdown())?;
        page.set("staircase", &staircase)?;
        page.set("patch", &patch)?;
        page.set("slits", &slits)?;
        page.set("holes", &holes)?;
        page.set("sheets", &sheets)?;
        page.set("checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// Measures turned patients. Returns whether all checks hold.
fn turned(page: Option<Page>, out: &mut dyn Write) -> Result<bool, Failure> {
    let provenance = Provenance::start("patch --turned --write");
    let Turned { spread, turns, lattices, checks } = Turned::measure()?;
    let [spread, turns, lattices] = [spread, turns, lattices].map(|table| table.markdown());
    writeln!(out, "{spread}\n{turns}\n{lattices}")?;
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("turned-provenance", &provenance.markdown())?;
        page.set("turned", &spread)?;
        page.set("turns", &turns)?;
        page.set("turned-lattices", &lattices)?;
        page.set("turned-checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// Strips must have the right tension and modulus, and the other forms must not.
fn checks(measured: &[(Form, Measured)]) -> Checks {
    let mut checks = Checks::default();
    for (form, found) in measured {
        let Measured { worst, ratio, modulus, .. } = found;
        let tension = *worst <= TOLERANCE;
        match form {
            Form::Strips => {
                checks.add(format!("strips: tension off by at most {worst:.1e}"), tension);
                let off = f64::max(modulus.most - 1.0, 1.0 - modulus.low);
                checks.add(format!("strips: modulus off by {off:.1e}"), off <= TOLERANCE);
            }
            Form::ProjectedArea => {
                checks.add(format!("area of the projection: tension off by {worst:.1e}"), tension);
            }
            Form::StripsSloped => {
                let refused = modulus.low < 1.0 - TOLERANCE;
                checks.control(format!("strips with the slope: modulus {:.3}", modulus.low), refused);
            }
            Form::StripsTilted => {}
            Form::Area | Form::AreaBySight | Form::AreaByMean | Form::StripsExchanged => {
                checks.control(format!("{}: tensions differ by {:.2} : 1", found.form, ratio.most), !tension);
            }
        }
    }
    checks
}

/// A share of the area of a plane.
type Share = fn(&Staircase) -> f64;

/// The staircases.
fn staircase(skins: &[PlaneSkin]) -> Table {
    let staircases: Vec<Staircase> = skins.iter().map(Staircase::of).collect();
    let mut table = Table::new(["share of the area of the plane", "mean", "5 %", "95 %", "most"]);
    let rows: [(&str, Share); 3] = [
        ("area of the triangles", |staircase| staircase.area),
        ("area as seen along the normal", |staircase| staircase.projected),
        ("area that faces inwards", |staircase| staircase.inwards),
    ];
    for (what, share) in rows {
        if let Some(spread) = Spread::of(staircases.iter().map(share)) {
            table.add([what.to_owned()].into_iter().chain(cells(&spread)));
        }
    }
    table
}

/// The forms.
fn table<'a>(measured: impl Iterator<Item = &'a Measured>) -> Table {
    let mut table = Table::new([
        "form",
        "tension: mean",
        "5 %",
        "95 %",
        "ratio: mean",
        "95 %",
        "worst",
        "modulus: mean",
        "5 %",
        "95 %",
    ]);
    for Measured { form, tension, ratio, modulus, .. } in measured {
        let [mean, low, high, _] = cells(tension);
        let [ratio_mean, _, ratio_high, ratio_most] = cells(ratio);
        let [modulus_mean, modulus_low, modulus_high, _] = cells(modulus);
        table.add([
            (*form).to_owned(),
            mean,
            low,
            high,
            ratio_mean,
            ratio_high,
            ratio_most,
            modulus_mean,
            modulus_low,
            modulus_high,
        ]);
    }
    table
}

/// Mean, 5 %, 95 % and largest value.
fn cells(spread: &Spread) -> [String; 4] {
    [spread.mean, spread.low, spread.high, spread.most].map(|value| format!("{value:.3}"))
}
