//! P3: the tip of a bar of `N` springs with lumped masses sinks by `ρgL²/(2E)·(1 + 1/N)` under its
//! own weight.

use cutis_coloring::greedy;
use cutis_constraints::{Distance, Scalar};
use cutis_solver::{Formulation, Settings, Stiffness, SystemBuilder};
use nalgebra::Point3;

use super::{SCALES, Start, in_double, in_single, positions, reference, within};

const GRAVITY: f64 = 9.81;
/// Sag of the continuous bar over its length, `ρgL/(2E)`; small, so that springs stay linear.
const SAG: f64 = 0.02;

/// Sag of the tip over the length of the bar.
fn sag<T: Scalar>(start: &Start<T>, springs: usize, softness: f64, scale: f64) -> f64 {
    let count = springs + 1;
    let length = scale / springs as f64;
    let points: Vec<_> = (0..count).map(|i| Point3::new(0.0, -length * i as f64, 0.0)).collect();
    let masses: Vec<f64> = (0..count).map(|i| if i == 0 { 0.0 } else { 1.0 }).collect();
    let edges: Vec<[u32; 2]> = (1..count as u32).map(|i| [i - 1, i]).collect();
    // Unit masses, ρAL = N. Spring k = EA·N/L, and ρgL/(2E) = SAG gives EA = N·g/(2·SAG).
    let compliance = softness * 2.0 * SAG * scale / (GRAVITY * (springs * springs) as f64);
    let groups = greedy(&edges, count).unwrap();
    let system = SystemBuilder::<T>::new(&points, &masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &edges,
            &Default::default(),
            Stiffness::compliance(T::constant(compliance)),
            &groups,
        )
        .unwrap()
        .build();
    let wave = compliance.sqrt();
    let slowest = std::f64::consts::FRAC_PI_2 / (springs as f64 * wave);
    let substeps = (16.0 / (slowest * wave)).ceil() as u32;
    let settings = Settings {
        formulation: Formulation::Xpbd,
        dt_s: f64::from(substeps) * wave,
        substeps,
        iterations: 20,
        gravity_m_s2: [0.0, -GRAVITY, 0.0],
        damping_per_s: 2.0 * slowest,
        relaxation: 1.0,
    };
    let mut solver = start(system, settings);
    solver.step(1).unwrap();
    -1.0 - positions(&mut *solver, scale)[springs].y
}

fn check<T: Scalar>(
    start: &Start<T>,
    springs: usize,
    softness: f64,
    scale: f64,
    tolerance: f64,
) -> Result<(), String> {
    within(sag(start, springs, softness, scale), SAG * (1.0 + 1.0 / springs as f64), tolerance)
}

#[test]
fn the_tip_sinks_as_the_closed_form_says() {
    for springs in [4, 16, 64] {
        for scale in SCALES {
            in_double(|start| check(start, springs, 1.0, scale, 1e-4));
            in_single(|start| check(start, springs, 1.0, scale, 2e-3));
        }
    }
}

#[test]
fn control_a_softer_bar_is_refused() {
    check(&reference::<f64>, 16, 1.01, 1.0, 1e-4).unwrap_err();
}
