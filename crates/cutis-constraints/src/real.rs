//! The number types that one constraint source serves: `f32`, `f64` and SIMD lanes of them.

use bytemuck::Pod;
use nalgebra::{RealField, SimdRealField};

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
}

impl Scalar for f32 {
    fn from_f64(value: f64) -> Self {
        value as f32
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Scalar for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
}
