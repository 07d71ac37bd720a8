//! Materials: compliances from 0 to 1e6, all stiffnesses of PBD, layers with contrasts up to 1e3,
//! amplifications and mass ratios up to 1e6.

use cutis_test_kit::Random;
use nalgebra::Point3;

use super::{UNDAMPED, deformed};
use crate::stability::body::{Body, Compliances, Law};
use crate::stability::case::{Case, End, Run};

const BLOCK: [usize; 3] = [3, 3, 3];

pub fn cases() -> Vec<Case> {
    let mut cases = compliances();
    cases.extend(layers());
    cases.extend(amplifications());
    cases.extend(masses());
    cases
}

/// A deformed block with random velocities.
fn block(law: Law) -> Body {
    let mut body = Body::block(BLOCK, law).placed(deformed());
    let mut random = Random::new(2);
    body.velocities.iter_mut().for_each(|v| *v = random.vector());
    body
}

fn compliances() -> Vec<Case> {
    let mut cases = Vec::new();
    for compliance in [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6] {
        // A body softer than 1e-3 takes longer than two seconds.
        let end = if compliance <= 1e-3 { End::Recovers(0.02) } else { End::Bounded };
        let extreme = compliance == 0.0 || compliance == 1e6;
        compliance_cases(&mut cases, Law::Xpbd(Compliances::uniform(compliance)), end, extreme);
    }
    for compliance in [1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6] {
        let end = if compliance == 1e-3 { End::Recovers(0.02) } else { End::Bounded };
        let extreme = compliance == 1e-12 || compliance == 1e6;
        compliance_cases(&mut cases, Law::Vbd(Compliances::uniform(compliance)), end, extreme);
    }
    for relaxation in [0.1, 1.5, 1.9] {
        for law in [Law::DESCENT, Law::STIFF_DESCENT] {
            let name = format!("steps {relaxation} times as long, {}", law.name());
            let run = Run { relaxation, ..UNDAMPED };
            cases.push(Case {
                quick: relaxation == 1.9,
                ..Case::new(name, block(law), End::Bounded).run(run)
            });
        }
    }
    for share in [0.0, 0.1, 1.0] {
        let end = if share > 0.0 { End::Recovers(0.02) } else { End::Bounded };
        let case = Case::new(format!("PBD, stiffness {share}"), block(Law::Pbd(share)), end);
        cases.push(Case { quick: share == 1.0, ..case });
        let name = format!("PBD, stiffness {share}, undamped");
        cases.push(Case::new(name, block(Law::Pbd(share)), End::Bounded).run(UNDAMPED));
    }
    cases
}

fn compliance_cases(cases: &mut Vec<Case>, law: Law, end: End, quick: bool) {
    let mut add = |name: &str, end, run| {
        let case = Case::new(format!("{}{name}", law.name()), block(law), end).run(run);
        cases.push(Case { quick, ..case });
    };
    add("", end, Run::default());
    add(", undamped", End::Bounded, UNDAMPED);
    add(", 8 iterations", end, Run { iterations: 8, ..Run::default() });
}

/// A block whose lower half is softer than its upper half.
fn layers() -> Vec<Case> {
    const STIFF: Law = Law::Xpbd(Compliances::STIFF);
    let mut cases = Vec::new();
    for contrast in [10.0, 100.0, 1000.0] {
        for law in [Law::SOFT, STIFF, Law::PBD, Law::DESCENT, Law::STIFF_DESCENT] {
            let mut random = Random::new(5);
            let mut body = Body::block([3, 3, 6], law).placed(deformed()).layered(contrast);
            body.velocities.iter_mut().for_each(|v| *v = random.vector());
            let mut add = |name: &str, run| {
                let name = format!("layers 1 : {contrast}{name}, {}", law.name());
                let case = Case::new(name, body.clone(), End::Bounded).run(run);
                cases.push(Case { quick: contrast == 1000.0, ..case });
            };
            add("", Run::default());
            add(", undamped", UNDAMPED);
            add(", 8 iterations", Run { iterations: 8, ..Run::default() });
        }
    }
    cases
}

/// A free sheet with stretched skin, and a sheet fixed at its border at a hundred times its area.
/// No substep resolves the stiffness of skin that is stretched so far.
fn amplifications() -> Vec<Case> {
    let mut cases = Vec::new();
    for amplification in [0.0, 1.0, 1e3, 1e6] {
        for law in [Law::SOFT, Law::RIGID, Law::PBD, Law::DESCENT] {
            let mut add = |name: &str, body: Body, end| {
                let name = format!("amplification {amplification:e}{name}, {}", law.name());
                let samples = if end == End::Rests { 360 } else { 120 };
                let run = Run { samples, ..Run::default() };
                let case = Case::new(name, Body { amplification, ..body }, end).run(run);
                cases.push(Case { quick: amplification == 1e6, ..case }.unresolved());
            };
            let mut random = Random::new(9);
            let sheet = Body::sheet(6, law).placed(|x| x * 1.1 + random.vector() * 0.01);
            add("", sheet, End::Recovers(0.02));
            // The sheet jams in its plane on the way back.
            add(", twice its area", Body::sheet(6, law).placed(|x| x * 1.4), End::Bounded);
            let mut body = Body::sheet(6, law).placed(|x| x * 10.0);
            let edge = |x: &Point3<f64>| x.x.abs().max(x.y.abs()) > 2.4;
            body.inverse_masses
                .iter_mut()
                .zip(&body.rest)
                .filter(|(_, x)| edge(x))
                .for_each(|(w, _)| *w = 0.0);
            add(", held a hundredfold", body, End::Rests);
        }
    }
    cases
}

/// Neighbors a million times as heavy.
fn masses() -> Vec<Case> {
    let mut cases = Vec::new();
    for law in [Law::SOFT, Law::RIGID, Law::PBD, Law::DESCENT] {
        let mut random = Random::new(3);
        let mut body = block(law);
        body.inverse_masses.iter_mut().for_each(|w| *w = 10f64.powf(3.0 * random.between(-1.0, 1.0)));
        cases.push(Case::new(format!("random masses 1e-3 to 1e3, {}", law.name()), body, End::Bounded));
        let mut body = block(law);
        body.inverse_masses.iter_mut().step_by(2).for_each(|w| *w = 1e-6);
        let name = format!("every second vertex 1e6 times as heavy, {}", law.name());
        cases.push(Case { quick: law != Law::RIGID, ..Case::new(name, body, End::Bounded) });
    }
    cases
}
