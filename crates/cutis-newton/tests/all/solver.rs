//! Agreement with a solver that shares no code with this crate: the scalar reference of XPBD, run
//! to convergence.
//!
//! XPBD takes its gradients during a step and not at its end. Its limit differs from the minimizer
//! by an error of the order of h². Halving h must divide the error by four.

use cutis_newton::{Options, Problem, relative_rms};
use cutis_solver::{Formulation, Settings, Solver, SolverReference};
use nalgebra::{Point3, Vector3};

use crate::SCALES;
use crate::blocks::{shaken, skinned};

const SIZE: [usize; 3] = [4, 3, 4];

fn settings(dt_s: f64, substeps: u32, iterations: u32, scale: f64) -> Settings {
    let gravity_m_s2 = [0.0, 0.0, -0.02 * scale];
    Settings {
        formulation: Formulation::Xpbd,
        dt_s,
        substeps,
        iterations,
        gravity_m_s2,
        ..Settings::default()
    }
}

/// The error E1 of one step of `h` seconds from a shaken block.
fn step_error(h: f64, scale: f64) -> f64 {
    let problem = Problem::of(&skinned(SIZE, scale), [0.0, 0.0, -0.02 * scale]).unwrap();
    let start = shaken(problem.positions(), 0.05 * scale, |v| problem.masses()[v].is_infinite());
    let rest = vec![Vector3::zeros(); start.len()];
    let mut solver = SolverReference::new(skinned(SIZE, scale), settings(h, 1, 2000, scale)).unwrap();
    solver.restore(&start, &rest, 0).unwrap();
    solver.step(1).unwrap();
    let minimum = problem.step(&start, &problem.predicted(&start, &rest, h), h, &Options::default()).unwrap();
    relative_rms(&solver.positions().unwrap(), &minimum.positions, &start)
}

#[test]
fn shorter_steps_agree_better() {
    for scale in SCALES {
        let errors = [0.05, 0.025, 0.0125].map(|h| step_error(h, scale));
        assert!(errors[1] < 0.3 * errors[0] && errors[2] < 0.3 * errors[1], "{errors:?}");
        assert!(errors[2] < 1e-4, "{errors:?}");
    }
}

/// The error E1 of the state of rest of the damped block.
fn rest_error(substeps: u32, gravity: f64) -> f64 {
    let mut solver = SolverReference::new(
        skinned(SIZE, 1.0),
        Settings { damping_per_s: 0.3, ..settings(200.0, substeps, 10, 1.0) },
    )
    .unwrap();
    solver.step(1).unwrap();
    let found: Vec<Point3<f64>> = solver.positions().unwrap();
    let problem = Problem::of(&skinned(SIZE, 1.0), [0.0, 0.0, -0.02 * gravity]).unwrap();
    let minimum = problem.equilibrium(problem.positions(), &Options::default()).unwrap();
    relative_rms(&found, &minimum.positions, problem.positions())
}

#[test]
fn shorter_steps_rest_nearer_to_the_equilibrium() {
    let errors = [1000, 2000, 4000].map(|substeps| rest_error(substeps, 1.0));
    assert!(errors[1] < 0.3 * errors[0] && errors[2] < 0.3 * errors[1], "{errors:?}");
    assert!(errors[2] < 3e-4, "{errors:?}");
}

#[test]
fn control_a_different_gravity_is_noticed() {
    assert!(rest_error(4000, 1.01) > 1e-3);
}
