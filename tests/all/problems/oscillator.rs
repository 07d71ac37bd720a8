//! P1: a mass on one compliant distance constraint oscillates with the period `2π√(mα)` for any
//! number of substeps.

use std::f64::consts::PI;

use cutis_coloring::greedy;
use cutis_constraints::{Distance, Scalar};
use cutis_solver::{Formulation, Settings, Stiffness, SystemBuilder};
use nalgebra::Point3;

use super::{SCALES, Start, in_double, in_single, reference, within};

const MASS: f64 = 0.3;
const COMPLIANCE: f64 = 0.02;
/// Initial strain.
const STRAIN: f64 = 0.1;

fn expected() -> f64 {
    2.0 * PI * (MASS * COMPLIANCE).sqrt()
}

/// Period between upward passes through the rest length, with `substeps` substeps per expected
/// period.
fn period<T: Scalar>(start: &Start<T>, compliance: f64, substeps: u32, scale: f64) -> f64 {
    let positions = [Point3::origin(), Point3::new((1.0 + STRAIN) * scale, 0.0, 0.0)];
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
    let mut solver = start(system, settings);
    let (mut before, mut passes) = (STRAIN, Vec::new());
    while passes.len() < 3 {
        assert!(solver.time_s() < 10.0 * expected(), "no swing");
        solver.step(1).unwrap();
        let after = solver.positions_of(&[1]).unwrap()[0].x.to_f64() / scale - 1.0;
        if before < 0.0 && after >= 0.0 {
            passes.push(solver.time_s() - dt_s * after / (after - before));
        }
        before = after;
    }
    (passes[2] - passes[0]) / 2.0
}

#[test]
fn period_does_not_depend_on_substeps_or_scale() {
    for scale in SCALES {
        in_double(|start| within(period(start, COMPLIANCE, 400, scale), expected(), 1e-3));
        in_double(|start| within(period(start, COMPLIANCE, 4000, scale), expected(), 1e-5));
        in_single(|start| within(period(start, COMPLIANCE, 400, scale), expected(), 1e-3));
    }
}

#[test]
fn error_of_the_period_falls_with_the_substep() {
    let error = |substeps| (period(&reference::<f64>, COMPLIANCE, substeps, 1.0) / expected() - 1.0).abs();
    assert!(error(100) < 0.3 * error(50), "{} {}", error(50), error(100));
}

#[test]
fn control_another_compliance_is_refused() {
    within(period(&reference::<f64>, COMPLIANCE * 1.01, 400, 1.0), expected(), 1e-3).unwrap_err();
}
