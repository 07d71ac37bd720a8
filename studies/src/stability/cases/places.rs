//! Limits of bodies: one element, an isolated vertex, nothing that can move, far from the origin.

use nalgebra::{Point3, Vector3};

use super::deformed;
use crate::stability::body::{Body, Law};
use crate::stability::case::{Case, End, Run};

const BLOCK: [usize; 3] = [3, 3, 3];

pub fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for law in Law::ALL {
        let of = law.name();
        let mut add = |name: &str, body, end| {
            cases.push(Case::new(format!("{name}, {of}"), body, end).quick());
        };
        add("at rest", Body::block(BLOCK, law), End::Recovers(1e-4));
        add("one tetrahedron", Body::tetrahedron(law).placed(deformed()), End::Recovers(0.02));
        let mut body = Body::block(BLOCK, law).placed(deformed());
        body.rest.push(Point3::new(5.0, 5.0, 5.0));
        body.start.push(Point3::new(5.0, 5.0, 5.0));
        body.velocities.push(Vector3::new(1.0, 2.0, 3.0));
        body.inverse_masses.push(1.0);
        add("an isolated vertex", body, End::Recovers(0.02));
        let mut body = Body::block(BLOCK, law).placed(deformed());
        body.inverse_masses.fill(0.0);
        add("everything fixed", body, End::Unmoved);
        let mut body = Body::block(BLOCK, law).placed(deformed());
        body.offset = Vector3::new(2e4, -1e4, 3e4);
        add("1e4 body sizes from the origin", body, End::Recovers(0.02));
    }
    for case in cases.iter_mut().filter(|case| case.end == End::Unmoved) {
        case.run = Run { gravity: [0.0, -9.81, 0.0], ..case.run };
    }
    cases
}
