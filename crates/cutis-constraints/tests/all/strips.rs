//! Random skin strips: a triangle in the scan, a deformed triangle, and a material.

use cutis_constraints::{Constraint, SkinStrip, SkinStripLaw, SkinStripMaterial, SkinStripTurn};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use crate::shapes::{Shape, shape};

/// A strip with its shape in the scan and another shape of the same scale.
#[derive(Clone, Copy, Debug)]
pub struct StripCase {
    pub scan: Shape<3>,
    pub x: Shape<3>,
    pub material: SkinStripMaterial,
}

impl StripCase {
    /// `[B1, B2, L, L0, β, κ, Hx, Hy, Hz]`
    pub fn params(&self) -> [f64; 9] {
        SkinStrip::from_rest(&self.scan.x, &self.material)
    }

    /// `[B1, B2, F0x, F0y, F0z, t0, Hx, Hy, Hz]`
    pub fn turn_params(&self) -> [f64; 9] {
        SkinStripTurn::from_rest(&self.scan.x, &self.material)
    }

    /// The area of the scan's triangle seen along the normal, negative if it faces inwards, over
    /// its area.
    pub fn facing(&self) -> f64 {
        let [x1, x2, x3] = self.scan.x;
        (x2 - x1).cross(&(x3 - x1)).normalize().dot(self.material.normal())
    }

    /// The image of the direction in a shape.
    pub fn image(&self, x: &[Point3<f64>; 3]) -> Vector3<f64> {
        let [b1, b2, _, _, _, _, rise @ ..] = self.params();
        (x[0] - x[2]) * b1 + (x[1] - x[2]) * b2 - Vector3::from(rise)
    }
}

/// Tension from 0 to 0.99 of the modulus, any compression, and a stiffening of up to `stiffest`.
fn law(stiffest: f64) -> impl Strategy<Value = SkinStripLaw> {
    let modulus = (0.0..3.0f64).prop_map(|power| 10f64.powf(power));
    let compression = prop_oneof![Just(0.0), Just(1.0), 0.0..1.0f64];
    let stiffening = prop_oneof![Just(0.0), 0.0..stiffest];
    (modulus, 0.0..0.99f64, stiffening, compression).prop_map(|(modulus, share, stiffening, compression)| {
        SkinStripLaw { tension_n_per_m: share * modulus, modulus_n_per_m: modulus, stiffening, compression }
    })
}

/// Strips on triangles that face the normal of the skin, are seen from their edge, or from behind.
pub fn strip_case(stiffest: f64) -> impl Strategy<Value = StripCase> {
    let vector = || proptest::array::uniform3(-1.0..1.0f64);
    (shape::<3>(), shape::<3>(), vector(), vector(), law(stiffest)).prop_filter_map(
        "a triangle with an extent across the strip",
        |(scan, other, tilt, direction, law)| {
            let [x1, x2, x3] = scan.x;
            let facet = (x2 - x1).cross(&(x3 - x1)).normalize();
            let normal = facet + Vector3::from(tilt) * 1.5;
            let material = SkinStripMaterial::new(normal.into(), direction, law).ok()?;
            material.shape(&scan.x).ok()?;
            let x = Shape { x: other.x.map(|p| p * (scan.scale / other.scale)), scale: scan.scale };
            Some(StripCase { scan, x, material })
        },
    )
}
