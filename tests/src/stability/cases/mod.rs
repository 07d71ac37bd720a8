//! The cases, in groups: materials, shapes that have lost a dimension, bodies at the edge of what there is, time and forces.

mod materials;
mod places;
mod shapes;
mod time;

use nalgebra::{Point3, Vector3};

use super::case::Case;
use super::options::Effort;

/// All cases of that effort.
pub fn all(effort: Effort) -> Vec<Case> {
    let mut cases = materials::cases();
    cases.extend(shapes::cases());
    cases.extend(places::cases());
    cases.extend(time::cases(effort));
    cases.retain(|case| case.quick || effort != Effort::Quick);
    cases
}

/// Reproducible numbers: the generator of L'Ecuyer's and Simard's splitting scheme, 53 bits of each.
struct Random(u64);

impl Random {
    /// From −1 to 1.
    fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Components from −1 to 1.
    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.signed(), self.signed(), self.signed())
    }
}

/// Stretched, twisted about the z axis and shaken by a tenth of an element.
fn deformed() -> impl FnMut(Point3<f64>) -> Point3<f64> {
    let mut random = Random(1);
    move |x| {
        let (sin, cos) = (0.3 * x.z).sin_cos();
        let turned = Point3::new(cos * x.x - sin * x.y, sin * x.x + cos * x.y, x.z);
        let stretched = Point3::new(1.3 * turned.x, 0.8 * turned.y, 1.1 * turned.z);
        stretched + random.vector() * 0.1
    }
}
