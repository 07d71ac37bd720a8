//! Implicit steps agree with a closed form, and the objective has no slope at their end.

use cutis_newton::{NewtonError, Options, Problem, relative_rms};
use nalgebra::{Point3, Vector3};

use crate::blocks::{noise, shaken, skinned};
use crate::closed_forms::chain;
use crate::{SCALES, near};

#[test]
fn a_step_along_a_spring_is_the_mean_of_inertia_and_stiffness() {
    for scale in SCALES {
        let (mass, stiffness, h) = (2.0, 50.0, 0.05);
        let x = [Point3::origin(), Point3::new(1.3 * scale, 0.0, 0.0)];
        let v = [Vector3::zeros(), Vector3::new(0.4 * scale, 0.0, 0.0)];
        let system = chain(&x, &[0.0, 1.0 / mass], scale, 1.0 / stiffness);
        let problem = Problem::of(&system, [-0.7 * scale, 0.0, 0.0]).unwrap();
        let predicted = problem.predicted(&x, &v, h);
        near("predicted", predicted[1].x, (1.3 + 0.4 * h - 0.7 * h * h) * scale, scale, 1e-15).unwrap();
        let found = problem.step(&x, &predicted, h, &Options::default()).unwrap();
        let inertia = mass / (h * h);
        let expected = (inertia * predicted[1].x + stiffness * scale) / (inertia + stiffness);
        near("position", found.positions[1].x, expected, scale, 1e-13).unwrap();
        assert_eq!(found.positions[0], x[0]);
    }
}

#[test]
fn a_vertex_without_constraints_follows_its_inertia() {
    let x = [Point3::new(1.0, 2.0, 3.0), Point3::new(-1.0, 0.5, 0.0)];
    let system = cutis_solver::SystemBuilder::<f64>::new(&x, &[1.0, 0.5]).unwrap().build();
    let problem = Problem::of(&system, [0.0, -9.81, 0.0]).unwrap();
    let predicted = problem.predicted(&x, &[Vector3::x(), Vector3::y()], 0.1);
    let found = problem.step(&x, &predicted, 0.1, &Options::default()).unwrap();
    assert!(relative_rms(&found.positions, &predicted, &x) < 1e-14);
}

/// Largest slope of the objective at the end of a step of the shaken block with skin, along any
/// coordinate, relative to the forces. `off` displaces the end, for the negative control.
fn worst_slope(scale: f64, h: f64, off: f64) -> f64 {
    let problem = Problem::of(&skinned([4, 3, 4], scale), [0.0, 0.0, -scale]).unwrap();
    let free = |v: usize| problem.masses()[v].is_finite();
    let x = shaken(problem.positions(), 0.15 * scale, |v| !free(v));
    let v: Vec<_> =
        (0..x.len()).map(|n| Vector3::from_fn(|axis, _| 0.3 * scale * noise(90 + 3 * n + axis))).collect();
    let predicted = problem.predicted(&x, &v, h);
    let found = problem.step(&x, &predicted, h, &Options::default()).unwrap();
    assert!(found.definite && found.gradient <= 1e-10, "{} {}", found.gradient, found.iterations);
    // The elastic energy alone comes from a problem without gravity.
    let elastic = Problem::of(&skinned([4, 3, 4], scale), [0.0; 3]).unwrap();
    let objective = |x: &[Point3<f64>]| {
        let inertia = |v: usize| 0.5 * problem.masses()[v] / (h * h) * (x[v] - predicted[v]).norm_squared();
        elastic.energy(x) + (0..x.len()).filter(|&v| free(v)).map(inertia).sum::<f64>()
    };
    let mut end = found.positions;
    for (n, x) in end.iter_mut().enumerate().filter(|&(n, _)| free(n)) {
        x.x += off * scale * noise(n);
    }
    let forces = elastic.forces(&end).iter().map(Vector3::norm).fold(0.0, f64::max);
    let step = 1e-4 * scale;
    let mut worst = 0.0_f64;
    for v in (0..end.len()).filter(|&v| free(v)) {
        for axis in 0..3 {
            let mut around = end.clone();
            around[v][axis] = end[v][axis] + step;
            let ahead = objective(&around);
            around[v][axis] = end[v][axis] - step;
            worst = worst.max(((ahead - objective(&around)) / (2.0 * step) / forces).abs());
        }
    }
    worst
}

#[test]
fn the_objective_has_no_slope_at_the_end_of_a_step() {
    for scale in SCALES {
        for h in [0.01, 0.3, 10.0] {
            let worst = worst_slope(scale, h, 0.0);
            assert!(worst < 1e-6, "{worst} at scale {scale}, h {h}");
        }
    }
}

#[test]
fn control_an_end_off_by_1e_4_has_a_slope() {
    assert!(worst_slope(1.0, 0.3, 1e-4) > 1e-5);
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() -> Result<(), NewtonError> {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let problem = Problem::of(&skinned([5, 6, 7], 1.0), [0.0, 0.0, -0.01])?;
            let start = shaken(problem.positions(), 0.3, |v| problem.masses()[v].is_infinite());
            problem.equilibrium(&start, &Options::default())
        })
    };
    let alone = run(1)?;
    assert_eq!(alone, run(2)?);
    assert_eq!(alone, run(7)?);
    Ok(())
}

#[test]
fn the_relative_error_is_relative_to_the_displacement() {
    let at = |x: f64| [Point3::origin(), Point3::new(x, 0.0, 0.0)];
    assert_eq!(relative_rms(&at(2.5), &at(3.0), &at(1.0)), 0.25);
    assert_eq!(relative_rms(&at(1.0), &at(1.0), &at(1.0)), 0.0);
    assert_eq!(relative_rms(&at(2.0), &at(1.0), &at(1.0)), f64::INFINITY);
}
