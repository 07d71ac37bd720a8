//! Position of the tip of a clamped beam after 21 frames, compared with independent programs.
//!
//! Vertices 0.1 m apart, the face x = 0 fixed, unit masses, PBD with stiffness 1 on every edge,
//! then on every tetrahedron. Three independent programs give the last vertex the same height to
//! five digits. Their edges of one direction alternate between two colors along the first axis of
//! the direction, and their tetrahedra of one type have four colors along each axis. A fourth
//! program, in another order of the constraints, differs by less than 2 mm.

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{Distance, Scalar, Volume};
use cutis_solver::{Formulation, Settings, Stiffness, SystemBuilder};
use cutis_test_kit::Kuhn;

use super::{Start, in_double, in_single, reference};

/// Size in vertices, and height of the tip.
const REFERENCE: [([usize; 3], f64); 2] = [([20, 5, 5], 0.33157), ([40, 10, 10], 0.84273)];

fn tip<T: Scalar>(start: &Start<T>, size: [usize; 3], edges: &Groups, tets: &Groups, iterations: u32) -> f64 {
    let lattice = Kuhn::new(size, 0.1);
    let masses: Vec<f64> = lattice.positions.iter().map(|p| if p.x == 0.0 { 0.0 } else { 1.0 }).collect();
    let rigid = || Stiffness::pbd(T::one());
    let system = SystemBuilder::<T>::new(&lattice.positions, &masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(&lattice.edges, &Default::default(), rigid(), edges)
        .unwrap()
        .add_from_rest::<Volume, 4>(&lattice.tets, &Default::default(), rigid(), tets)
        .unwrap()
        .build();
    let settings = Settings {
        formulation: Formulation::Pbd,
        dt_s: 0.005,
        substeps: 1,
        iterations,
        gravity_m_s2: [0.0, -9.81, 0.0],
        damping_per_s: 0.0,
        relaxation: 1.0,
    };
    let mut solver = start(system, settings);
    solver.step(21).unwrap();
    solver.positions().unwrap().last().unwrap().y.to_f64()
}

/// The colors of the edges in the independent programs.
fn edge_colors(lattice: &Kuhn, [nx, ny, _]: [usize; 3]) -> Vec<u16> {
    let place = |n: u32| [n as usize % nx, n as usize / nx % ny, n as usize / nx / ny];
    let color = |([from, to], color): (&[u32; 2], &u16)| {
        let [from, to] = [from, to].map(|n| place(*n));
        let first = (0..3).find(|&axis| from[axis] != to[axis]).unwrap();
        color / 2 * 2 + (from[first] % 2) as u16
    };
    lattice.edges.iter().zip(&lattice.edge_colors).map(color).collect()
}

/// The colors of the tetrahedra in the independent programs: the type, and the sum of the indices
/// of the first vertex.
fn tet_colors(lattice: &Kuhn, [nx, ny, _]: [usize; 3]) -> Vec<u16> {
    let sum = |n: u32| n as usize % nx + n as usize / nx % ny + n as usize / nx / ny;
    let color = |(tet, color): (&[u32; 4], &u16)| color / 4 * 4 + (sum(tet[0]) % 4) as u16;
    lattice.tets.iter().zip(&lattice.tet_colors).map(color).collect()
}

fn in_reference_order<T: Scalar>(start: &Start<T>, size: [usize; 3], iterations: u32) -> f64 {
    let lattice = Kuhn::new(size, 0.1);
    let edges = Groups::from_colors(&edge_colors(&lattice, size)).unwrap();
    let tets = Groups::from_colors(&tet_colors(&lattice, size)).unwrap();
    tip(start, size, &edges, &tets, iterations)
}

fn in_another_order<T: Scalar>(start: &Start<T>, size: [usize; 3]) -> f64 {
    let lattice = Kuhn::new(size, 0.1);
    let count = lattice.positions.len();
    let edges = greedy(&lattice.edges, count).unwrap();
    let tets = greedy(&lattice.tets, count).unwrap();
    tip(start, size, &edges, &tets, 5)
}

/// Half a unit of the fifth digit.
fn to_five_digits(found: f64, expected: f64) -> Result<(), String> {
    near(found, expected, 0.5e-5)
}

fn near(found: f64, expected: f64, tolerance: f64) -> Result<(), String> {
    if (found - expected).abs() <= tolerance { Ok(()) } else { Err(format!("{found} instead of {expected}")) }
}

#[test]
fn the_order_of_the_references_agrees_to_five_digits() {
    for (size, height) in REFERENCE {
        in_double(|start| to_five_digits(in_reference_order(start, size, 5), height));
        in_single(|start| to_five_digits(in_reference_order(start, size, 5), height));
    }
}

#[test]
fn any_other_order_agrees_to_two_millimeters() {
    for (size, height) in REFERENCE {
        in_double(|start| near(in_another_order(start, size), height, 2e-3));
        in_single(|start| near(in_another_order(start, size), height, 2e-3));
    }
}

#[test]
fn control_another_number_of_iterations_is_refused() {
    let (size, height) = REFERENCE[0];
    to_five_digits(in_reference_order(&reference::<f64>, size, 4), height).unwrap_err();
    to_five_digits(in_reference_order(&reference::<f64>, size, 6), height).unwrap_err();
}
