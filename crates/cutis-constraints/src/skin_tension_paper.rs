//! The paper form of the skin tension constraint (STC), which reproduces the published results in
//! PBD.

use nalgebra::Point3;

use crate::material::{MaterialError, check_not_negative, check_positive};
use crate::skin_tension::stretch;
use crate::{Constraint, Eval, Real, triangle};

/// Skin tension as published, for PBD only: the area error times an amplification, along the
/// gradient of the area.
///
/// ```text
/// C  = A − A0,  F = min(1 + β max(0, C)/A0, F_max)
/// returned: c = C F [m²],  grad = ∇A [m]
/// ```
///
/// In PBD with stiffness `s` per iteration this gives the published correction
/// `Δx_i = −s F C w_i ∇_iA / Σ w|∇A|²`. `F` multiplies the step. If `s·F` is above 1, the step
/// overshoots the rest area; above about 2 it diverges. `F` is therefore clamped to `F_max = 1/s`
/// ([`SkinTensionPaperMaterial::for_stiffness`]). A stiffness of 1 leaves no room for
/// amplification.
///
/// **`grad` is not the gradient of `c`** where `F > 1`, so this form has no energy. With XPBD use
/// [`SkinTension`](crate::SkinTension), which pulls with the same force and needs no clamp.
///
/// The parameters are `[A0, β, F_max]`. Degenerate shapes give the same results as in
/// [`SkinTension`](crate::SkinTension). Source: DOI 10.15701/kcgs.2025.31.4.21, Algorithm 1. The
/// gradient printed there has the wrong sign at the third vertex and the wrong length. This type
/// uses the correct gradient; see the errata page of the book.
#[derive(Clone, Copy, Debug)]
pub struct SkinTensionPaper;

/// The rest area and the amplification of a [`SkinTensionPaper`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinTensionPaperMaterial {
    /// Rest area divided by initial area, above 0. Below 1 the skin is under tension from the
    /// start.
    pub rest_area_scale: f64,
    /// `β`: the growth of the stiffness per relative stretch of the area, without unit; 0 or more.
    pub amplification: f64,
    /// `F_max`: the largest amplification, above 0. A stable run needs at most 1/stiffness.
    pub max_amplification: f64,
}

impl SkinTensionPaperMaterial {
    /// Returns the material whose amplification is stable in PBD with `stiffness` per iteration:
    /// `F_max = 1/stiffness`.
    ///
    /// # Errors
    /// - [`MaterialError::StiffnessOutOfRange`] unless `stiffness` is above 0 and at most 1;
    /// - [`MaterialError::NotPositive`] unless the scale is finite and above 0;
    /// - [`MaterialError::Negative`] unless the amplification is finite and 0 or more.
    pub fn for_stiffness(
        stiffness: f64,
        rest_area_scale: f64,
        amplification: f64,
    ) -> Result<Self, MaterialError> {
        if !(stiffness > 0.0 && stiffness <= 1.0) {
            return Err(MaterialError::StiffnessOutOfRange { value: stiffness });
        }
        check_positive("rest_area_scale of skin tension", "1", rest_area_scale)?;
        check_not_negative("amplification of skin tension", "1", amplification)?;
        Ok(Self { rest_area_scale, amplification, max_amplification: 1.0 / stiffness })
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

    /// Returns `1/r²`, where `r` is the reach of [`SkinTension`](crate::SkinTension) times the
    /// largest amplification, because the constraint's value contains the amplification.
    #[inline(always)]
    fn inverse_reach_squared<T: Real>(x: &[Point3<T>; 3], &[rest_area, _, most]: &[T; 3]) -> Option<T> {
        Some(triangle::inverse_reach_squared(x, rest_area) / (most * most).simd_max(T::one()))
    }

    fn rest_size<T: Real>(&[rest_area, _, _]: &[T; 3]) -> T {
        rest_area
    }
}
