//! The trait of all constraints: a value and its gradient over `N` vertices.

use std::fmt::Debug;

use nalgebra::{Point3, Vector3};
use num_traits::Zero;

use crate::Real;

/// Value and gradient of a constraint over `N` vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eval<T, const N: usize> {
    /// `C(x)` in the constraint's own unit: m for a length, m² for an area, m³ for a volume.
    pub c: T,
    /// `∂C/∂x_i` for each vertex. All zero where the gradient is undefined.
    pub grad: [Vector3<T>; N],
}

/// Value and gradient of a constraint whose gradients have the length 1, before the division that
/// gives them this length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitGradients<T, const N: usize> {
    /// `C(x)`, as in [`Eval`].
    pub c: T,
    /// Vectors in the directions of the gradients. All have the same length.
    pub along: [Vector3<T>; N],
    /// The length of these vectors. Where it is 0, the gradients are undefined.
    pub length: T,
}

impl<T: Real, const N: usize> UnitGradients<T, N> {
    /// Divides by the length. The gradients are 0 where the length is.
    #[inline(always)]
    pub fn eval(self) -> Eval<T, N> {
        let zero = T::zero();
        let inverse = (T::one() / self.length).select(self.length.simd_gt(zero), zero);
        let mut grad = self.along;
        for i in 0..N {
            grad[i] *= inverse;
        }
        Eval { c: self.c, grad }
    }
}

/// The parameters of one constraint: a flat array of `K` scalars. Storage, upload to a GPU and SIMD
/// lanes therefore need no derive, no padding rule and no `unsafe`.
pub trait Params<T>: Copy + Debug + Send + Sync + PartialEq + AsRef<[T]> {
    /// Number of scalars.
    const LEN: usize;
    /// Builds the array. `f(k)` gives scalar number `k`.
    fn from_fn(f: impl FnMut(usize) -> T) -> Self;
    /// Returns the scalars of many constraints, one constraint after the other: the layout of a GPU
    /// buffer.
    fn flat(many: &[Self]) -> &[T];
}

impl<T: Copy + Debug + Send + Sync + PartialEq + Zero, const K: usize> Params<T> for [T; K] {
    const LEN: usize = K;
    // Not `std::array::from_fn`, which may stay a call in the loops with SIMD lanes.
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> T) -> Self {
        let mut scalars = [T::zero(); K];
        for (k, scalar) in scalars.iter_mut().enumerate() {
            *scalar = f(k);
        }
        scalars
    }
    fn flat(many: &[Self]) -> &[T] {
        many.as_flattened()
    }
}

/// A scalar constraint over the positions of `N` vertices.
///
/// # Theory
/// A constraint measures how far `N` points are from their rest shape. Its value `C(x)` is 0 at
/// rest, **positive when stretched and negative when compressed**. With a compliance `α` (inverse
/// stiffness, supplied by the solver) it stands for this energy and these forces:
///
/// ```text
/// U(x) = C(x)² / (2α)            [J]
/// f_i  = −∂U/∂x_i = −(C/α) ∇_iC  [N]
/// ```
///
/// If `C` has the unit `u`, then `∇C` has the unit `u/m` and `α` has `u²/J`. With inverse masses
/// `w`, a projection moves the points along `w_i ∇_iC`:
///
/// ```text
/// PBD    Δx_i = −s · w_i ∇_iC · C / Σ_j w_j |∇_jC|²              s in 0 to 1
/// XPBD   Δλ   = (−C − α̃ λ) / (Σ_j w_j |∇_jC|² + α̃),  α̃ = α/h²
///        Δx_i = w_i ∇_iC Δλ                                       h: substep, λ = 0 at its start
/// ```
///
/// Sources: Müller et al., *Position Based Dynamics*, J. Vis. Commun. Image R. 18 (2007), eq. 5–9;
/// Macklin et al., *XPBD*, MIG 2016, eq. 17–18.
///
/// # Rules for an implementation
/// - `∇C` is the exact gradient of `C`. Check it against finite differences. A wrong length of `∇C`
///   is not visible in a picture, but it makes the stiffness depend on the unit of length.
/// - If `C` depends only on the shape, and not on its place or orientation, the gradients sum to
///   zero and have no torque: `Σ ∇_iC = 0` and `Σ x_i × ∇_iC = 0`. A projection then conserves
///   momentum.
/// - Where the gradient is undefined (coincident points, a flat triangle) it is zero, and `C` is
///   finite.
/// - Do not branch on a value. Compute both sides and `select`, so that SIMD lanes can differ (see
///   [`Real`]).
/// - Use no absolute epsilon and no absolute length. Compare with the size of the element.
/// - Mark `eval` and its helpers `#[inline(always)]`, and write out the elements of an array in
///   place of `map`. A closure that stays a call changes no result, but its SIMD lanes are slow.
///
/// # Parameters are flat arrays
/// [`Params`](Constraint::Params) is `[T; K]`, not a struct. The same formula then reads the
/// parameters as `f32`, as `f64` or as lanes gathered from several constraints. A solver only needs
/// `K` to store, upload and transpose them. Destructure them by name at the head of `eval`.
///
/// # The shader
/// [`WGSL`](Constraint::WGSL) is the twin of `eval` for the GPU. It has two parts:
/// - `struct Params` with the scalars of the parameters in the same order, all of them `f32`;
/// - `fn eval(x: array<vec3f, N>, p: Params) -> Eval`. The solver defines `N` and `Eval` (`c: f32`,
///   `grad: array<vec3f, N>`) above it.
///
/// A software device gives the bits of the CPU if the shader does the same operations in the same
/// order as the Rust code, under these rules:
/// - Use only `+ − * /`, `sqrt`, `dot`, `cross`, `length`, `abs`, `floor`, `clamp`, `min`, `max`
///   and `select`. `normalize`, `mix`, `fma`, `pow` and the transcendental functions round
///   differently.
/// - Replace a denominator that may be zero by `select` before the division.
/// - Drivers turn `a·b + a·c` into `a·(b + c)`. Where the products of a sum share a factor, factor
///   it out in both languages, or pass the terms through `exact` (a scalar) or `exact3` (a vector).
///   These functions return their argument and no optimizer can see through them.
/// - If the type implements [`inverse_reach_squared`](Constraint::inverse_reach_squared), `eval`
///   sets the private variable of that name. If it implements
///   [`unit_gradients`](Constraint::unit_gradients), `eval` sets `unit_gradients = true`, and the
///   vectors and their length in the private variables `along` and `along_length`.
///
/// The test battery in the crate `cutis-conformance` compares the two languages.
///
/// # Example
/// A point that should stay on the plane `z = height`:
/// ```
/// use cutis_constraints::{Constraint, Eval, Real};
/// use nalgebra::{Point3, Vector3};
///
/// struct OnPlane;
///
/// impl Constraint<1> for OnPlane {
///     const NAME: &'static str = "on plane";
///     const WGSL: &'static str = "
///         struct Params { height: f32 }
///         fn eval(x: array<vec3f, N>, p: Params) -> Eval {
///             return Eval(x[0].z - p.height, array<vec3f, N>(vec3f(0.0, 0.0, 1.0)));
///         }";
///     type Params<T: Real> = [T; 1];
///     type Material = ();
///     fn from_rest<T: Real>([point]: &[Point3<T>; 1], _: &()) -> [T; 1] {
///         [point.z]
///     }
///     fn eval<T: Real>([point]: &[Point3<T>; 1], &[height]: &[T; 1]) -> Eval<T, 1> {
///         Eval { c: point.z - height, grad: [Vector3::z()] }
///     }
///     fn rest_size<T: Real>(&[height]: &[T; 1]) -> T {
///         height
///     }
/// }
///
/// let eval = OnPlane::eval(&[Point3::new(0.0, 0.0, 0.5)], &[0.2]);
/// assert_eq!(eval.c, 0.3);
/// ```
pub trait Constraint<const N: usize>: Send + Sync + 'static {
    /// Name in reports, benchmarks and tests.
    const NAME: &'static str;
    /// `struct Params` and `fn eval` in WGSL: the twin of [`eval`](Self::eval).
    const WGSL: &'static str;
    /// The scalars of one constraint, `[T; K]`.
    type Params<T: Real>: Params<T>;
    /// Material values that the caller chooses when a constraint is built from its rest shape, such
    /// as a rest-area scale.
    type Material;
    /// Returns the parameters of a constraint with the rest shape `x` (positions in meters).
    fn from_rest<T: Real>(x: &[Point3<T>; N], material: &Self::Material) -> Self::Params<T>;
    /// Returns `C` and `∇C` at `x` (positions in meters).
    fn eval<T: Real>(x: &[Point3<T>; N], params: &Self::Params<T>) -> Eval<T, N>;
    /// Returns `C` and `∇C` at `x` if all gradients have the length 1 wherever they are defined.
    /// `None` by default. [`eval`](Self::eval) is then the [`eval`](UnitGradients::eval) of the
    /// result. A projection takes `Σ w|∇C|²` as `Σ w` and divides once, by `length·Σ w`, which
    /// saves time. It has no [limit](Self::inverse_reach_squared).
    #[inline(always)]
    fn unit_gradients<T: Real>(x: &[Point3<T>; N], params: &Self::Params<T>) -> Option<UnitGradients<T, N>> {
        let _ = (x, params);
        None
    }
    /// Returns `1/r²` in 1/m², where `r` is the longest distance that a projection may move along
    /// the gradient at `x`. `None` means no limit, and is the default.
    ///
    /// A projection moves to the point where the tangent of `C` meets zero. If the gradient of a
    /// collapsed element is tiny, that point is far outside the element, where the tangent says
    /// nothing about `C`. `r` is a multiple of the larger of the present size and the rest size. It
    /// therefore never limits an element that has kept its shape. In a collapsed element it makes
    /// the steps as small as the gradient. A constraint that is linear along its gradient, such as
    /// a length, needs no limit.
    fn inverse_reach_squared<T: Real>(x: &[Point3<T>; N], params: &Self::Params<T>) -> Option<T> {
        let _ = (x, params);
        None
    }
    /// True in the lanes where the limit certainly does not act, because `C` is `c`. If it is true
    /// in all lanes, [`inverse_reach_squared`](Self::inverse_reach_squared) is not computed. It is
    /// never true by default. The bits of a projection do not depend on it.
    fn is_in_reach<T: Real>(c: T, params: &Self::Params<T>) -> T::SimdBool {
        let _ = (c, params);
        T::zero().simd_gt(T::zero())
    }
    /// Returns the reference size of residuals: rest length (m), rest area (m²) or rest volume
    /// (m³). Zero means that the rest shape has no size; `SystemBuilder` refuses to take parameters
    /// from such a shape.
    fn rest_size<T: Real>(params: &Self::Params<T>) -> T;
}
