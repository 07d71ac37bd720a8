//! The number types of a constraint: `f32`, `f64` and SIMD lanes of them.

use bytemuck::Pod;
use nalgebra::{RealField, SimdRealField, Vector3};

use crate::lanes::{run_f32, run_f64};
use crate::{LaneTask, SimdLevel};

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

/// The cross product `a × b`.
///
/// It has the bits of [`Vector3::cross`], but is always inlined. A call would keep the lanes of a
/// SIMD register in memory.
#[inline(always)]
pub fn cross<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// A single floating-point number: the type of stored positions.
pub trait Scalar: Real<SimdBool = bool> + RealField + Pod {
    /// Returns the same number as `f64`. The conversion is exact.
    fn to_f64(self) -> f64;
    /// Runs a task with SIMD lanes of this number type. The result does not depend on the level.
    fn in_lanes<K: LaneTask<Self>>(level: SimdLevel, task: K);
}

impl Scalar for f32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn in_lanes<K: LaneTask<Self>>(level: SimdLevel, task: K) {
        run_f32(level, task);
    }
}

impl Scalar for f64 {
    fn to_f64(self) -> f64 {
        self
    }
    #[inline]
    fn in_lanes<K: LaneTask<Self>>(level: SimdLevel, task: K) {
        run_f64(level, task);
    }
}
