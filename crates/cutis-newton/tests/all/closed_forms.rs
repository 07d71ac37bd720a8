//! Equilibria with a known closed form, at three scales.

use cutis_coloring::greedy;
use cutis_constraints::Distance;
use cutis_newton::{Options, Problem};
use cutis_solver::{Stiffness, System, SystemBuilder};
use cutis_test_kit::Kuhn;
use nalgebra::{Matrix3, Point3};

use crate::blocks::solid;
use crate::{SCALES, near};

const GRAVITY: f64 = 9.81;

/// Vertices on a line, joined by springs with the given rest length and compliance.
pub fn chain(positions: &[Point3<f64>], inverse_masses: &[f64], length: f64, compliance: f64) -> System<f64> {
    let springs: Vec<[u32; 2]> = (1..positions.len() as u32).map(|v| [v - 1, v]).collect();
    SystemBuilder::new(positions, inverse_masses)
        .unwrap()
        .add::<Distance, 2>(
            &springs,
            &vec![[length]; springs.len()],
            Stiffness::compliance(compliance),
            &greedy(&springs, positions.len()).unwrap(),
        )
        .unwrap()
        .build()
}

/// A mass below a fixed point hangs lower by `m g/k`. The expected value uses a stiffness of
/// `assumed` times `k`.
fn hanging_mass(scale: f64, assumed: f64) -> Result<(), String> {
    let (mass, stiffness) = (0.7, 300.0 / scale);
    let positions = [Point3::origin(), Point3::new(0.0, 0.0, -scale)];
    let system = chain(&positions, &[0.0, 1.0 / mass], scale, 1.0 / stiffness);
    let problem = Problem::of(&system, [0.0, 0.0, -GRAVITY]).unwrap();
    let rest = problem.equilibrium(problem.positions(), &Options::default()).unwrap();
    assert!(rest.definite);
    let lower = mass * GRAVITY / (stiffness * assumed);
    near("height", rest.positions[1].z, -scale - lower, scale, 1e-13)?;
    near(
        "force on the fixed point",
        problem.forces(&rest.positions)[0].z,
        -mass * GRAVITY,
        mass * GRAVITY,
        1e-11,
    )?;
    let energy = 0.5 * stiffness * lower * lower - mass * GRAVITY * (scale + lower);
    near("energy", rest.energy_j, energy, energy.abs(), 1e-13)
}

#[test]
fn a_mass_on_a_spring_sinks_by_weight_over_stiffness() {
    for scale in SCALES {
        hanging_mass(scale, 1.0).unwrap();
    }
    hanging_mass(1.0, 1.0 + 1e-9).unwrap_err();
}

#[test]
fn each_link_of_a_hanging_chain_carries_the_weight_below() {
    let (links, stiffness) = (20, 1e3);
    for scale in SCALES {
        let positions: Vec<_> = (0..=links).map(|n| Point3::new(0.0, 0.0, -scale * n as f64)).collect();
        let masses: Vec<f64> = (0..=links).map(|n| if n == 0 { 0.0 } else { 2.0 }).collect();
        let system = chain(&positions, &masses, scale, scale / stiffness);
        let problem = Problem::of(&system, [0.0, 0.0, -GRAVITY]).unwrap();
        let rest = problem.equilibrium(&positions, &Options::default()).unwrap();
        let mut height = 0.0;
        for n in 1..=links {
            let below = 0.5 * (links + 1 - n) as f64 * GRAVITY;
            height -= scale * (1.0 + below / stiffness);
            near("height", rest.positions[n].z, height, scale, 1e-11).unwrap();
        }
    }
}

/// A chain between two points at one height, started straight, where nothing holds it sideways. In
/// equilibrium the horizontal force is the same in each link, and the vertical force changes by the
/// weight of each vertex.
#[test]
fn a_chain_between_two_points_becomes_a_catenary() {
    let (links, stiffness, weight) = (16, 2e3, GRAVITY);
    for scale in SCALES {
        let positions: Vec<_> = (0..=links).map(|n| Point3::new(scale * n as f64, 0.0, 0.0)).collect();
        let masses: Vec<f64> = (0..=links).map(|n| if n == 0 || n == links { 0.0 } else { 1.0 }).collect();
        let system = chain(&positions, &masses, 1.05 * scale, scale / stiffness);
        let problem = Problem::of(&system, [0.0, 0.0, -GRAVITY]).unwrap();
        let rest = problem.equilibrium(&positions, &Options::default()).unwrap();
        assert!(rest.definite, "hangs");
        let pull = |n: usize| {
            let link = rest.positions[n + 1] - rest.positions[n];
            link * (stiffness / scale * (link.norm() - 1.05 * scale) / link.norm())
        };
        for n in 1..links {
            near("horizontal pull", pull(n).x, pull(0).x, weight, 1e-8).unwrap();
            near("vertical pull", pull(n).z - pull(n - 1).z, weight, weight, 1e-8).unwrap();
        }
        assert!(rest.positions[links / 2].z < -scale, "it sags");
    }
}

/// The patch test: largest deviation of the interior from the affine map `map` when the border
/// moves by `hold`, relative to the size of the block.
fn patch_deviation(scale: f64, map: Matrix3<f64>, hold: Matrix3<f64>) -> f64 {
    let n = 6;
    let lattice = Kuhn::new([n; 3], scale);
    let border = |p: &Point3<f64>| p.iter().any(|&x| x == 0.0 || x == (n - 1) as f64 * scale);
    let masses: Vec<f64> = lattice.positions.iter().map(|p| if border(p) { 0.0 } else { 1.0 }).collect();
    let system = solid(&lattice, &lattice.positions, &masses, [1.0, scale.powi(4)]).build();
    let problem = Problem::of(&system, [0.0; 3]).unwrap();
    let start: Vec<_> = lattice.positions.iter().map(|p| if border(p) { hold * p } else { *p }).collect();
    let rest = problem.equilibrium(&start, &Options::default()).unwrap();
    let deviations = lattice.positions.iter().zip(&rest.positions).map(|(p, x)| (x - map * p).norm());
    deviations.fold(0.0, f64::max) / (scale * n as f64)
}

#[test]
fn the_interior_follows_an_affine_map_of_the_border() {
    let map = Matrix3::new(1.05, 0.04, 0.0, -0.02, 0.98, 0.03, 0.01, 0.0, 1.02);
    for scale in SCALES {
        near("deviation", patch_deviation(scale, map, map), 0.0, 1.0, 1e-10).unwrap();
    }
    let wrong = map + Matrix3::from_diagonal_element(1e-8);
    near("deviation", patch_deviation(1.0, wrong, map), 0.0, 1.0, 1e-10).unwrap_err();
}
