//! A thread between two points of the skin, as a suture pulls it.

use nalgebra::{Point3, Vector3};

use crate::{Constraint, Eval, Real};

/// A thread between a point of one triangle and a point of another. It pulls and does not push.
///
/// ```text
/// p = x1 + a·(x2 − x1) + b·(x3 − x1),   q = x4 + c·(x5 − x4) + d·(x6 − x4)
/// C = max(|p − q| − L, 0)                                             [m]
/// ∇C = (1 − a − b, a, b, −(1 − c − d), −c, −d) · (p − q)/|p − q|      [1]
/// ```
///
/// The parameters are `[a, b, c, d, L]`: the weights of the second and third corner of each
/// triangle, and the length of the thread in m. A slack thread and one whose ends coincide have no
/// gradient. The compliance is the inverse of the stiffness of the thread, in m/N; the force in it
/// is `C/α`.
#[derive(Clone, Copy, Debug)]
pub struct Thread;

/// The ends and the length of a [`Thread`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThreadMaterial {
    /// Weights of the second and third corner at each end, 0 or more with a sum of at most 1.
    pub ends: [[f64; 2]; 2],
    /// Length divided by the distance of the ends, above 0.
    pub length_scale: f64,
}

impl Thread {
    /// The vector from the second end to the first in m.
    #[inline(always)]
    fn span<T: Real>(x: &[Point3<T>; 6], [a, b, c, d]: [T; 4]) -> Vector3<T> {
        let p = (x[1] - x[0]) * a + (x[2] - x[0]) * b;
        let q = (x[4] - x[3]) * c + (x[5] - x[3]) * d;
        (x[0] - x[3]) + (p - q)
    }

    /// Distance of the ends in m.
    pub fn distance<T: Real>(x: &[Point3<T>; 6], &[a, b, c, d, _]: &[T; 5]) -> T {
        let span = Self::span(x, [a, b, c, d]);
        span.dot(&span).simd_sqrt()
    }
}

impl Constraint<6> for Thread {
    const NAME: &'static str = "thread";
    const WGSL: &'static str = cutis_shaders::constraints::THREAD;
    type Params<T: Real> = [T; 5];
    type Material = ThreadMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 6], material: &ThreadMaterial) -> [T; 5] {
        let [[a, b], [c, d]] = material.ends.map(|end| end.map(T::constant));
        let distance = Self::distance(x, &[a, b, c, d, T::zero()]);
        [a, b, c, d, distance * T::constant(material.length_scale)]
    }

    #[inline(always)]
    fn eval<T: Real>(x: &[Point3<T>; 6], &[a, b, c, d, length]: &[T; 5]) -> Eval<T, 6> {
        let span = Self::span(x, [a, b, c, d]);
        let distance = span.dot(&span).simd_sqrt();
        let zero = T::zero();
        let excess = distance - length;
        let taut = excess.simd_gt(zero);
        let inverse = (T::one() / distance).select(distance.simd_gt(zero), zero);
        let direction = span * inverse.select(taut, zero);
        let one = T::one();
        let weights = [(one - a) - b, a, b, (c - one) + d, -c, -d];
        // Not `map`, which may stay a call in the loops with SIMD lanes.
        let mut grad = [direction; 6];
        for (grad, weight) in grad.iter_mut().zip(weights) {
            *grad *= weight;
        }
        Eval { c: excess.select(taut, zero), grad }
    }

    fn rest_size<T: Real>(&[.., length]: &[T; 5]) -> T {
        length
    }
}
