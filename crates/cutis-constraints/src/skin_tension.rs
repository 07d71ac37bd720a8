//! Skin tension constraint (STC), energy form: a triangle of skin keeps its area, the more firmly the more it is
//! stretched.

use nalgebra::Point3;

use crate::material::{MaterialError, check_not_negative, check_positive};
use crate::{Constraint, Eval, Real, triangle};

/// A triangle of skin keeps its area, the more firmly the more it is stretched; unconditionally stable.
///
/// With the area `A`, the rest area `A0` and the area stretched over `C = A − A0`, skin tension pulls with the force
/// `k·F·C·∇A`, amplified by `F = 1 + β·max(0, C)/A0`. This force is the gradient of
///
/// ```text
/// U = k (½ C² + β max(0, C)³ / (3 A0))   [J]
/// ```
///
/// which equals `½ k Ĉ²` for the constraint that this type evaluates,
///
/// ```text
/// Ĉ  = C q,  q = √(1 + 2β max(0, C) / (3 A0))      [m²]
/// ∇Ĉ = (q + Cβ / (3 A0 q)) ∇A = ½(3q − 1/q) ∇A     [m]    (q = 1 where C ≤ 0)
/// ```
///
/// and `∇A` as of a triangle: `∇1A = ½ (x2 − x3) × n̂` and so on around, with the unit normal `n̂`.
///
/// `Ĉ` is increasing in `A` and convex where it pulls (`A ≥ A0`). A projection follows the tangent of `Ĉ`, which meets
/// zero before `Ĉ` does: it stops short of the rest area instead of shooting past it, whatever `β`. The same force as
/// published, without a clamp.
///
/// Parameters `[A0, β]`: the rest area in m² and the amplification without unit. A rest area of zero has no
/// stretch, hence no amplification: `q = 1`. The gradient is zero where the points lie on a line.
/// Compliance: [`skin_compliance`](crate::skin_compliance), m³/N.
///
/// Sources: the force law is that of the skin tension constraint, DOI 10.15701/kcgs.2025.31.4.21, Algorithm 1, with the
/// gradient put right; the energy and `Ĉ` are derived from it here. See the errata page of the book.
#[derive(Clone, Copy, Debug)]
pub struct SkinTension;

/// How a [`SkinTension`] is built from its rest shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinTensionMaterial {
    /// Rest area over initial area: below 1 the skin is under tension from the start, which opens a wound. Above 0.
    pub rest_area_scale: f64,
    /// `β`: how much firmer the skin gets per relative stretch of its area, without unit. 0 or more.
    pub amplification: f64,
}

impl Default for SkinTensionMaterial {
    /// At rest as built, not amplified.
    fn default() -> Self {
        Self { rest_area_scale: 1.0, amplification: 0.0 }
    }
}

impl SkinTensionMaterial {
    /// # Errors
    /// [`MaterialError::NotPositive`] unless the scale is finite and above 0; [`MaterialError::Negative`] unless the
    /// amplification is finite and 0 or more.
    pub fn check(&self) -> Result<(), MaterialError> {
        check_positive("rest_area_scale of skin tension", "1", self.rest_area_scale)?;
        check_not_negative("amplification of skin tension", "1", self.amplification)
    }
}

/// `max(0, C)/A0`: relative stretch of the area; 0 if the rest area is 0.
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
        Eval { c: c * q, grad: grad.map(|g| g * slope) }
    }

    #[inline(always)]
    fn inverse_reach_squared<T: Real>(x: &[Point3<T>; 3], &[rest_area, _]: &[T; 2]) -> Option<T> {
        Some(triangle::inverse_reach_squared(x, rest_area))
    }

    fn rest_size<T: Real>(&[rest_area, _]: &[T; 2]) -> T {
        rest_area
    }
}
