//! How far from a cut the skin moves, over a layer of soft tissue on firm ground: the lattice
//! against closed forms and finite elements in plane strain.

use super::layer::Layer;
use super::slab::Slab;
use crate::kit::{Checks, Failure, Table, percent};

/// Cells of the lattice over the thickness of a layer.
pub const ROWS: usize = 16;
/// Largest difference of a profile from the finite elements, over the displacement at the cut.
pub const PROFILE_TOLERANCE: f64 = 0.01;
/// Largest relative error of a decay length.
pub const DECAY_TOLERANCE: f64 = 0.003;
/// Length of a slab in lengths of shear lag. Its far end is fixed.
const REACH: f64 = 12.0;
/// Rows of finite elements over the thickness of a layer.
pub const ELEMENT_ROWS: usize = 64;
/// Where the decay length is measured, in lengths of shear lag from the cut.
const FAR: [f64; 2] = [3.0, 6.0];
/// Distances of the table in mm.
const DISTANCES_MM: [f64; 9] = [0.0, 10.0, 20.0, 40.0, 60.0, 80.0, 120.0, 160.0, 200.0];
/// Tension of the trunk in N/m.
const TENSION: f64 = 15.0;
/// The factor of the tension with which springs stay linear.
const SMALL: f64 = 1e-3;

/// A layer of fat of 20 mm below the skin of a trunk, as in the presets: a shear modulus of
/// 1083 Pa, and a tension and a modulus of the skin of 15 and 60 N/m.
pub fn fat(poisson: f64) -> Layer {
    Layer {
        thickness: 0.02,
        shear_modulus: 3250.0 / 3.0,
        poisson,
        skin_modulus: 60.0,
        tension: SMALL * TENSION,
    }
}

/// Poisson's ratio of the presets, with a bulk modulus of the volume constraints of 32.5 kPa.
const POISSON: f64 = 0.484_375;
/// Poisson's ratio of a tissue that is easier to compress.
const COMPRESSIBLE: f64 = 0.3;

/// A layer of 10 mm that is thin compared with its length of shear lag.
pub fn thin(skin_modulus: f64) -> Layer {
    Layer {
        thickness: 0.01,
        shear_modulus: 1000.0,
        poisson: COMPRESSIBLE,
        skin_modulus,
        tension: 1e-4 * skin_modulus,
    }
}

/// Displacement of the skin of a layer, at equal distances from the cut on.
pub struct Skin {
    layer: Layer,
    /// Distance of neighbors in m.
    step: f64,
    /// Displacements in m.
    moved: Vec<f64>,
}

impl Skin {
    /// The skin of a lattice with `rows` cells over the thickness, in equilibrium.
    ///
    /// # Errors
    /// A material is refused, or there is no equilibrium.
    pub fn of_lattice(layer: Layer, rows: usize) -> Result<Self, Failure> {
        let step = layer.thickness / rows as f64;
        Ok(Self { layer, step, moved: Slab::new(layer, columns(&layer, rows), rows).cut()? })
    }

    /// The skin of finite elements in plane strain, with `rows` elements over the thickness.
    pub fn of_elements(layer: Layer, rows: usize) -> Self {
        let step = layer.thickness / rows as f64;
        Self { layer, step, moved: layer.elements(columns(&layer, rows), rows) }
    }

    /// Displacement in m at a distance in m from the cut, between neighbors on a line.
    pub fn at(&self, distance: f64) -> f64 {
        let place = distance / self.step;
        let low = (place.floor() as usize).min(self.moved.len() - 2);
        let share = place - low as f64;
        (1.0 - share) * self.moved[low] + share * self.moved[low + 1]
    }

    /// Largest difference from the displacement `wanted` at a distance, over that at the cut. Both
    /// are compared up to six lengths of shear lag.
    pub fn difference(&self, wanted: impl Fn(f64) -> f64) -> f64 {
        let last = (FAR[1] * self.layer.lag_length() / self.step) as usize;
        let distances = (0..last).map(|n| n as f64 * self.step);
        distances.map(|s| (self.at(s) - wanted(s)).abs()).fold(0.0, f64::max) / wanted(0.0)
    }

    /// The length in m over which the displacement far from the cut falls by the factor `e`.
    pub fn decay_length(&self) -> f64 {
        let [near, far] = FAR.map(|lengths| (lengths * self.layer.lag_length() / self.step) as usize);
        (far - near) as f64 * self.step / (self.moved[near] / self.moved[far]).ln()
    }
}

/// Cells along a slab.
fn columns(layer: &Layer, rows: usize) -> usize {
    (REACH * layer.lag_length() / layer.thickness * rows as f64).round() as usize
}

/// What the study measures.
pub struct FarField {
    /// Displacements by the distance from the cut.
    pub profile: Table,
    /// Lengths of decay.
    pub decay: Table,
    pub checks: Checks,
}

impl FarField {
    /// Measures all slabs.
    ///
    /// # Errors
    /// There is no equilibrium.
    pub fn measure() -> Result<Self, Failure> {
        let mut checks = Checks::default();
        let profile = profile(&mut checks)?;
        let decay = decay(&mut checks)?;
        Ok(Self { profile, decay, checks })
    }
}

/// Displacements over the fat of the presets.
fn profile(checks: &mut Checks) -> Result<Table, Failure> {
    let layer = fat(POISSON);
    let small = Skin::of_lattice(layer, ROWS)?;
    let full = Skin::of_lattice(Layer { tension: TENSION, ..layer }, ROWS)?;
    let elements = Skin::of_elements(layer, ELEMENT_ROWS);
    let mut table =
        Table::new(["distance", "lattice", "plane strain", "shear lag", "lattice with the full tension"]);
    for distance_mm in DISTANCES_MM {
        let s = 1e-3 * distance_mm;
        let scaled = [small.at(s), elements.at(s), layer.lag(s)].map(|moved| moved / SMALL);
        let cells = scaled.into_iter().chain([full.at(s)]).map(|moved| format!("{:.3} mm", 1e3 * moved));
        table.add([format!("{distance_mm} mm")].into_iter().chain(cells));
    }
    let off = small.difference(|s| elements.at(s));
    checks.add(format!("far field: off from plane strain by {}", percent(off)), off < PROFILE_TOLERANCE);
    for (what, other) in [
        ("twice the thickness", Layer { thickness: 2.0 * layer.thickness, ..layer }),
        ("four times the shear modulus", Layer { shear_modulus: 4.0 * layer.shear_modulus, ..layer }),
    ] {
        let other = Skin::of_elements(other, ROWS);
        let off = small.difference(|s| other.at(s));
        checks.control(format!("far field, {what}: off by {}", percent(off)), off > 10.0 * PROFILE_TOLERANCE);
    }
    let off = full.decay_length() / layer.decay_length() - 1.0;
    let what = format!("far field, full tension: decay length off by {}", percent(off));
    checks.add(what, off.abs() < DECAY_TOLERANCE);
    Ok(table)
}

/// Lengths of decay for steps of the lattice.
fn decay(checks: &mut Checks) -> Result<Table, Failure> {
    let mut table = Table::new([
        "layer",
        "modulus of the skin",
        "Poisson's ratio",
        "λ of shear lag",
        "λ exact",
        "lattice, 4 cells",
        "lattice, 8 cells",
        "lattice, 16 cells",
    ]);
    for layer in [thin(2400.0), thin(600.0), fat(COMPRESSIBLE), fat(POISSON)] {
        let exact = layer.decay_length();
        let skins: Result<Vec<Skin>, Failure> =
            [4, 8, 16].into_iter().map(|rows| Skin::of_lattice(layer, rows)).collect();
        let skins = skins?;
        let millimeters = |length: f64| format!("{:.2} mm", 1e3 * length);
        let head = [
            format!("{} mm", 1e3 * layer.thickness),
            format!("{} N/m", layer.skin_modulus),
            format!("{:.2}", layer.poisson),
            millimeters(layer.lag_length()),
            millimeters(exact),
        ];
        let lengths = skins.iter().map(|skin| millimeters(skin.decay_length()));
        table.add(head.into_iter().chain(lengths));
        let off = skins[2].decay_length() / exact - 1.0;
        let what = format!("decay length of {}: off by {}", millimeters(exact), percent(off));
        checks.add(what, off.abs() < DECAY_TOLERANCE);
    }
    Ok(table)
}
