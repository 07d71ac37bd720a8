//! The extension point: one trait, `N` vertices, a value and its gradient.

use std::fmt::Debug;

use nalgebra::{Point3, Vector3};

use crate::Real;

/// Value and gradient of a constraint over `N` vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eval<T, const N: usize> {
    /// `C(x)`, in the constraint's own unit (m for a length, m² for an area, m³ for a volume).
    pub c: T,
    /// `∂C/∂x_i` for each vertex; all zero where the gradient is undefined.
    pub grad: [Vector3<T>; N],
}

/// The numbers of one constraint: a flat array of `K` scalars, so that storage, upload and SIMD lanes need no
/// derive, no padding rule and no `unsafe`.
pub trait Params<T>: Copy + Debug + Send + Sync + PartialEq + AsRef<[T]> {
    /// Number of scalars.
    const LEN: usize;
    /// Builds the array from its `k`-th scalars.
    fn from_fn(f: impl FnMut(usize) -> T) -> Self;
}

impl<T: Copy + Debug + Send + Sync + PartialEq, const K: usize> Params<T> for [T; K] {
    const LEN: usize = K;
    fn from_fn(f: impl FnMut(usize) -> T) -> Self {
        std::array::from_fn(f)
    }
}

/// A scalar constraint over the positions of `N` vertices.
///
/// `eval` must be written without branches on values (see [`Real`]), must return a zero gradient where the gradient
/// is undefined, and must not use any absolute epsilon or absolute length.
pub trait Constraint<const N: usize>: Send + Sync + 'static {
    /// Name in reports, benchmarks and tests.
    const NAME: &'static str;
    /// Per-constraint scalars, `[T; K]`.
    type Params<T: Real>: Params<T>;
    /// What the caller chooses when a constraint is built from its rest shape (for example a rest-area scale).
    type Material;
    /// Parameters of a constraint whose rest shape is `x` (positions in metres).
    fn from_rest<T: Real>(x: &[Point3<T>; N], material: &Self::Material) -> Self::Params<T>;
    /// `C` and `∇C` at `x`.
    fn eval<T: Real>(x: &[Point3<T>; N], params: &Self::Params<T>) -> Eval<T, N>;
    /// The size that `C` is compared with in residuals: rest length, rest volume, rest area.
    fn rest_size<T: Real>(params: &Self::Params<T>) -> T;
}
