//! The number types of a constraint: `f32`, `f64` and SIMD lanes of them.

use bytemuck::Pod;
use nalgebra::{RealField, SimdRealField};
use simba::simd::{SimdValue, WideF32x4, WideF64x4};

/// A number, or a vector of SIMD lanes, in which a constraint can be evaluated.
///
/// It is implemented for every [`SimdRealField`]: `f32`, `f64` and the SIMD types of `simba`. Write
/// formulas without branches (`simd_max`, `select`), so that one source serves all of them.
pub trait Real: SimdRealField + Copy {
    /// Returns `value` in every lane.
    fn constant(value: f64) -> Self {
        nalgebra::convert(value)
    }
}

impl<T: SimdRealField + Copy> Real for T {}

/// A single floating-point number: the type of stored positions.
pub trait Scalar: Real<SimdBool = bool> + RealField + Pod {
    /// Returns the same number as `f64`. The conversion is exact.
    fn to_f64(self) -> f64;
    /// Several numbers in SIMD lanes. An evaluation in lanes has the bits of one evaluation per
    /// lane.
    type Lanes: Real + SimdValue<Element = Self>;
    /// Lanes that hold `value(0)`, `value(1)`, …
    fn lanes(value: impl FnMut(usize) -> Self) -> Self::Lanes;
}

impl Scalar for f32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    type Lanes = WideF32x4;
    #[inline(always)]
    fn lanes(value: impl FnMut(usize) -> Self) -> WideF32x4 {
        std::array::from_fn::<_, 4, _>(value).into()
    }
}

impl Scalar for f64 {
    fn to_f64(self) -> f64 {
        self
    }
    type Lanes = WideF64x4;
    #[inline(always)]
    fn lanes(value: impl FnMut(usize) -> Self) -> WideF64x4 {
        std::array::from_fn::<_, 4, _>(value).into()
    }
}
