//! XPBD in `f32` loses forces to rounding on large sheets with short substeps. The loss is about
//! half of the estimate behind the warning.

use cutis::coloring::greedy;
use cutis::constraints::{Distance, Scalar, SkinTension};
use cutis::solver::{Formulation, Settings, Solver, SolverReference, Stiffness, SystemBuilder};
use cutis_studies::sheet::Sheet;

/// Prestrain of the sheet.
const STRAIN: f64 = 0.002;
/// Vertices across the sheet, which have 1 kg, springs of 1 N/m and a distance of 1 m.
const ACROSS: i64 = 160;

/// Opening of a slit in a stretched sheet, in spacings, after the motion has decayed.
fn opening<T: Scalar>(substeps: u32) -> f64 {
    let sheet = Sheet::new(ACROSS).cut(ACROSS as f64 / 10.0);
    let slowest = 0.61 * std::f64::consts::PI * std::f64::consts::SQRT_2 / ACROSS as f64;
    let settings = Settings {
        formulation: Formulation::Xpbd,
        dt_s: 0.5 / slowest,
        damping_per_s: 2.0 * slowest,
        substeps,
        ..Settings::default()
    };
    let rest = 1.0 / (1.0 + STRAIN);
    let [length, area] = [rest, 3f64.sqrt() / 4.0 * rest * rest].map(T::constant);
    let masses: Vec<T> = sheet.held.iter().map(|&held| T::constant(f64::from(u8::from(!held)))).collect();
    let count = sheet.positions.len();
    let soft = || Stiffness::compliance(T::constant(1.0));
    let lengths = vec![[length]; sheet.springs.len()];
    let areas = vec![[area, T::constant(0.0)]; sheet.triangles.len()];
    let builder = SystemBuilder::<T>::new(&sheet.positions, &masses).unwrap();
    let springs = greedy(&sheet.springs, count).unwrap();
    let builder = builder.add::<Distance, 2>(&sheet.springs, &lengths, soft(), &springs).unwrap();
    let triangles = greedy(&sheet.triangles, count).unwrap();
    let builder = builder.add::<SkinTension, 3>(&sheet.triangles, &areas, soft(), &triangles).unwrap();
    let mut solver = SolverReference::new(builder.build(), settings).unwrap();
    solver.step(20).unwrap();
    let positions: Vec<_> = solver.positions().unwrap().iter().map(|p| p.map(|x| x.to_f64())).collect();
    sheet.opening(&positions)
}

#[test]
fn short_substeps_lose_tension_in_f32() {
    let loss = |substeps| {
        let [single, double] = [opening::<f32>(substeps), opening::<f64>(substeps)];
        1.0 - single / double
    };
    let [few, many] = [32, 64].map(loss);
    let dt_s = 0.5 / (0.61 * std::f64::consts::PI * std::f64::consts::SQRT_2 / ACROSS as f64);
    for (loss, substeps) in [(few, 32.0), (many, 64.0)] {
        // Tension of springs and triangles, 2 K₂ ε.
        let tension = 2.0 * (0.75_f64.sqrt() + 0.1875_f64.sqrt()) * STRAIN;
        let least = ACROSS as f64 / 2.0 * 2f64.powi(-24) * (substeps / dt_s).powi(2);
        let estimate = (ACROSS as f64).sqrt() * least / tension;
        assert!((0.3 * estimate..estimate).contains(&loss), "{substeps} substeps: {loss} of {estimate}");
    }
    assert!((3.5..4.5).contains(&(many / few)), "the loss goes with 1/h²: {few} and {many}");
}
