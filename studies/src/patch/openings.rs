//! Slits and round holes in a sheet of strips, against closed forms.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::holed_sheet::{Held, Hole, HoledSheet, Skin};
use crate::kit::{Checks, Failure, Table, percent};

/// Modulus of isotropic skin in N/m.
const MODULUS: f64 = 60.0;
/// Moduli of a skin that is twice as stiff along its lines.
const ORTHOTROPIC: [f64; 2] = [60.0, 30.0];
/// Tension along and across the lines in N/m. It is small next to the modulus, because the closed
/// forms hold for small strains.
const TENSION: [f64; 2] = [0.06, 0.02];
/// Tension of the skin with a round hole. With 3 : 1 the hole would not move across the lines.
const HOLE_TENSION: [f64; 2] = [0.06, 0.04];
/// Largest relative error of an opening.
pub const OPENING_TOLERANCE: f64 = 0.02;
/// Largest relative error of the ratio between two openings.
pub const RATIO_TOLERANCE: f64 = 0.01;
/// Vertices on the edge of the hole, and distance of the border in half-lengths of the hole.
const SIZE: (usize, f64) = (96, 50.0);
/// Sizes of the study of convergence.
const SIZES: [(usize, f64); 6] = [(24, 50.0), (48, 50.0), SIZE, (96, 6.0), (96, 12.0), (96, 25.0)];

/// Isotropic skin whose lines have an angle to the slit.
pub fn isotropic(angle_deg: f64) -> Skin {
    Skin { tension: TENSION, modulus: [MODULUS; 2], angle_deg }
}

/// Isotropic skin for a round hole, with lines at an angle to the x axis.
pub fn around_hole(angle_deg: f64) -> Skin {
    Skin { tension: HOLE_TENSION, ..isotropic(angle_deg) }
}

/// Skin that is twice as stiff along its lines.
pub fn orthotropic(angle_deg: f64) -> Skin {
    Skin { modulus: ORTHOTROPIC, ..isotropic(angle_deg) }
}

/// The opening of a slit in its middle, in m.
///
/// # Errors
/// There is no equilibrium.
pub fn slit(skin: &Skin, held: Held, around: usize, reach: f64) -> Result<f64, Failure> {
    let edge = HoledSheet::new(Hole::Slit, around, reach).cut(skin, held)?;
    Ok(edge[around / 4].y - edge[3 * around / 4].y)
}

/// The displacements of the edge of a round hole along the lines and across them, in m, outwards.
///
/// # Errors
/// There is no equilibrium.
pub fn round_hole(skin: &Skin, held: Held, around: usize, reach: f64) -> Result<[f64; 2], Failure> {
    let edge = HoledSheet::new(Hole::Round, around, reach).cut(skin, held)?;
    let outwards = |angle_deg: f64| {
        let vertex = (angle_deg / 360.0 * around as f64).round() as usize % around;
        let (sin, cos) = (2.0 * PI * vertex as f64 / around as f64).sin_cos();
        edge[vertex].dot(&Vector3::new(cos, sin, 0.0))
    };
    let both = |angle_deg: f64| 0.5 * (outwards(angle_deg) + outwards(angle_deg + 180.0));
    Ok([both(skin.angle_deg), both(skin.angle_deg + 90.0)])
}

/// Relative error of a measured value.
pub fn error(measured: f64, wanted: f64) -> f64 {
    measured / wanted - 1.0
}

/// The tables of the page and the checks.
pub(super) struct Openings {
    pub(super) slits: Table,
    pub(super) holes: Table,
    pub(super) sheets: Table,
    pub(super) checks: Checks,
}

impl Openings {
    /// Measures all slits and holes.
    ///
    /// # Errors
    /// There is no equilibrium.
    pub(super) fn measure() -> Result<Self, Failure> {
        let mut found = Self {
            slits: Table::new([
                "lines to the slit",
                "tension",
                "modulus",
                "tension is held by",
                "opening, µm: closed form",
                "measured",
                "error",
            ]),
            holes: Table::new(["direction", "tension", "displacement, µm: closed form", "measured", "error"]),
            sheets: Table::new([
                "vertices on the edge",
                "border",
                "vertices",
                "slit across the lines",
                "round hole, along",
                "across",
            ]),
            checks: Checks::default(),
        };
        found.measure_slits()?;
        found.measure_holes()?;
        found.measure_sheets()?;
        Ok(found)
    }

    fn measure_slits(&mut self) -> Result<(), Failure> {
        let (around, reach) = SIZE;
        let mut rows: Vec<(Skin, Held)> =
            [0.0, 30.0, 45.0, 60.0, 90.0].map(|angle| (isotropic(angle), Held::Scan(1.0))).into();
        rows.extend([0.0, 90.0].map(|angle| (isotropic(angle), Held::Border)));
        rows.extend([0.0, 90.0].map(|angle| (orthotropic(angle), Held::Scan(1.0))));
        let mut worst = 0.0_f64;
        let mut isotropic_openings = Vec::new();
        for (skin, held) in rows {
            let (wanted, measured) = (skin.slit_opening(), slit(&skin, held, around, reach)?);
            worst = worst.max(error(measured, wanted).abs());
            isotropic_openings.push(measured);
            let held = if held == Held::Border { "border" } else { "load" };
            self.slits.add(
                [format!("{}°", skin.angle_deg), pair(skin.tension), pair(skin.modulus), held.to_owned()]
                    .into_iter()
                    .chain(comparison(measured, wanted)),
            );
        }
        self.checks.add(format!("slits: off by at most {}", percent(worst)), worst <= OPENING_TOLERANCE);
        let [n1, n2] = TENSION;
        let ratio = isotropic_openings[4] / isotropic_openings[0];
        let off = error(ratio, n1 / n2).abs();
        self.checks.add(format!("slits across and along the lines: {ratio:.3} : 1"), off <= RATIO_TOLERANCE);
        for (what, skin, held, meant) in controls() {
            let off = error(slit(&skin, held, around, reach)?, meant.slit_opening());
            self.checks.control(format!("{what}: off by {}", percent(off)), off.abs() > OPENING_TOLERANCE);
        }
        Ok(())
    }

    fn measure_holes(&mut self) -> Result<(), Failure> {
        let (around, reach) = SIZE;
        let mut worst = 0.0_f64;
        for (tension, angle_deg) in [(HOLE_TENSION, 0.0), (HOLE_TENSION, 45.0), ([HOLE_TENSION[0]; 2], 0.0)] {
            let skin = Skin { tension, ..around_hole(angle_deg) };
            let measured = round_hole(&skin, Held::Scan(1.0), around, reach)?;
            let names =
                ["along", "across"].map(|name| format!("{name} the lines, which are at {angle_deg}°"));
            for ((name, measured), wanted) in names.into_iter().zip(measured).zip(skin.hole_displacement()) {
                worst = worst.max(error(measured, wanted).abs());
                self.holes.add([name, pair(tension)].into_iter().chain(comparison(measured, wanted)));
            }
        }
        self.checks.add(format!("round hole: off by at most {}", percent(worst)), worst <= OPENING_TOLERANCE);
        let turned = round_hole(&around_hole(90.0), Held::Scan(1.0), around, reach)?;
        let [_, wanted] = around_hole(0.0).hole_displacement();
        let off = error(turned[0], wanted);
        self.checks.control(
            format!("round hole, lines turned by 90°: off by {}", percent(off)),
            off.abs() > OPENING_TOLERANCE,
        );
        Ok(())
    }

    fn measure_sheets(&mut self) -> Result<(), Failure> {
        let (skin, held) = (isotropic(90.0), Held::Scan(1.0));
        let mut errors = Vec::new();
        for (around, reach) in SIZES {
            let vertices =
                [Hole::Slit, Hole::Round].map(|hole| HoledSheet::new(hole, around, reach).vertices());
            let opening = error(slit(&skin, held, around, reach)?, skin.slit_opening());
            let around_hole = around_hole(0.0);
            let displacements = round_hole(&around_hole, held, around, reach)?;
            let wanted = around_hole.hole_displacement();
            let [along, across] = [0, 1].map(|n| error(displacements[n], wanted[n]));
            errors.push(opening.abs().max(along.abs()).max(across.abs()));
            self.sheets.add([
                around.to_string(),
                format!("{reach} a"),
                format!("{}, {}", vertices[0], vertices[1]),
                signed(opening),
                signed(along),
                signed(across),
            ]);
        }
        self.checks.add("finer sheets have smaller errors", errors[0] > errors[1] && errors[1] > errors[2]);
        let falls = errors[3] > errors[4] && errors[4] > errors[5] && errors[5] > errors[2];
        self.checks.add("larger sheets have smaller errors", falls);
        Ok(())
    }
}

/// Wrong skins and wrong loads: what they are, and the skin whose opening they must miss.
pub fn controls() -> [(&'static str, Skin, Held, Skin); 5] {
    let (along, across) = (isotropic(0.0), isotropic(90.0));
    let swapped = Skin { modulus: [ORTHOTROPIC[1], ORTHOTROPIC[0]], ..along };
    [
        ("lines turned by 90°", across, Held::Scan(1.0), along),
        ("moduli exchanged", swapped, Held::Scan(1.0), orthotropic(0.0)),
        ("moduli of other skin", orthotropic(0.0), Held::Scan(1.0), along),
        ("no load of the removed strips", along, Held::Scan(0.0), along),
        ("load of the removed strips with the wrong sign", along, Held::Scan(-1.0), along),
    ]
}

/// Wanted and measured lengths in µm, and the error.
fn comparison(measured: f64, wanted: f64) -> [String; 3] {
    let micrometers = |length: f64| format!("{:.3}", length * 1e6);
    [micrometers(wanted), micrometers(measured), signed(error(measured, wanted))]
}

fn pair([along, across]: [f64; 2]) -> String {
    format!("{along}, {across} N/m")
}

fn signed(share: f64) -> String {
    format!("{:+.2} %", 100.0 * share)
}
