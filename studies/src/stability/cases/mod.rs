//! The cases in groups: materials, collapsed shapes, limits of bodies, time and forces, membranes.

mod materials;
mod membranes;
mod places;
mod shapes;
mod time;

use cutis_test_kit::Random;
use nalgebra::Point3;

use super::case::{Case, Run};
use super::options::Effort;

/// One undamped second.
const UNDAMPED: Run = Run {
    h: 1.0 / 240.0,
    substeps: 4,
    iterations: 1,
    samples: 60,
    frames: 1,
    gravity: [0.0; 3],
    damping_per_s: 0.0,
    relaxation: 1.0,
};

/// All cases to run at this effort.
pub fn all(effort: Effort) -> Vec<Case> {
    let mut cases = materials::cases();
    cases.extend(shapes::cases());
    cases.extend(places::cases());
    cases.extend(time::cases(effort));
    cases.extend(membranes::cases());
    cases.retain(|case| case.quick || effort != Effort::Quick);
    cases
}

/// A deformation: stretched, twisted about the z axis, and each vertex moved at random by a tenth
/// of an element.
fn deformed() -> impl FnMut(Point3<f64>) -> Point3<f64> {
    let mut random = Random::new(1);
    move |x| {
        let (sin, cos) = (0.3 * x.z).sin_cos();
        let twisted = Point3::new(cos * x.x - sin * x.y, sin * x.x + cos * x.y, x.z);
        let stretched = Point3::new(1.3 * twisted.x, 0.8 * twisted.y, 1.1 * twisted.z);
        stretched + random.vector() * 0.1
    }
}
