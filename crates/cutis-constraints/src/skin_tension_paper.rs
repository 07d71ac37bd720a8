//! Skin tension constraint (STC), paper form: for PBD, to reproduce the published results.

use nalgebra::Point3;

use crate::material::{MaterialError, check_not_negative, check_positive};
use crate::skin_tension::stretch;
use crate::{Constraint, Eval, Real, triangle};

/// Skin tension as published, for PBD only: the area error times an amplification, along the gradient of the area.
///
/// ```text
/// C  = A − A0,  F = min(1 + β max(0, C)/A0, F_max)
/// returned: c = C F [m²],  grad = ∇A [m]
/// ```
///
/// In PBD with stiffness `s` per iteration this gives the published correction `Δx_i = −s F C w_i ∇_iA / Σ w|∇A|²`.
/// `F` multiplies the step, so that `s·F` above 1 shoots past the rest area and, above about 2, diverges. It is
/// therefore clamped: `F_max = 1/s` ([`SkinTensionPaperMaterial::for_stiffness`]). A stiffness of 1 leaves no room
/// for amplification.
///
/// **`grad` is not the gradient of `c`** where `F > 1`: there is no energy behind this form. With XPBD use
/// [`SkinTension`](crate::SkinTension), which pulls with the same force and needs no clamp.
///
/// Parameters `[A0, β, F_max]`. Degenerate shapes as in [`SkinTension`](crate::SkinTension).
/// Source: DOI 10.15701/kcgs.2025.31.4.21, Algorithm 1. The gradient as printed there has the wrong sign at the third
/// vertex and the wrong length; this is the right one, see the errata page of the book.
#[derive(Clone, Copy, Debug)]
pub struct SkinTensionPaper;

/// How a [`SkinTensionPaper`] is built from its rest shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinTensionPaperMaterial {
    /// Rest area over initial area: below 1 the skin is under tension from the start. Above 0.
    pub rest_area_scale: f64,
    /// `β`: how much firmer the skin gets per relative stretch of its area, without unit. 0 or more.
    pub amplification: f64,
    /// `F_max`: the largest amplification; at most 1/stiffness for a stable run. Above 0.
    pub max_amplification: f64,
}

impl SkinTensionPaperMaterial {
    /// The material whose amplification is stable in PBD with `stiffness` per iteration: `F_max = 1/stiffness`.
    ///
    /// # Errors
    /// [`MaterialError::StiffnessOutOfRange`] unless `stiffness` is above 0 and at most 1, and the errors of
    /// [`check`](Self::check).
    pub fn for_stiffness(
        stiffness: f64,
        rest_area_scale: f64,
        amplification: f64,
    ) -> Result<Self, MaterialError> {
        if !(stiffness > 0.0 && stiffness <= 1.0) {
            return Err(MaterialError::StiffnessOutOfRange { value: stiffness });
        }
        let material = Self { rest_area_scale, amplification, max_amplification: 1.0 / stiffness };
        material.check()?;
        Ok(material)
    }

    /// # Errors
    /// [`MaterialError::NotPositive`] unless both the scale and the largest amplification are finite and above 0;
    /// [`MaterialError::Negative`] unless the amplification is finite and 0 or more.
    pub fn check(&self) -> Result<(), MaterialError> {
        check_positive("rest_area_scale of skin tension", "1", self.rest_area_scale)?;
        check_not_negative("amplification of skin tension", "1", self.amplification)?;
        check_positive("max_amplification of skin tension", "1", self.max_amplification)
    }
}

impl Constraint<3> for SkinTensionPaper {
    const NAME: &'static str = "stc_paper";
    const WGSL: &'static str = cutis_shaders::constraints::SKIN_TENSION_PAPER;
    type Params<T: Real> = [T; 3];
    type Material = SkinTensionPaperMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 3], material: &SkinTensionPaperMaterial) -> [T; 3] {
        [
            triangle::area(x) * T::constant(material.rest_area_scale),
            T::constant(material.amplification),
            T::constant(material.max_amplification),
        ]
    }

    #[inline(always)]
    fn eval<T: Real>(x: &[Point3<T>; 3], &[rest_area, amplification, most]: &[T; 3]) -> Eval<T, 3> {
        let (area, grad) = triangle::area_and_gradient(x);
        let c = area - rest_area;
        let amplified = T::one() + amplification * stretch(c, rest_area);
        Eval { c: c * amplified.select(amplified.simd_lt(most), most), grad }
    }

    /// As in [`SkinTension`](crate::SkinTension), longer by the largest amplification, which is in the value that is returned.
    #[inline(always)]
    fn inverse_reach_squared<T: Real>(x: &[Point3<T>; 3], &[rest_area, _, most]: &[T; 3]) -> Option<T> {
        Some(triangle::inverse_reach_squared(x, rest_area) / (most * most).simd_max(T::one()))
    }

    fn rest_size<T: Real>(&[rest_area, _, _]: &[T; 3]) -> T {
        rest_area
    }
}
