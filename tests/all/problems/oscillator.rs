//! P1: a mass on one compliant distance constraint swings with the period `2π√(mα)`, whatever the substeps.

use std::f64::consts::PI;

use cutis_coloring::greedy;
use cutis_constraints::{Distance, Scalar};
use cutis_solver::{Formulation, Settings, Solver, SolverReference, Stiffness, SystemBuilder};
use nalgebra::Point3;

use super::{SCALES, within};

const MASS: f64 = 0.3;
const COMPLIANCE: f64 = 0.02;

fn expected() -> f64 {
    2.0 * PI * (MASS * COMPLIANCE).sqrt()
}

/// Period measured between upward passes through the rest length, with `substeps` to the expected period.
fn period<T: Scalar>(compliance: f64, substeps: u32, scale: f64) -> f64 {
    let positions = [Point3::origin(), Point3::new(1.1 * scale, 0.0, 0.0)];
    let groups = greedy(&[[0, 1]], 2).unwrap();
    let system = SystemBuilder::<T>::new(&positions, &[0.0, 1.0 / MASS])
        .unwrap()
        .add::<Distance, 2>(
            &[[0, 1]],
            &[[T::constant(scale)]],
            Stiffness::compliance(T::constant(compliance)),
            &groups,
        )
        .unwrap()
        .build();
    let dt_s = expected() / f64::from(substeps);
    let settings = Settings { formulation: Formulation::Xpbd, dt_s, substeps: 1, ..Settings::default() };
    let mut solver = SolverReference::new(system, settings).unwrap();
    let stretch = |solver: &mut SolverReference<T>| solver.positions().unwrap()[1].x.to_f64() / scale - 1.0;
    let mut passes = Vec::new();
    while passes.len() < 3 {
        assert!(solver.time_s() < 10.0 * expected(), "no swing");
        let before = stretch(&mut solver);
        solver.step(1).unwrap();
        let after = stretch(&mut solver);
        if before < 0.0 && after >= 0.0 {
            passes.push(solver.time_s() - dt_s * after / (after - before));
        }
    }
    (passes[2] - passes[0]) / 2.0
}

#[test]
fn period_does_not_depend_on_substeps_or_scale() {
    for scale in SCALES {
        within(period::<f64>(COMPLIANCE, 400, scale), expected(), 1e-3).unwrap();
        within(period::<f64>(COMPLIANCE, 4000, scale), expected(), 1e-5).unwrap();
        within(period::<f32>(COMPLIANCE, 400, scale), expected(), 1e-3).unwrap();
    }
}

#[test]
fn error_of_the_period_falls_with_the_substep() {
    let error = |substeps| (period::<f64>(COMPLIANCE, substeps, 1.0) / expected() - 1.0).abs();
    assert!(error(100) < 0.3 * error(50), "{} {}", error(50), error(100));
}

#[test]
fn control_another_compliance_is_refused() {
    within(period::<f64>(COMPLIANCE * 1.01, 400, 1.0), expected(), 1e-3).unwrap_err();
}
