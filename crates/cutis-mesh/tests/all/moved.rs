//! Tests of lattices with points off their planes.

use cutis_mesh::{Lattice, MeshError, Shell, SkinMode, SkinOptions, Split, Tissue, TissueMask, skin};
use cutis_test_kit::Random;
use nalgebra::{Point3, Vector3};

use crate::oracle::{air, all_tets, lattice, plan};

/// Six times the volumes of all tets of a lattice in mm³.
fn volumes(lattice: &Lattice) -> Vec<f64> {
    let volume = |tet: [usize; 4]| {
        let [a, b, c, d] = tet.map(|point| lattice.mm(lattice.grid().point(point)));
        (b - a).dot(&(c - a).cross(&(d - a)))
    };
    all_tets(lattice).into_iter().map(volume).collect()
}

/// Moves of all points by up to a length in mm.
fn random_moves(lattice: &Lattice, most_mm: f64, seed: u64) -> (Vec<u32>, Vec<Vector3<f64>>) {
    let mut random = Random::new(seed);
    (0..lattice.grid().len() as u32).map(|point| (point, random.vector() * most_mm)).unzip()
}

#[test]
fn every_tet_keeps_a_fifth_of_its_volume() {
    for (split, step, seed) in [(Split::Kuhn6, [2.0, -2.0, 3.0], 1), (Split::Five, [2.0; 3], 2)] {
        let even = lattice([7, 6, 5], step, split);
        let rest = volumes(&even);
        let (points, mm) = random_moves(&even, 1.5, seed);
        // Control: the moves as they are.
        let places: Vec<Point3<f64>> =
            (0..points.len()).map(|point| even.mm(even.grid().point(point)) + mm[point]).collect();
        let folds = |tet: &[usize; 4]| {
            let [a, b, c, d] = tet.map(|point| places[point]);
            (b - a).dot(&(c - a).cross(&(d - a))) < 0.0
        };
        assert!(all_tets(&even).iter().any(folds), "{split:?}: nothing folds");

        let moved = even.with_moves(points.clone(), mm.clone()).unwrap();
        for (now, rest) in volumes(&moved).iter().zip(&rest) {
            assert!(*now >= 0.2 * rest * (1.0 - 1e-12), "{split:?}: {now} of {rest}");
        }
        let mut whole = 0;
        for (point, mm) in mm.iter().enumerate() {
            let at = even.grid().point(point);
            let made = moved.mm(at) - even.mm(at);
            assert!(made.norm() <= mm.norm() + 1e-9 && made.dot(mm) >= 0.0, "{split:?}: {made} for {mm}");
            whole += usize::from((made - mm).norm() < 1e-9);
        }
        // Moves change only where tets are tight.
        assert!(whole > 10, "{split:?}: {whole}");
    }
}

#[test]
fn small_moves_are_exact_and_new_moves_replace_old_ones() {
    let even = lattice([4, 4, 4], [2.0; 3], Split::Kuhn6);
    let moved = even.with_moves(vec![21, 42], vec![Vector3::x() * 0.25, Vector3::y() * -0.5]).unwrap();
    for point in 0..even.grid().len() {
        let expected = match point {
            21 => Vector3::x() * 0.25,
            42 => Vector3::y() * -0.5,
            _ => Vector3::zeros(),
        };
        let at = even.grid().point(point);
        assert_eq!(moved.mm(at) - even.mm(at), expected);
    }
    assert_ne!(moved, even);
    let again = moved.with_moves(vec![3], vec![Vector3::zeros()]).unwrap();
    assert_eq!(again.mm([1, 1, 1]), even.mm([1, 1, 1]));
}

#[test]
fn wrong_moves_are_refused() {
    let lattice = lattice([3, 3, 3], [2.0; 3], Split::Kuhn6);
    let x = Vector3::x();
    assert!(matches!(
        lattice.with_moves(vec![1, 2], vec![x]),
        Err(MeshError::Length { array: "mm", expected: 2, found: 1 })
    ));
    for (points, mm, wrong) in [
        (vec![1, 27], vec![x, x], 1),
        (vec![2, 1], vec![x, x], 1),
        (vec![1, 1], vec![x, x], 1),
        (vec![1, 2], vec![x * f64::NAN, x], 0),
        (vec![1], vec![x * f64::INFINITY], 0),
    ] {
        let error = lattice.with_moves(points.clone(), mm).unwrap_err();
        assert!(
            matches!(error, MeshError::Move { position, .. } if position == wrong),
            "{points:?}: {error}"
        );
    }
}

/// Mesh, inactive skin and shell are at the moved places.
#[test]
fn everything_built_from_a_moved_lattice_is_at_the_moved_places() {
    let even = lattice([13, 13, 13], [2.0; 3], Split::Kuhn6);
    let middle = even.mm([6, 6, 6]);
    let air = air(&even, |p| (Point3::from(p) - middle).norm() <= 8.5);
    let (points, mm) = random_moves(&even, 0.6, 3);
    let tissue = Tissue { air: &air, cut_away: &[], largest_component: true };
    let found = skin::detect(&even, &air, SkinMode::Exterior, &SkinOptions::default()).unwrap();
    let body = TissueMask::find(&even, &tissue).unwrap().with_moves(points, mm).unwrap();
    let moved = body.lattice().clone();
    let inside: Vec<bool> = (0..air.len()).map(|point| even.grid().point(point)[0] < 6).collect();
    let mesh = body.mesh_within(&vec![40.0; air.len()], &inside).unwrap();
    let at = |point: u32| mesh.frame.to_local(moved.mm(moved.grid().point(point as usize)));
    for (position, &point) in mesh.positions.iter().zip(&mesh.lattice_index) {
        assert_eq!(*position, at(point));
    }
    let (skin, inactive) = mesh.divide_skin(&body.skin(&found).0);
    assert!(!inactive.positions.is_empty());
    for (position, &point) in inactive.positions.iter().zip(&inactive.lattice_index) {
        assert_eq!(*position, at(point));
    }
    let shell = Shell::new(&mesh, &air, &plan(&mesh, &skin, &[]).unwrap(), None).unwrap();
    let place = |v: u32| match v.checked_sub(shell.first_extra) {
        Some(extra) => shell.positions[extra as usize],
        None => mesh.positions[v as usize],
    };
    assert!(!shell.tets.is_empty());
    for tet in &shell.tets {
        let [a, b, c, d] = tet.map(place);
        assert!((b - a).dot(&(c - a).cross(&(d - a))) > 0.0, "{tet:?}");
    }
}
