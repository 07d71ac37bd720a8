//! P5: the opening of a slit in a stretched sheet agrees with an independent `f64` Newton solution
//! within 1 %.
//!
//! Damped dynamics with unit masses lead to equilibrium. The time step is half the time of a wave
//! from vertex to vertex, and the damping is critical for the slowest mode of the clamped sheet. A
//! few iterations solve the implicit step well enough that a resting sheet is in equilibrium.

use std::f64::consts::{PI, SQRT_2};

use cutis_coloring::greedy;
use cutis_constraints::{Distance, Scalar, SkinTension};
use cutis_solver::{Formulation, Settings, Stiffness, SystemBuilder};
use cutis_studies::sheet::Sheet;

use super::{SCALES, Start, cpu, in_double, in_single, positions, scaled, within};

#[derive(Clone, Copy)]
struct Case {
    /// Columns of the sheet.
    nx: i64,
    /// Half-length of the slit.
    a: f64,
    /// Prestrain.
    e: f64,
    /// Area stiffness.
    k_area: f64,
    /// Opening in the middle, from the Newton solution.
    opening: f64,
}

const SMALL: Case = Case { nx: 60, a: 6.0, e: 0.002, k_area: 0.0, opening: 0.06741 };
const MIDDLE: Case = Case { nx: 120, a: 12.0, opening: 0.13450, ..SMALL };
const LARGE: Case = Case { nx: 200, a: 10.0, opening: 0.11773, ..SMALL };

/// Opening in spacings after the sheet has come to rest.
fn gape<T: Scalar>(start: &Start<T>, case: &Case, scale: f64) -> f64 {
    let sheet = Sheet::new(case.nx).cut(case.a);
    let count = sheet.positions.len();
    let rest_length = scale / (1.0 + case.e);
    let rest_area = 3f64.sqrt() / 4.0 * rest_length * rest_length;
    let inverse_masses: Vec<f64> = sheet.held.iter().map(|&held| if held { 0.0 } else { 1.0 }).collect();
    let lengths = vec![[T::constant(rest_length)]; sheet.springs.len()];
    let groups = greedy(&sheet.springs, count).unwrap();
    let mut system = SystemBuilder::<T>::new(&scaled(&sheet.positions, scale), &inverse_masses)
        .unwrap()
        .add::<Distance, 2>(&sheet.springs, &lengths, Stiffness::compliance(T::one()), &groups)
        .unwrap();
    if case.k_area > 0.0 {
        let areas = vec![[T::constant(rest_area), T::zero()]; sheet.triangles.len()];
        let compliance = Stiffness::compliance(T::constant(scale * scale / case.k_area));
        let groups = greedy(&sheet.triangles, count).unwrap();
        system = system.add::<SkinTension, 3>(&sheet.triangles, &areas, compliance, &groups).unwrap();
    }
    // Slowest shear wave, √(μ·√3/2) for unit masses, across the sheet.
    let slowest = 0.61 * PI * SQRT_2 / case.nx as f64;
    let substeps = (14.0 / slowest).ceil() as u32;
    let settings = Settings {
        formulation: Formulation::Xpbd,
        dt_s: 0.5 * f64::from(substeps),
        substeps,
        iterations: 4,
        gravity_m_s2: [0.0; 3],
        damping_per_s: 2.0 * slowest,
        relaxation: 1.0,
    };
    let mut solver = start(system.build(), settings);
    solver.step(1).unwrap();
    sheet.opening(&positions(&mut *solver, scale))
}

fn check<T: Scalar>(start: &Start<T>, case: &Case, scale: f64) -> Result<(), String> {
    within(gape(start, case, scale), case.opening, 0.01)
}

#[test]
fn small_sheet_at_every_scale_in_both_precisions() {
    for scale in SCALES {
        in_double(|start| check(start, &SMALL, scale));
        in_single(|start| check(start, &SMALL, scale));
    }
}

#[test]
fn middle_sheet() {
    check(&cpu::<f64>, &MIDDLE, 1.0).unwrap();
}

#[test]
fn large_sheet() {
    check(&cpu::<f64>, &LARGE, 1.0).unwrap();
}

#[test]
fn skin_tension_opens_the_slit_further() {
    check(&cpu::<f64>, &Case { k_area: 1.0, opening: 0.17734, ..MIDDLE }, 1.0).unwrap();
    check(&cpu::<f64>, &Case { k_area: 5.0, opening: 0.33497, ..MIDDLE }, 1.0).unwrap();
}

#[test]
fn control_wrong_prestrain_or_area_stiffness_is_refused() {
    check(&cpu::<f64>, &Case { e: 0.002 * 1.03, ..SMALL }, 1.0).unwrap_err();
    check(&cpu::<f64>, &Case { k_area: 0.05, ..SMALL }, 1.0).unwrap_err();
    check(&cpu::<f64>, &Case { a: 7.0, ..SMALL }, 1.0).unwrap_err();
}
