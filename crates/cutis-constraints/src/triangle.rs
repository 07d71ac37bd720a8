//! The area of a triangle in space and its gradient, shared by the two forms of skin tension.

use nalgebra::{Point3, Vector3};

use crate::Real;
use crate::real::cross;

/// Sine of the angle at the first vertex, in units of the machine epsilon, below which the normal
/// of a triangle is rounding noise.
const NOISE: f64 = 8.0;

/// Returns the area (m²) of the triangle `x`.
pub(crate) fn area<T: Real>([x1, x2, x3]: &[Point3<T>; 3]) -> T {
    let n = cross(&(x2 - x1), &(x3 - x1));
    n.dot(&n).simd_sqrt() * T::constant(0.5)
}

/// Returns the area (m²) of the triangle `x` and its gradient (m). With `n = (x2 − x1) × (x3 − x1)`
/// and `n̂ = n/|n|`:
///
/// `A = |n|/2`, `∇1A = ½ (x2 − x3) × n̂`, `∇2A = ½ (x3 − x1) × n̂`, `∇3A = ½ (x1 − x2) × n̂`.
///
/// The gradient is zero where the three points lie on a line to within rounding, because the
/// direction of `n̂` is then arbitrary.
#[inline(always)]
pub(crate) fn area_and_gradient<T: Real>([x1, x2, x3]: &[Point3<T>; 3]) -> (T, [Vector3<T>; 3]) {
    let (e2, e3) = (x2 - x1, x3 - x1);
    let n = cross(&e2, &e3);
    let n_squared = n.dot(&n);
    let n_length = n_squared.simd_sqrt();
    let half = T::constant(0.5);
    let noise = T::constant(NOISE) * T::simd_default_epsilon();
    let noise_squared = noise * noise * e2.dot(&e2) * e3.dot(&e3);
    let half_normal = n * (half / n_length).select(n_squared.simd_gt(noise_squared), T::zero());
    let grad2 = cross(&e3, &half_normal);
    let grad3 = cross(&half_normal, &e2);
    (n_length * half, [-(grad2 + grad3), grad2, grad3])
}

/// Returns `1/r²` with `r² = 16 max(e², A0)`, where `e` is the longer edge at the first vertex:
/// four times the larger of the present size and the rest size.
#[inline(always)]
pub(crate) fn inverse_reach_squared<T: Real>([x1, x2, x3]: &[Point3<T>; 3], rest_area: T) -> T {
    let (e2, e3) = (x2 - x1, x3 - x1);
    let size_squared = e2.dot(&e2).simd_max(e3.dot(&e3)).simd_max(rest_area);
    let inverse = T::constant(1.0 / 16.0) / size_squared;
    inverse.select(size_squared.simd_gt(T::zero()), T::zero())
}
