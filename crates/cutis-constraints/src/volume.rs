//! The volume constraint: a tetrahedron keeps its signed volume.

use nalgebra::{Point3, SimdBool, Vector3};

use crate::real::cross;
use crate::{Constraint, Eval, Real};

/// A constraint that keeps the signed volume of a tetrahedron.
///
/// ```text
/// V   = (x2 − x1)·((x3 − x1) × (x4 − x1)) / 6,  C = V − V0   [m³]
/// ∇2C = (x3 − x1) × (x4 − x1) / 6                            [m²]
/// ∇3C = (x4 − x1) × (x2 − x1) / 6
/// ∇4C = (x2 − x1) × (x3 − x1) / 6
/// ∇1C = −(∇2C + ∇3C + ∇4C)
/// ```
///
/// The factor 1/6 belongs in the gradient as well as in the volume. Without it the gradient is six
/// times too long, and a projection removes a sixth of the error instead of all of it. A test shows
/// this.
///
/// The parameters are `[V0]`, the rest volume in m³. It is positive if the vertices 2, 3, 4 run
/// counter-clockwise when seen from the side away from vertex 1. An inverted tetrahedron has a
/// negative volume and is pushed back through itself. The gradient is a polynomial, so it is
/// defined everywhere. It is zero where all four points lie on a line. The compliance is
/// [`volume_compliance`](crate::volume_compliance), in m³/Pa. Source: Bender, Müller and Macklin,
/// *A Survey on Position Based Dynamics*, Eurographics Tutorials 2017.
#[derive(Clone, Copy, Debug)]
pub struct Volume;

/// The rest volume of a [`Volume`] relative to its initial volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeMaterial {
    /// Rest volume divided by initial volume, above 0. Above 1 the tetrahedron swells from the
    /// start.
    pub rest_scale: f64,
}

impl Default for VolumeMaterial {
    /// The initial volume is the rest volume.
    fn default() -> Self {
        Self { rest_scale: 1.0 }
    }
}

/// Returns the volume (m³) and its four gradients (m²).
#[inline(always)]
fn volume_and_gradient<T: Real>([x1, x2, x3, x4]: &[Point3<T>; 4]) -> (T, [Vector3<T>; 4]) {
    let (a, b, c) = (x2 - x1, x3 - x1, x4 - x1);
    let sixth = T::constant(1.0 / 6.0);
    let grad2 = cross(&b, &c) * sixth;
    let grad3 = cross(&c, &a) * sixth;
    let grad4 = cross(&a, &b) * sixth;
    (a.dot(&grad2), [-(grad2 + grad3 + grad4), grad2, grad3, grad4])
}

impl Constraint<4> for Volume {
    const NAME: &'static str = "volume";
    const WGSL: &'static str = cutis_shaders::constraints::VOLUME;
    type Params<T: Real> = [T; 1];
    type Material = VolumeMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 4], material: &VolumeMaterial) -> [T; 1] {
        [volume_and_gradient(x).0 * T::constant(material.rest_scale)]
    }

    #[inline(always)]
    fn eval<T: Real>(x: &[Point3<T>; 4], &[rest_volume]: &[T; 1]) -> Eval<T, 4> {
        let (volume, grad) = volume_and_gradient(x);
        Eval { c: volume - rest_volume, grad }
    }

    /// Returns `1/r²` with `r² = 16 max(e², √(V0 e))`, where `e` is the longest edge at the first
    /// vertex. The reach is four times the larger of the present size and the rest size. The
    /// geometric mean stands in for the rest size because it saves a third root.
    #[inline(always)]
    fn inverse_reach_squared<T: Real>(
        [x1, x2, x3, x4]: &[Point3<T>; 4],
        &[rest_volume]: &[T; 1],
    ) -> Option<T> {
        let (a, b, c) = (x2 - x1, x3 - x1, x4 - x1);
        let edge_squared = a.dot(&a).simd_max(b.dot(&b)).simd_max(c.dot(&c));
        // e³ > V0 is the usual case and needs no root. The factor two keeps its rounding out of the
        // result.
        let grown = (edge_squared * edge_squared * edge_squared)
            .simd_gt(rest_volume * rest_volume * T::constant(2.0));
        let size_squared = if grown.all() {
            edge_squared
        } else {
            edge_squared.simd_max((rest_volume.simd_abs() * edge_squared.simd_sqrt()).simd_sqrt())
        };
        let inverse = T::constant(1.0 / 16.0) / size_squared;
        Some(inverse.select(size_squared.simd_gt(T::zero()), T::zero()))
    }

    /// True if `|C| ≤ 2|V|`.
    ///
    /// Let `w` be the largest inverse mass. The limit acts if `w C²/r² > Σ w_i|∇_iV|²`. Each vertex
    /// has an edge to the first vertex, or is that vertex, and its gradient is normal to the plane
    /// of the other three. So the product of the edge with the gradient is `±V`, and
    /// `|∇_iV| ≥ |V|/e`. With `r² ≥ 16 e²` the limit acts only if `|C| > 4|V|`. The factor of two
    /// keeps rounding out of the result.
    #[inline(always)]
    fn is_in_reach<T: Real>(c: T, &[rest_volume]: &[T; 1]) -> T::SimdBool {
        c.simd_abs().simd_le((c + rest_volume).simd_abs() * T::constant(2.0))
    }

    fn rest_size<T: Real>(&[rest_volume]: &[T; 1]) -> T {
        rest_volume.simd_abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns `1/r²` as the shader computes it, always with both roots.
    fn with_roots(edge_squared: f32, rest_volume: f32) -> f32 {
        let size_squared = edge_squared.max((rest_volume * edge_squared.sqrt()).sqrt());
        if size_squared > 0.0 { 1.0 / 16.0 / size_squared } else { 0.0 }
    }

    #[test]
    fn deciding_without_roots_changes_no_bit() {
        for edge in [0.0, 1e-12, 3e-7, 2e-4, 0.7, 41.0, 5e6, 1e15] {
            let x =
                [[0.0f32, 0.0, 0.0], [edge, 0.0, 0.0], [0.0, edge, 0.0], [0.0, 0.0, edge]].map(Point3::from);
            let cube = edge * edge * edge;
            let near = (-4000..4000).map(|step| cube * (1.0 + step as f32 * 1e-4));
            for rest_volume in near.chain([0.0, 1e-30, 1e-9, 1.0, 1e30]).map(f32::abs) {
                let found = Volume::inverse_reach_squared(&x, &[rest_volume]);
                assert_eq!(
                    found,
                    Some(with_roots(edge * edge, rest_volume)),
                    "edge {edge}, volume {rest_volume}"
                );
            }
        }
    }
}
