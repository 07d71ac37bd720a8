//! The row of each vertex, compared with a search through all rows and all triangles of the skin.

use cutis::{LoadedScene, Plan};
use nalgebra::{Point3, Vector3};

use super::table::{LAYERS, Row, moduli, place, small};
use crate::outputs::vtu::Vtu;
use crate::scenes::{Run, SMALL, scene};

const UNCUT: (&str, &str) = ("incision", "[]");

/// HU and depth of each vertex of the uncut phantom. The files of a run without frames hold the
/// vertices in the order of the system.
struct Vertices {
    hu: Vec<f64>,
    depths_mm: Vec<f64>,
}

impl Vertices {
    fn of_phantom() -> Self {
        let outputs = ("output", "{ surface = true, tissue = true }");
        let run = Run::of(&scene(SMALL, &[UNCUT, ("run.frames", "0"), outputs]));
        let [tissue, skin] = ["tissue.vtu", "skin.vtu"].map(|name| Vtu::of_bytes(&run.bytes(name)));
        let corner = |v: &usize| Point3::from(skin.points[*v]);
        let triangles: Vec<Vec<Point3<f64>>> =
            skin.cells.iter().map(|cell| cell.iter().map(corner).collect()).collect();
        let depth = |point: &[f64; 3]| {
            let to_triangle = |corners: &Vec<Point3<f64>>| distance(&(*point).into(), corners);
            triangles.iter().map(to_triangle).fold(f64::INFINITY, f64::min)
        };
        let depths_mm = tissue.points.iter().map(depth).collect();
        Self { hu: tissue.scalars("hu").to_vec(), depths_mm }
    }

    /// Number of the row of each vertex.
    fn rows(&self, rows: &[Row]) -> Vec<usize> {
        let row = |(&hu, &depth_mm): (&f64, &f64)| rows.iter().position(|row| row.holds(hu, depth_mm));
        self.hu.iter().zip(&self.depths_mm).map(|vertex| row(vertex).unwrap()).collect()
    }
}

/// Distance from a place to a triangle: the least over its plane, its edges and its corners, where
/// the place projects onto them.
fn distance(to: &Point3<f64>, corners: &[Point3<f64>]) -> f64 {
    let [a, b, c] = [corners[0], corners[1], corners[2]];
    let way = |t: f64, from: Point3<f64>, edge: Vector3<f64>| (from + edge * t.clamp(0.0, 1.0) - to).norm();
    let to_edge = |from: Point3<f64>, end: Point3<f64>| {
        way((to - from).dot(&(end - from)) / (end - from).norm_squared(), from, end - from)
    };
    let (u, v, w) = (b - a, c - a, to - a);
    let normal = u.cross(&v);
    // Barycentric coordinates of the projection.
    let s = w.cross(&v).dot(&normal) / normal.norm_squared();
    let t = u.cross(&w).dot(&normal) / normal.norm_squared();
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return w.dot(&normal).abs() / normal.norm();
    }
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

fn counts(rows: &[usize]) -> Vec<usize> {
    (0..LAYERS.len()).map(|n| rows.iter().filter(|row| **row == n).count()).collect()
}

fn plan(rows: &[Row]) -> Plan {
    cutis::check(&small(rows, &[UNCUT]), &cutis::Silent).unwrap()
}

#[test]
fn each_vertex_has_the_first_row_that_holds_it() {
    let vertices = Vertices::of_phantom();
    // No vertex is so near a bound that rounding decides.
    let bounds: Vec<f64> = LAYERS.iter().filter_map(|row| row.depth_mm).flatten().collect();
    let near = |depth: &f64| bounds.iter().any(|bound| (depth - bound).abs() < 0.01 && *depth > 0.0);
    assert!(!vertices.depths_mm.iter().any(near));

    let of_table = plan(&LAYERS).materials;
    let found: Vec<usize> = of_table.iter().map(|row| row.vertices).collect();
    let expected = counts(&vertices.rows(&LAYERS));
    assert_eq!(found, expected);
    assert!(expected.iter().all(|&count| count > 50), "{expected:?}");
    assert_eq!(found.iter().sum::<usize>(), vertices.hu.len());

    // Controls: another depth, another HU, and another order of the rows hold other vertices.
    let mut deeper = LAYERS;
    deeper[3].depth_mm = Some([5.0, 40.0]);
    let mut denser = LAYERS;
    denser[1].hu = Some([200.0, 4000.0]);
    let mut reversed = LAYERS;
    reversed.swap(0, 2);
    for control in [deeper, denser, reversed] {
        assert_ne!(counts(&vertices.rows(&control)), expected);
    }
}

/// Springs have four times the harmonic mean of their ends' moduli. Volumes have the harmonic mean
/// of their corners' moduli.
#[test]
fn elements_have_the_harmonic_mean_of_their_vertices() {
    let loaded = small(&LAYERS, &[UNCUT]);
    let system = cutis::build_system(&loaded).unwrap().system;
    let (rows, found) = (Vertices::of_phantom().rows(&LAYERS), moduli(&loaded));
    type Mean<'a> = &'a dyn Fn(&[f64]) -> f64;
    let largest_errors = |mean: Mean<'_>| {
        [0, 1].map(|kind| {
            let modulus = |v: &u32| match (kind, &LAYERS[rows[*v as usize]]) {
                (0, row) => 4.0 * row.youngs_modulus_pa,
                (_, row) => row.bulk_modulus_pa,
            };
            let error = |tuple: &[u32]| {
                let expected = mean(&tuple.iter().map(modulus).collect::<Vec<_>>());
                (found[kind][&place(&system, tuple)] / expected - 1.0).abs()
            };
            let set = &system.kinds()[kind];
            set.indices().chunks_exact(set.arity()).map(error).fold(0.0, f64::max)
        })
    };
    let harmonic = |moduli: &[f64]| moduli.len() as f64 / moduli.iter().map(|m| 1.0 / m).sum::<f64>();
    let errors = largest_errors(&harmonic);
    assert!(errors.iter().all(|error| *error < 1e-6), "{errors:?}");
    // Controls: other means. They differ where materials meet.
    let arithmetic = |moduli: &[f64]| moduli.iter().sum::<f64>() / moduli.len() as f64;
    let softest = |moduli: &[f64]| moduli.iter().copied().fold(f64::INFINITY, f64::min);
    for control in [&arithmetic as Mean<'_>, &softest] {
        let errors = largest_errors(control);
        assert!(errors.iter().all(|error| *error > 0.5), "{errors:?}");
    }
}

/// A table of one row gives the bits of one modulus for all elements.
#[test]
fn one_row_is_the_same_as_one_modulus() {
    let one = |youngs_modulus_pa: f64| {
        [Row { hu: None, depth_mm: None, youngs_modulus_pa, bulk_modulus_pa: 5e4, ..LAYERS[0] }]
    };
    let run = |loaded: &LoadedScene| Run::of(loaded).state();
    let set = [("run.frames", "3"), ("run.checkpoint_every", "3"), ("output", "{}")];
    let springs = ("constraints.distance.youngs_modulus_pa", "5000.0");
    let uniform = run(&scene(SMALL, &[&set[..], &[springs]].concat()));
    assert!(run(&small(&one(1250.0), &set)) == uniform);
    assert!(run(&small(&one(1251.0), &set)) != uniform, "the control");
}

/// The skin is found and depths are computed only for a table that names a depth.
#[test]
fn a_table_without_depth_needs_no_skin() {
    let bare = [UNCUT, ("output", "{}"), ("constraints.stc", "{ area_modulus_n_per_m = 5.0 }")];
    let left_out = |rows: &[Row], topic: &str| {
        let mut loaded = small(rows, &bare);
        loaded.scene.constraints.stc = None;
        let plan = cutis::check(&loaded, &cutis::Silent).unwrap();
        plan.left_out.iter().any(|line| line.starts_with(&format!("{topic}:")))
    };
    let by_hu = [LAYERS[1], LAYERS[2], LAYERS[4]];
    assert!(left_out(&by_hu, "skin") && left_out(&by_hu, "depth") && !left_out(&by_hu, "materials"));
    assert!(!left_out(&LAYERS, "skin") && !left_out(&LAYERS, "depth"));
    let without = cutis::check(&scene(SMALL, &[]), &cutis::Silent).unwrap();
    assert!(without.left_out.iter().any(|line| line.starts_with("materials:")));
    assert!(without.materials.is_empty());
}
