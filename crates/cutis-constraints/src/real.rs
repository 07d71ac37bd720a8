//! The number types that one constraint source serves: `f32`, `f64` and SIMD lanes of them.

use bytemuck::Pod;
use nalgebra::{RealField, SimdRealField};
use simba::simd::{SimdValue, WideF32x4, WideF64x4};

/// A number, or a vector of lanes, in which a constraint can be evaluated.
///
/// Implemented for everything that is a [`SimdRealField`]: `f32`, `f64` and the wide types of `simba`. Write formulas
/// without branches (`simd_max`, `select`), so that one source serves all of them.
pub trait Real: SimdRealField + Copy {
    /// The constant `value` in every lane.
    fn constant(value: f64) -> Self {
        nalgebra::convert(value)
    }
}

impl<T: SimdRealField + Copy> Real for T {}

/// A single floating-point number: what positions are stored in.
pub trait Scalar: Real<SimdBool = bool> + RealField + Pod {
    /// Nearest value of this type.
    fn from_f64(value: f64) -> Self;
    /// Exact for `f32` and `f64`.
    fn to_f64(self) -> f64;
    /// Several numbers side by side, to evaluate as many constraints at once with the bits of one at a time.
    type Lanes: Real + SimdValue<Element = Self>;
    /// Lanes that hold `value(0)`, `value(1)`, …
    fn lanes(value: impl FnMut(usize) -> Self) -> Self::Lanes;
}

impl Scalar for f32 {
    fn from_f64(value: f64) -> Self {
        value as f32
    }
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
    fn from_f64(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
    type Lanes = WideF64x4;
    #[inline(always)]
    fn lanes(value: impl FnMut(usize) -> Self) -> WideF64x4 {
        std::array::from_fn::<_, 4, _>(value).into()
    }
}
