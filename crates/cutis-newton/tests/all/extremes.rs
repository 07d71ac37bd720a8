//! Random stiffnesses (over eight orders of magnitude), masses, steps and starts: a minimum is
//! found to the tolerance, or to the rounding of positions.

use cutis_coloring::greedy;
use cutis_constraints::{SkinTension, SkinTensionMaterial};
use cutis_newton::{Options, Problem};
use cutis_solver::Stiffness;
use cutis_test_kit::Kuhn;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use crate::blocks::{noise, shaken, solid};

/// A block with the given compliances, in units that fit the scale, and masses.
fn problem(scale: f64, [springs, solids, skin]: [f64; 3], mass: f64) -> Problem {
    let lattice = Kuhn::new([4, 3, 3], scale);
    let count = lattice.positions.len();
    let faces: Vec<[u32; 3]> = lattice.tets.iter().map(|&[a, b, c, _]| [a, b, c]).step_by(5).collect();
    let masses: Vec<f64> =
        lattice.positions.iter().map(|p| if p.x == 0.0 { 0.0 } else { 1.0 / mass }).collect();
    let tension = SkinTensionMaterial { rest_area_scale: 0.8, amplification: 10.0 };
    let system = solid(&lattice, &lattice.positions, &masses, [springs, solids * scale.powi(4)])
        .add_from_rest::<SkinTension, 3>(
            &faces,
            &tension,
            Stiffness::compliance(skin * scale.powi(2)),
            &greedy(&faces, count).unwrap(),
        )
        .unwrap()
        .build();
    Problem::of(&system, [0.0, 0.0, -scale]).unwrap()
}

/// The gradient at the end of a step, computed from the forces.
fn gradient(problem: &Problem, x: &[Point3<f64>], predicted: &[Point3<f64>], h: f64) -> Vec<Vector3<f64>> {
    let forces = problem.forces(x);
    let inertia = |v: usize| (x[v] - predicted[v]) * (problem.masses()[v] / (h * h));
    let free = (0..x.len()).filter(|&v| problem.masses()[v].is_finite());
    free.map(|v| inertia(v) - forces[v]).collect()
}

/// Whether the gradient is less than ten times the change that the last bits of the positions
/// cause.
fn is_rounding(problem: &Problem, x: &[Point3<f64>], predicted: &[Point3<f64>], h: f64) -> bool {
    let norm = |vectors: &[Vector3<f64>]| vectors.iter().map(Vector3::norm_squared).sum::<f64>().sqrt();
    let nudged: Vec<_> =
        x.iter().enumerate().map(|(v, x)| x.map(|x| x * (1.0 + f64::EPSILON * noise(v)))).collect();
    let here = gradient(problem, x, predicted, h);
    let there = gradient(problem, &nudged, predicted, h);
    let change: Vec<_> = here.iter().zip(&there).map(|(a, b)| a - b).collect();
    norm(&here) <= 10.0 * norm(&change)
}

/// Powers of ten with a random exponent.
fn tens(range: std::ops::Range<f64>) -> impl Strategy<Value = f64> {
    range.prop_map(|exponent| 10f64.powf(exponent))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_step_is_found_for_any_stiffnesses(
        scale in tens(-3.0..3.0),
        springs in tens(-6.0..2.0),
        solids in tens(-6.0..2.0),
        skin in tens(-6.0..2.0),
        mass in tens(-3.0..3.0),
        h in tens(-4.0..0.0),
        shake in 0.0..1.0,
    ) {
        let problem = problem(scale, [springs, solids, skin], mass);
        let start = shaken(problem.positions(), shake * scale, |v| problem.masses()[v].is_infinite());
        let rest = vec![Vector3::zeros(); start.len()];
        let predicted = problem.predicted(&start, &rest, h);
        let found = problem.step(&start, &predicted, h, &Options { max_iterations: 1000, ..Options::default() });
        let found = found.map_err(|error| TestCaseError::fail(error.to_string()))?;
        let exact = found.gradient <= 1e-10 || is_rounding(&problem, &found.positions, &predicted, h);
        prop_assert!(exact, "{} after {}", found.gradient, found.iterations);
    }

    #[test]
    fn an_equilibrium_is_found_from_any_start(
        springs in tens(-3.0..1.0),
        solids in tens(-5.0..1.0),
        skin in tens(-3.0..1.0),
        shake in 0.0..1.0,
    ) {
        let problem = problem(1.0, [springs, solids, skin], 1e-3);
        let start = shaken(problem.positions(), shake, |v| problem.masses()[v].is_infinite());
        let found = problem.equilibrium(&start, &Options { max_iterations: 1000, ..Options::default() });
        let found = found.map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert!(found.gradient <= 1e-10, "{} after {}", found.gradient, found.iterations);
    }
}

/// Near a saddle the way down is found in a few steps and not in thousands.
#[test]
fn a_saddle_is_left_in_a_few_steps() {
    let problem = problem(1.0, [1.183, 1.168e-4, 0.1075], 1e-3);
    let start = shaken(problem.positions(), 0.781, |v| problem.masses()[v].is_infinite());
    let found = problem.equilibrium(&start, &Options::default()).unwrap();
    assert!(found.definite);
}
