//! The same wound on the phantom, turned in the scanner: the load that the cut sets free, and how
//! far the wound opens.

use std::path::Path;

use cutis::volume::phantom::Phantom;
use cutis::{LoadedScene, Scene, SceneSystem, build_system};
use cutis_mesh::sever::Embedded;
use cutis_newton::{Options, Problem};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::kit::{Checks, Failure, Table};

/// Tension along and across the lines in N/m. It is a fifth of that of the preset `trunk`, so that
/// strains are small.
const TENSION: [f64; 2] = [3.0, 1.0];
/// Largest relative error of the load.
const LOAD_TOLERANCE: f64 = 0.01;
/// Largest load along the normal over the tension.
const NORMAL_TOLERANCE: f64 = 0.05;
/// Length and depth of the cut in mm.
const LENGTH_MM: f64 = 80.0;
const DEPTH_MM: f64 = 30.0;
/// Half of the part of the cut where the load is measured, over the length of the cut. The ends of
/// the cut lie on the lattice, so they do not count.
const LOADED_PART: f64 = 0.4;
/// Everything within this distance of the cut is simulated, mm.
const AROUND_MM: f64 = 80.0;
/// Planes beyond which tissue is fixed: axis of the patient (across the cut, outwards and along it)
/// and distance from the middle of the cut in mm.
const FIXED_MM: [(usize, f64); 5] = [(0, -60.0), (0, 60.0), (1, -50.0), (2, -80.0), (2, 80.0)];
/// Middle of the cut along the body in mm.
const MIDDLE_MM: f64 = -20.0;
/// Half of the part of the cut where movements are averaged, over the length of the cut.
const MEASURED_PART: f64 = 0.25;
/// Range of distances from the cut in mm, in which displacements of the tissue are averaged.
const TISSUE_MM: [f64; 2] = [4.0, 14.0];
/// Depth below the skin in mm to which displacements are averaged.
const SHALLOW_MM: f64 = 12.0;
/// Voxels per axis of the phantom. They are 2.5 mm apart, less than a lattice step.
const SIZE: usize = 160;
/// Lattice steps in mm of the patient that is not turned. The skin lies at another place within the
/// cells of each.
const LATTICES_MM: [f64; 6] = [2.8, 2.9, 3.0, 3.1, 3.2, 3.3];
/// Largest difference of an opening from the mean over the turns, or over these lattices.
const OPENING_TOLERANCE: f64 = 0.03;
/// Young's moduli of fat (that of the preset `trunk`) and of firm tissue in Pa. The skin retracts
/// over the length modulus of the membrane / modulus of the tissue, which is 18 mm and 3 mm: 4.6
/// steps of 4 mm, and less than one.
const FAT_PA: f64 = 3.25e3;
const FIRM_PA: f64 = 2e4;
/// Bulk modulus over Young's modulus, as in the presets.
const BULK_TO_YOUNG: f64 = 10.0;
/// Relative gradient at which the body is at rest. A smaller one takes some turns hundreds of
/// iterations, because a node at the end of the cut holds little.
const AT_REST: f64 = 1e-4;

/// The skin of the patient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TurnedSkin {
    /// A membrane with lines around the trunk, which the cut crosses.
    Membrane,
    /// A membrane with lines along the trunk: a control.
    OtherLines,
    /// The area form, with the larger tension in all directions.
    Area,
}

/// A patient in the scanner with a cut along the midline of the belly.
#[derive(Clone, Copy, Debug)]
pub struct Patient {
    /// The skin.
    pub skin: TurnedSkin,
    /// Name of the split of lattice cells.
    pub split: &'static str,
    /// Lattice step in mm.
    pub spacing_mm: f64,
    /// Whether the vertices of the skin are on a smooth surface. If not, they are on the planes of
    /// the lattice.
    pub smooth: bool,
    /// Young's modulus of the tissue in Pa.
    pub tissue_pa: f64,
    /// Angles in degrees about x, y and z.
    pub turn_deg: [f64; 3],
}

/// A wound of a patient.
#[derive(Clone, Copy, Debug)]
pub struct TurnedWound {
    /// Load that the cut sets free across itself, along the skin, in N/m of its length: a mean over
    /// the middle of the cut.
    pub across: f64,
    /// Load that the cut sets free along the normal of the skin, in either direction, in N/m of its
    /// length.
    pub normal: f64,
    /// How far the lips move apart, in mm: a mean over the middle half of the cut.
    pub opening_mm: f64,
    /// How far the tissue on both sides of the cut moves apart there, in mm.
    pub tissue_mm: f64,
}

impl Patient {
    /// A patient with a smooth membrane over fat, on a lattice of 4 mm.
    pub fn new(skin: TurnedSkin, turn_deg: [f64; 3]) -> Self {
        Self { skin, split: "five", spacing_mm: 4.0, smooth: true, tissue_pa: FAT_PA, turn_deg }
    }

    fn phantom(&self) -> Result<Phantom, Failure> {
        Ok(Phantom::new([SIZE; 3], 1)?.turned(self.turn_deg)?)
    }

    /// The scene. Everything in it turns with the patient.
    fn scene(&self) -> Result<LoadedScene, Failure> {
        let phantom = self.phantom()?;
        let axis = phantom.place([0.0, 0.0, 1.0]);
        let end = |side: f64| {
            let middle = self.middle(&phantom)? + self.axes(&phantom)[2] * (side * 0.5 * LENGTH_MM);
            Ok::<[f64; 3], Failure>(middle.into())
        };
        let (from, to) = (end(-1.0)?, end(1.0)?);
        let [along, across] = TENSION;
        let membrane = |modulus: [f64; 2], lines: &str| {
            format!(
                "membrane = {{ tension_along_n_per_m = {along:?}, tension_across_n_per_m = {across:?}, \
                 modulus_along_n_per_m = {:?}, modulus_across_n_per_m = {:?}, directions = {{ {lines} = \
                 {axis:?} }} }}",
                modulus[0], modulus[1]
            )
        };
        let skin = match self.skin {
            TurnedSkin::Membrane => membrane([60.0, 40.0], "around"),
            TurnedSkin::OtherLines => membrane([60.0, 40.0], "along"),
            // The tension is T(1 − s)/s.
            TurnedSkin::Area => {
                let scale = 60.0 / (60.0 + along);
                format!(
                    "stc = {{ area_modulus_n_per_m = 60.0, amplification = 0.0, rest_area_scale = {scale:?} }}"
                )
            }
        };
        let Self { split, spacing_mm, smooth, tissue_pa, turn_deg, .. } = self;
        let fixed = self.fixed(&phantom)?;
        let bulk_pa = BULK_TO_YOUNG * tissue_pa;
        let text = format!(
            "scan_is_at_rest = true\nmaterials = [{{ name = 'tissue', youngs_modulus_pa = {tissue_pa:?}, \
             bulk_modulus_pa = {bulk_pa:?} }}]\nvolume.phantom = {{ size = [{SIZE}, {SIZE}, {SIZE}], seed = 1, \
             turn_deg = {turn_deg:?} }}\nlattice = {{ spacing_mm = {spacing_mm:?}, split = '{split}', region = \
             {{ around_mm = {AROUND_MM:?} }} }}\nskin.smooth = {smooth}\nconstraints = {{ distance = {{}}, \
             volume = {{}}, {skin} }}\nincision = [{{ from_mm = {from:?}, to_mm = {to:?}, depth_mm = \
             {DEPTH_MM:?} }}]\nfixed.planes = [{fixed}]\nsolver.formulation = 'vbd'\n"
        );
        Ok(Scene::parse(&text, Path::new("turned.toml"), Path::new(""), &[])?)
    }

    /// The patient's axes in the scanner: across the cut, outwards, and along the cut.
    fn axes(&self, phantom: &Phantom) -> [Vector3<f64>; 3] {
        [0, 1, 2]
            .map(|axis| Vector3::from(phantom.place(std::array::from_fn(|c| f64::from(u8::from(c == axis))))))
    }

    /// The middle of the cut in mm.
    fn middle(&self, phantom: &Phantom) -> Result<Vector3<f64>, Failure> {
        let ([_, front, _], _) = Phantom::new([SIZE; 3], 1)?.incision_site();
        Ok(phantom.place([0.0, front, MIDDLE_MM]).into())
    }

    /// The planes beyond which tissue is fixed. They turn with the patient, so that the body is the
    /// same in each turn.
    fn fixed(&self, phantom: &Phantom) -> Result<String, Failure> {
        let middle = self.middle(phantom)?;
        let axes = self.axes(phantom);
        let planes = FIXED_MM.map(|(axis, at)| {
            let point: [f64; 3] = (middle + axes[axis] * at).into();
            let normal: [f64; 3] = (axes[axis] * at.signum()).into();
            format!("{{ point_mm = {point:?}, normal = {normal:?} }}")
        });
        Ok(planes.join(", "))
    }

    /// Builds the patient and returns the load that the cut sets free: across it and along the
    /// normal of the skin, in N/m.
    ///
    /// # Errors
    /// The scene is refused.
    pub fn load(&self) -> Result<[f64; 2], Failure> {
        let built = build_system(&self.scene()?)?;
        self.load_of(&built)
    }

    /// True if a load across the cut in N/m is the tension along the lines.
    pub fn has_right_load(across: f64) -> bool {
        (across / TENSION[0] - 1.0).abs() <= LOAD_TOLERANCE
    }

    fn load_of(&self, built: &SceneSystem) -> Result<[f64; 2], Failure> {
        let phantom = self.phantom()?;
        let [across, normal, along] = self.axes(&phantom);
        let middle = self.middle(&phantom)?;
        let half = LOADED_PART * LENGTH_MM;
        let mut sums = [0.0; 2];
        let positions = built.system.positions();
        for (v, force) in freed(built)?.into_iter().enumerate() {
            if built.system.vertices()[v].inverse_mass() > 0.0 {
                let z = along.dot(&(built.frame.to_mm(positions[v]).coords - middle));
                let weight = bump(z, [-half, half]);
                sums[0] += weight * force.dot(&across).abs();
                sums[1] += weight * force.dot(&normal).abs();
            }
        }
        // Both lips count. The integral of the weights is ⅔ of their range.
        let lips_m = 2.0 * (2.0 / 3.0) * (2.0 * half) * 1e-3;
        Ok(sums.map(|sum| sum / lips_m))
    }

    /// Cuts the patient and finds the equilibrium.
    ///
    /// # Errors
    /// The scene is refused, or there is no equilibrium.
    pub fn wound(&self) -> Result<TurnedWound, Failure> {
        let built = build_system(&self.scene()?)?;
        let phantom = self.phantom()?;
        let axes = self.axes(&phantom);
        let [across, normal] = self.load_of(&built)?;
        let problem = Problem::of(&built.system, [0.0; 3])?;
        let before = problem.positions();
        let options = Options { tolerance: AT_REST, max_iterations: 1000 };
        let after = problem.equilibrium(before, &options)?.positions;
        let middle = self.middle(&phantom)?;
        let place =
            |rest: Point3<f64>| axes.map(|axis| axis.dot(&(built.frame.to_mm(rest.cast()).coords - middle)));
        // Weights fall to zero at the edges of the window.
        let half = MEASURED_PART * LENGTH_MM;
        let mut tissue = [Mean::default(); 2];
        for (rest, now) in before.iter().zip(&after) {
            let [x, y, z] = place(*rest);
            let weight =
                bump(z, [-half, half]) * bump(x.abs(), TISSUE_MM) * bump(y, [-SHALLOW_MM, SHALLOW_MM]);
            tissue[usize::from(x > 0.0)].add(weight, axes[0].dot(&(now - rest)) * 1e3);
        }
        let lip = |points: &[Embedded]| {
            let mut mean = Mean::default();
            for point in points {
                let [rest, now] = [before, &after].map(|x| point.at_by(&|node| x[node as usize]));
                mean.add(bump(place(rest)[2], [-half, half]), axes[0].dot(&(now - rest)) * 1e3);
            }
            mean.value()
        };
        let gape = &built.gapes[0];
        // The axis across the cut points to the left lip, seen along the cut from outside.
        let opening_mm = lip(gape.left()) - lip(gape.right());
        let tissue_mm = tissue[1].value() - tissue[0].value();
        Ok(TurnedWound { across, normal, opening_mm, tissue_mm })
    }
}

/// The force on each vertex before it moves, in N: what the cut sets free.
fn freed(built: &SceneSystem) -> Result<Vec<Vector3<f64>>, Failure> {
    let mut forces: Vec<Vector3<f64>> = built.system.constraint_forces()?.iter().map(|f| f.cast()).collect();
    for (force, load) in forces.iter_mut().zip(built.system.loads()) {
        *force += load.cast::<f64>();
    }
    Ok(forces)
}

/// A weighted mean.
#[derive(Clone, Copy, Default)]
struct Mean {
    sum: f64,
    weights: f64,
}

impl Mean {
    fn add(&mut self, weight: f64, value: f64) {
        self.sum += weight * value;
        self.weights += weight;
    }

    fn value(self) -> f64 {
        self.sum / self.weights
    }
}

/// A parabola that is 1 in the middle of a range and 0 outside it.
fn bump(value: f64, [low, high]: [f64; 2]) -> f64 {
    let from_middle = (2.0 * value - low - high) / (high - low);
    (1.0 - from_middle * from_middle).max(0.0)
}

/// The turns of the table: none, and four angles about each axis. On a lattice that is its own
/// mirror image, turns by 45° and −45° about one axis give the same wound.
fn turns() -> Vec<[f64; 3]> {
    let about = |axis: usize| {
        [15.0, 30.0, 45.0, -45.0].map(|angle| std::array::from_fn(|c| if c == axis { angle } else { 0.0 }))
    };
    [vec![[0.0; 3]], (0..3).flat_map(about).collect()].concat()
}

/// A row of the table.
struct Row {
    name: &'static str,
    /// The patient without a turn.
    patient: Patient,
    /// The name of its column in the table of turns.
    column: Option<&'static str>,
    /// Whether the opening should be the same for each turn. None if that is only reported.
    holds: Option<bool>,
}

fn rows() -> [Row; 8] {
    let coarse = Patient::new(TurnedSkin::Membrane, [0.0; 3]);
    let fine = Patient { spacing_mm: 3.0, ..coarse };
    let staircase = |patient| Patient { smooth: false, ..patient };
    let row = |name, patient, column, holds| Row { name, patient, column, holds };
    [
        row("membrane", fine, Some("3 mm"), Some(true)),
        row("control: membrane on the staircase", staircase(fine), Some("3 mm, staircase"), Some(false)),
        row("membrane", coarse, Some("4 mm"), None),
        row("membrane on the staircase", staircase(coarse), Some("4 mm, staircase"), None),
        row("membrane", Patient { split: "kuhn6", ..coarse }, Some("4 mm, `kuhn6`"), None),
        row("membrane", Patient { tissue_pa: FIRM_PA, ..coarse }, Some("4 mm, firm"), None),
        row("area", Patient { skin: TurnedSkin::Area, ..staircase(coarse) }, None, Some(false)),
        row("control: lines turned by 90°", Patient { skin: TurnedSkin::OtherLines, ..coarse }, None, None),
    ]
}

/// The tables of the page and the checks.
pub(super) struct Turned {
    pub(super) spread: Table,
    pub(super) turns: Table,
    pub(super) lattices: Table,
    pub(super) checks: Checks,
}

impl Turned {
    /// Measures all patients.
    ///
    /// # Errors
    /// A scene is refused for another reason than its cut, or there is no equilibrium.
    pub(super) fn measure() -> Result<Self, Failure> {
        let mut spread = Table::new([
            "skin",
            "split",
            "lattice",
            "tissue",
            "load across the cut",
            "largest load along the normal",
            "lips move apart",
            "spread",
            "tissue moves apart",
            "spread",
        ]);
        let mut checks = Checks::default();
        let mut columns = vec!["turn about x, y, z".to_owned()];
        let mut lines: Vec<Vec<String>> =
            turns().iter().map(|turn| vec![turn.map(|angle| format!("{angle}°")).join(", ")]).collect();
        for Row { name, patient, column, holds } in rows() {
            let Patient { skin, split, spacing_mm, tissue_pa, .. } = patient;
            let wound = |turn_deg: [f64; 3]| {
                let wound = Patient { turn_deg, ..patient }.wound()?;
                eprintln!("{name} {split} {spacing_mm} mm {tissue_pa} Pa {turn_deg:?}: {wound:?}");
                Ok(wound)
            };
            let wounds: Result<Vec<TurnedWound>, Failure> = turns().into_par_iter().map(wound).collect();
            let wounds = wounds?;
            let right = wounds.iter().all(|wound| Patient::has_right_load(wound.across));
            if column.is_some() {
                for (line, wound) in lines.iter_mut().zip(&wounds) {
                    line.push(format!("{:.2} mm", wound.opening_mm));
                }
            }
            columns.extend(column.map(str::to_owned));
            let of = |value: fn(&TurnedWound) -> f64| Spread::of(wounds.iter().map(value));
            let (across, opening, tissue) = (of(|w| w.across), of(|w| w.opening_mm), of(|w| w.tissue_mm));
            let normal = of(|w| w.normal).high;
            spread.add([
                name.to_owned(),
                format!("`{split}`"),
                format!("{spacing_mm} mm"),
                format!("{} kPa", tissue_pa / 1000.0),
                format!("{:.2} to {:.2} N/m", across.low, across.high),
                format!("{normal:.2} N/m"),
                format!("{:.2} mm", opening.mean),
                opening.shown(),
                format!("{:.2} mm", tissue.mean),
                tissue.shown(),
            ]);
            let who = format!("{name}, {split}, {spacing_mm} mm, {tissue_pa} Pa");
            let what = |load: &str| format!("{who}: {:.2} to {:.2} N/m {load}", across.low, across.high);
            if let Some(holds) = holds {
                let same = opening.off() <= OPENING_TOLERANCE;
                let what = format!("{who}: opening {}", opening.shown());
                if holds { checks.add(what, same) } else { checks.control(what, !same) }
            }
            match skin {
                TurnedSkin::Area | TurnedSkin::OtherLines => checks.control(what("across the cut"), !right),
                _ => {
                    checks.add(what("across the cut"), right);
                    checks.add(
                        format!("{who}: {normal:.2} N/m along the normal"),
                        normal <= NORMAL_TOLERANCE * TENSION[0],
                    );
                }
            }
            if skin == TurnedSkin::Area {
                checks.control(
                    format!("{name}: {normal:.2} N/m along the normal"),
                    normal > NORMAL_TOLERANCE * TENSION[0],
                );
            }
        }
        let mut turns = Table::new(columns);
        lines.into_iter().for_each(|line| turns.add(line));
        let lattices = lattices(&mut checks)?;
        Ok(Self { spread, turns, lattices, checks })
    }
}

/// The opening of the patient that is not turned, on some lattices.
fn lattices(checks: &mut Checks) -> Result<Table, Failure> {
    let mut table = Table::new(["lattice", "lips move apart", "tissue moves apart"]);
    let mut openings = Vec::new();
    for spacing_mm in LATTICES_MM {
        let patient = Patient { spacing_mm, ..Patient::new(TurnedSkin::Membrane, [0.0; 3]) };
        let TurnedWound { opening_mm, tissue_mm, .. } = patient.wound()?;
        table.add([format!("{spacing_mm} mm"), format!("{opening_mm:.2} mm"), format!("{tissue_mm:.2} mm")]);
        openings.push(opening_mm);
    }
    let spread = Spread::of(openings.iter().copied());
    let same = spread.off() <= OPENING_TOLERANCE;
    checks.add(format!("lattices of 2.8 to 3.3 mm: opening {}", spread.shown()), same);
    Ok(table)
}

/// Mean and ends of some values.
struct Spread {
    mean: f64,
    low: f64,
    high: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count() as f64;
        Self {
            mean: values.clone().sum::<f64>() / count,
            low: values.clone().fold(f64::INFINITY, f64::min),
            high: values.fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// Largest distance from the mean, as a part of it.
    fn off(&self) -> f64 {
        (self.high / self.mean - 1.0).max(1.0 - self.low / self.mean)
    }

    /// Distance of the ends from the mean.
    fn shown(&self) -> String {
        let part = |end: f64| 100.0 * (end / self.mean - 1.0);
        format!("{:+.1} %, {:+.1} %", part(self.low), part(self.high))
    }
}
