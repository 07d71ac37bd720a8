//! Shapes: collapsed to a point, line or plane, inverted, or very thin.

use cutis_test_kit::Random;
use nalgebra::{Point3, Vector3};

use crate::stability::body::{Body, Law};
use crate::stability::case::{Case, End, Run};

const BLOCK: [usize; 3] = [3, 3, 3];
/// A direction that is not along an axis.
const DIRECTION: [f64; 3] = [0.8, 1.0, -1.1];

pub fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for law in Law::ALL {
        collapsed(&mut cases, law);
        inside_out(&mut cases, law);
        thin(&mut cases, law);
    }
    // Every substep is sampled, so that the effect of a single one shows.
    for case in &mut cases {
        let samples = if case.end == End::Rests { 1440 } else { 480 };
        case.run = Run { substeps: 1, samples, ..case.run };
    }
    cases
}

/// The block collapsed to a point, a line or a plane.
fn flattened(law: Law, dimensions: usize) -> Body {
    Body::block(BLOCK, law)
        .placed(|x| Point3::from(Vector3::from_fn(|axis, _| if axis < dimensions { x[axis] } else { 0.0 })))
}

fn collapsed(cases: &mut Vec<Case>, law: Law) {
    let of = law.name();
    let mut add = |name: &str, body: Body, end| {
        cases.push(Case::new(format!("collapsed to {name}, {of}"), body, end).quick());
    };
    add("a point", flattened(law, 0), End::Named);
    add("a line", flattened(law, 1), End::Named);
    add("a plane", flattened(law, 2), End::Recovers(0.05));
    // A soft body may stay tangled, since the energy of springs and volumes has other minima.
    // Descent ends in the nearest.
    let unfolds = match law {
        Law::SOFT => End::Bounded,
        Law::Vbd(_) => End::Rests,
        _ => End::Recovers(0.05),
    };
    for part in [1e-3, 1e-6] {
        for (name, dimensions, end) in
            [("a point", 0, unfolds), ("a line", 1, unfolds), ("a plane", 2, End::Recovers(0.05))]
        {
            let mut random = Random::new(4);
            let mut body = flattened(law, dimensions);
            body.start.iter_mut().for_each(|x| *x += random.vector() * part);
            add(&format!("{name} within {part:e}"), body, end);
        }
    }
    let mut random = Random::new(5);
    let along = Vector3::from(DIRECTION);
    let body = Body::block(BLOCK, law).placed(|_| Point3::from(along * random.between(-1.0, 1.0)));
    // Rounding decides the directions in which elements part, and whether they get caught.
    add("a slanted line", body, End::Bounded);
    let mut random = Random::new(6);
    let body = Body::block(BLOCK, law).placed(|_| Point3::from(random.vector() + Vector3::repeat(1.0)));
    let end = if law.is_implicit() { End::Rests } else { End::Recovers(0.05) };
    cases.push(Case::new(format!("random scramble, {of}"), body, end).quick());
}

fn inside_out(cases: &mut Vec<Case>, law: Law) {
    let of = law.name();
    let mut body = Body::tetrahedron(law);
    body.start[3].z = -1.0;
    cases.push(Case::new(format!("one tetrahedron inverted, {of}"), body, End::Recovers(0.05)).quick());
    let mut body = Body::block(BLOCK, law);
    let middle = body.start.len() / 2;
    body.start[middle] += Vector3::new(0.3, 0.2, 1.7);
    cases.push(Case::new(format!("an inner vertex outside, {of}"), body, End::Recovers(0.05)).quick());
    let body = Body::block(BLOCK, law).placed(|x| Point3::new(x.x, x.y, -x.z));
    cases.push(Case::new(format!("mirrored block, {of}"), body, End::Bounded));
}

/// Single elements without size at the start or at rest, and slivers.
fn thin(cases: &mut Vec<Case>, law: Law) {
    let of = law.name();
    let mut body = Body::block(BLOCK, law);
    body.start[1] = body.start[0];
    cases.push(Case::new(format!("an edge of zero length, {of}"), body, End::Recovers(0.05)).quick());
    let mut body = Body::block(BLOCK, law);
    let [a, b, c] = body.triangles[0].map(|v| v as usize);
    body.start[a] = nalgebra::center(&body.start[b], &body.start[c]);
    cases.push(Case::new(format!("a skin triangle of zero area, {of}"), body, End::Recovers(0.05)).quick());
    let mut body = Body::block(BLOCK, law);
    body.rest.iter_mut().for_each(|x| x.z *= 0.01);
    let mut random = Random::new(7);
    let body = body.placed(|x| x + Vector3::new(0.1, 0.1, 0.002).component_mul(&random.vector()));
    cases.push(Case::new(format!("slivers, {of}"), body, End::Recovers(0.05)).quick());
    let body = Body { without_rest_size: true, ..Body::block(BLOCK, law) };
    cases.push(Case::new(format!("rest sizes of zero, {of}"), body, End::Rests).quick());
}
