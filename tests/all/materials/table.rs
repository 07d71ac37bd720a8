//! A table of materials for the tests, and the moduli that the elements of a scene get from it.

use std::collections::BTreeMap;

use cutis::LoadedScene;
use cutis::solver::{Stiffness, System};

use crate::scenes::{SMALL, scene};

/// A row of a table.
#[derive(Clone, Copy)]
pub struct Row {
    pub name: &'static str,
    pub hu: Option<[f64; 2]>,
    pub depth_mm: Option<[f64; 2]>,
    pub youngs_modulus_pa: f64,
    pub bulk_modulus_pa: f64,
}

const fn row(
    name: &'static str,
    hu: Option<[f64; 2]>,
    depth_mm: Option<[f64; 2]>,
    youngs_modulus_pa: f64,
) -> Row {
    Row { name, hu, depth_mm, youngs_modulus_pa, bulk_modulus_pa: 10.0 * youngs_modulus_pa }
}

/// Layers of the small phantom, whose lattice step is about 9 mm.
pub const LAYERS: [Row; 5] = [
    row("skin", None, Some([0.0, 5.0]), 6e3),
    row("bone", Some([250.0, 4000.0]), None, 3e6),
    row("fat", Some([-2000.0, -30.0]), None, 3e3),
    row("muscle", None, Some([5.0, 31.0]), 1e4),
    row("organs", None, None, 5e3),
];

impl Row {
    pub fn holds(&self, hu: f64, depth_mm: f64) -> bool {
        let within = |range: Option<[f64; 2]>, value: f64| {
            range.is_none_or(|[low, high]| low <= value && value < high)
        };
        within(self.hu, hu) && within(self.depth_mm, depth_mm)
    }
}

/// The rows as a TOML value.
pub fn toml(rows: &[Row]) -> String {
    let range = |key: &str, range: Option<[f64; 2]>| {
        range.map_or(String::new(), |[low, high]| format!("{key} = [{low:?}, {high:?}], "))
    };
    let one = |row: &Row| {
        format!(
            "{{ name = {:?}, {}{}youngs_modulus_pa = {:?}, bulk_modulus_pa = {:?} }}",
            row.name,
            range("hu", row.hu),
            range("depth_mm", row.depth_mm),
            row.youngs_modulus_pa,
            row.bulk_modulus_pa
        )
    };
    format!("[{}]", rows.iter().map(one).collect::<Vec<_>>().join(", "))
}

/// The small phantom with a table of materials and more overrides.
pub fn small(rows: &[Row], set: &[(&str, &str)]) -> LoadedScene {
    let table = toml(rows);
    let of_table =
        [("materials", table.as_str()), ("constraints.distance", "{}"), ("constraints.volume", "{}")];
    scene(SMALL, &[&of_table, set].concat())
}

/// The rest positions of an element's vertices, in ascending order, as bits.
pub type Place = Vec<[u32; 3]>;

/// Modulus of each spring and each volume of a scene with a table, Pa: the compliance of the scene
/// with one modulus for all, over the compliance with the table, times that modulus.
pub fn moduli(with_table: &LoadedScene) -> [BTreeMap<Place, f64>; 2] {
    let mut uniform = with_table.clone();
    uniform.scene.materials = None;
    if let Some(distance) = &mut uniform.scene.constraints.distance {
        distance.youngs_modulus_pa = Some(1e4);
    }
    if let Some(volume) = &mut uniform.scene.constraints.volume {
        volume.bulk_modulus_pa = Some(1e4);
    }
    let [by_table, same] = [with_table, &uniform].map(|loaded| cutis::build_system(loaded).unwrap().system);
    [0, 1].map(|kind| {
        let compliances = [&by_table, &same].map(|system| compliances(system, kind));
        let [by_table, same] = &compliances;
        by_table.iter().map(|(place, compliance)| (place.clone(), 1e4 * same[place] / compliance)).collect()
    })
}

/// The place of an element with these vertices.
pub fn place(system: &System<f32>, tuple: &[u32]) -> Place {
    let positions = tuple.iter().map(|&v| system.vertices()[v as usize].position());
    let mut place: Place = positions.map(|x| [x.x, x.y, x.z].map(f32::to_bits)).collect();
    place.sort_unstable();
    place
}

fn compliances(system: &System<f32>, kind: usize) -> BTreeMap<Place, f64> {
    let set = &system.kinds()[kind];
    let Stiffness::Compliance(values) = set.stiffness() else { panic!("{} has no compliance", set.name()) };
    let tuples = set.indices().chunks_exact(set.arity()).enumerate();
    tuples.map(|(n, tuple)| (place(system, tuple), f64::from(values.at(n)))).collect()
}
