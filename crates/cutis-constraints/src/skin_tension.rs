//! The energy form of the skin tension constraint (STC).

use nalgebra::Point3;

use crate::{Constraint, Eval, Real, triangle};

/// A constraint that keeps the area of a triangle of skin. Its stiffness grows with the stretch. It
/// is unconditionally stable.
///
/// Let `A` be the area, `A0` the rest area and `C = A − A0`. Skin tension pulls with the force
/// `k·F·C·∇A`, amplified by `F = 1 + β·max(0, C)/A0`. This force is the gradient of
///
/// ```text
/// U = k (½ C² + β max(0, C)³ / (3 A0))   [J]
/// ```
///
/// which equals `½ k Ĉ²` for the constraint that this type evaluates:
///
/// ```text
/// Ĉ  = C q,  q = √(1 + 2β max(0, C) / (3 A0))      [m²]
/// ∇Ĉ = (q + Cβ / (3 A0 q)) ∇A = ½(3q − 1/q) ∇A     [m]    (q = 1 where C ≤ 0)
/// ```
///
/// `∇A` is the gradient of a triangle's area: `∇1A = ½ (x2 − x3) × n̂`, and the same for the other
/// vertices in cyclic order, with the unit normal `n̂`.
///
/// `Ĉ` increases with `A`, and is convex where it pulls (`A ≥ A0`). A projection follows the
/// tangent of `Ĉ`, which meets zero before `Ĉ` does. For any `β` it stops short of the rest area
/// instead of overshooting it. The force is the published one, without a clamp.
///
/// The parameters are `[A0, β]`: the rest area in m² and the amplification without unit. With a
/// rest area of zero there is no stretch and no amplification: `q = 1`. The gradient is zero where
/// the points lie on a line. The compliance is [`skin_compliance`](crate::skin_compliance), in
/// m³/N.
///
/// Sources: the force law comes from the skin tension constraint, DOI 10.15701/kcgs.2025.31.4.21,
/// Algorithm 1, with a corrected gradient. The energy and `Ĉ` are derived from it here. See the
/// errata page of the book.
#[derive(Clone, Copy, Debug)]
pub struct SkinTension;

/// The rest area and the amplification of a [`SkinTension`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinTensionMaterial {
    /// Rest area divided by initial area, above 0. Below 1 the skin is under tension from the
    /// start, which opens a wound.
    pub rest_area_scale: f64,
    /// `β`: the growth of the stiffness per relative stretch of the area, without unit; 0 or more.
    pub amplification: f64,
}

impl Default for SkinTensionMaterial {
    /// The initial area is the rest area, and the stiffness is constant.
    fn default() -> Self {
        Self { rest_area_scale: 1.0, amplification: 0.0 }
    }
}

/// Returns `max(0, C)/A0`, the relative stretch of the area; 0 if the rest area is 0.
#[inline(always)]
pub(crate) fn stretch<T: Real>(c: T, rest_area: T) -> T {
    let zero = T::zero();
    (c / rest_area).select(c.simd_gt(zero), zero).select(rest_area.simd_gt(zero), zero)
}

impl Constraint<3> for SkinTension {
    const NAME: &'static str = "stc";
    const WGSL: &'static str = cutis_shaders::constraints::SKIN_TENSION;
    type Params<T: Real> = [T; 2];
    type Material = SkinTensionMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 3], material: &SkinTensionMaterial) -> [T; 2] {
        [triangle::area(x) * T::constant(material.rest_area_scale), T::constant(material.amplification)]
    }

    #[inline(always)]
    fn eval<T: Real>(x: &[Point3<T>; 3], &[rest_area, amplification]: &[T; 2]) -> Eval<T, 3> {
        let (area, grad) = triangle::area_and_gradient(x);
        let c = area - rest_area;
        let q = (T::one() + T::constant(2.0 / 3.0) * amplification * stretch(c, rest_area)).simd_sqrt();
        let slope = T::constant(1.5) * q - T::constant(0.5) / q;
        // Not `map`, which may stay a call in the loops with SIMD lanes.
        Eval { c: c * q, grad: [grad[0] * slope, grad[1] * slope, grad[2] * slope] }
    }

    #[inline(always)]
    fn inverse_reach_squared<T: Real>(x: &[Point3<T>; 3], &[rest_area, _]: &[T; 2]) -> Option<T> {
        Some(triangle::inverse_reach_squared(x, rest_area))
    }

    fn rest_size<T: Real>(&[rest_area, _]: &[T; 2]) -> T {
        rest_area
    }
}
