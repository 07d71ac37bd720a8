//! Time and forces: substeps from 1e-5 s to 1 s, a gravity of 1000 g, corners pulled through the
//! body, a million steps.

use cutis_solver::Handle;
use cutis_test_kit::Random;
use nalgebra::Vector3;

use super::deformed;
use crate::stability::body::{Body, Law};
use crate::stability::case::{Case, End, Run};
use crate::stability::options::Effort;

const BLOCK: [usize; 3] = [3, 3, 3];

pub fn cases(effort: Effort) -> Vec<Case> {
    let mut cases = Vec::new();
    for law in Law::ALL {
        steps(&mut cases, law);
        forces(&mut cases, law);
        many_steps(&mut cases, law, effort);
    }
    cases
}

fn steps(cases: &mut Vec<Case>, law: Law) {
    for h in [1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0] {
        let body = Body::block(BLOCK, law).placed(deformed());
        // A simulated second; with the shortest substeps that would take too many of them.
        let substeps = if h < 1e-3 { 40 } else { 4 };
        let end = if h < 1e-3 { End::Bounded } else { End::Recovers(0.02) };
        let samples = (2.0 / (h * f64::from(substeps))).clamp(50.0, 500.0) as usize;
        let run = Run { h, substeps, samples, ..Run::default() };
        let case = Case::new(format!("substeps of {h:e} s, {}", law.name()), body, end).run(run);
        let case = Case { quick: h == 1.0, ..case };
        // In single precision, a spring moves a vertex within 1e-5 s by less than the last digit of
        // its position.
        cases.push(if h < 1e-4 { case.unresolved() } else { case });
    }
}

fn forces(cases: &mut Vec<Case>, law: Law) {
    let of = law.name();
    let mut body = Body::block(BLOCK, law);
    for (w, x) in body.inverse_masses.iter_mut().zip(&body.rest) {
        *w = if x.y == 2.0 { 0.0 } else { 1.0 };
    }
    let run = Run { gravity: [0.0, -9810.0, 0.0], ..Run::default() };
    cases.push(Case::new(format!("1000 g, {of}"), body, End::Rests).run(run).quick());
    let mut body = Body::block(BLOCK, law);
    let last = body.rest.len() as u32 - 1;
    body.handles.push(Handle { vertices: vec![last], move_m: [20.0, 15.0, 10.0], at_s: 0.0, over_s: 0.0 });
    // A stiff solid that is torn through itself stays tangled, because each step decreases the
    // energy.
    let end = if law == Law::STIFF_DESCENT { End::Rests } else { End::Recovers(0.05) };
    cases.push(Case::new(format!("a corner torn off by ten body sizes at once, {of}"), body, end).quick());
}

fn many_steps(cases: &mut Vec<Case>, law: Law, effort: Effort) {
    let frames = match effort {
        Effort::Quick => 100,
        Effort::Normal => 1_000,
        Effort::Full => 10_000,
    };
    let mut body = Body::tetrahedron(law).placed(deformed());
    let mut random = Random::new(8);
    body.velocities.iter_mut().for_each(|v| *v = random.vector());
    // No momentum: in an hour the body would drift away by thousands of its sizes, and lose
    // precision.
    let mean = body.velocities.iter().sum::<Vector3<f64>>() / body.velocities.len() as f64;
    body.velocities.iter_mut().for_each(|v| *v -= mean);
    // Steps of descent that are not converged do not conserve the angular momentum of a free body.
    // Without damping it spins faster and faster.
    let (damping_per_s, damped) = if law.is_implicit() { (10.0, "") } else { (0.0, " undamped") };
    let run = Run { damping_per_s, substeps: 4, samples: 25, frames, ..Run::default() };
    let name = format!("{} steps{damped}, {}", 25 * 4 * frames, law.name());
    cases.push(Case::new(name, body, End::Bounded).run(run).quick());
}
