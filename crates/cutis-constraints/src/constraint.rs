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
    /// The scalars of many constraints, one after the other: what a GPU is given.
    fn flat(many: &[Self]) -> &[T];
}

impl<T: Copy + Debug + Send + Sync + PartialEq, const K: usize> Params<T> for [T; K] {
    const LEN: usize = K;
    fn from_fn(f: impl FnMut(usize) -> T) -> Self {
        std::array::from_fn(f)
    }
    fn flat(many: &[Self]) -> &[T] {
        many.as_flattened()
    }
}

/// A scalar constraint over the positions of `N` vertices.
///
/// # Theory
/// A constraint measures how far `N` points are from where they should be, as one number `C(x)`: 0 at rest, **positive
/// when stretched, negative when compressed**. With a compliance `α` (inverse stiffness, supplied by the solver) it
/// stands for the energy and the forces
///
/// ```text
/// U(x) = C(x)² / (2α)            [J]
/// f_i  = −∂U/∂x_i = −(C/α) ∇_iC  [N]
/// ```
///
/// If `C` has the unit `u`, then `∇C` has `u/m` and `α` has `u²/J`. With inverse masses `w`, a projection moves the
/// points along `w_i ∇_iC`:
///
/// ```text
/// PBD    Δx_i = −s · w_i ∇_iC · C / Σ_j w_j |∇_jC|²              s in 0 to 1
/// XPBD   Δλ   = (−C − α̃ λ) / (Σ_j w_j |∇_jC|² + α̃),  α̃ = α/h²
///        Δx_i = w_i ∇_iC Δλ                                       h: substep, λ = 0 at its start
/// ```
///
/// Sources: Müller et al., *Position Based Dynamics*, J. Vis. Commun. Image R. 18 (2007), eq. 5–9; Macklin et al.,
/// *XPBD*, MIG 2016, eq. 17–18.
///
/// # Rules for an implementation
/// - `∇C` is the exact gradient of `C`. Check it against finite differences: a wrong length of `∇C` goes unnoticed in a
///   picture but makes the stiffness depend on the unit of length.
/// - If `C` depends on the shape alone, not on where it lies or how it is turned, the gradients sum to zero and make
///   no torque: `Σ ∇_iC = 0` and `Σ x_i × ∇_iC = 0`. Then a projection conserves momentum.
/// - Where the gradient is undefined (coincident points, a flat triangle) it is zero, and `C` is finite.
/// - No branch on a value: compute both sides and `select`, so that SIMD lanes can differ (see [`Real`]).
/// - No absolute epsilon and no absolute length: compare with the element's own size.
///
/// # Parameters are flat arrays
/// [`Params`](Constraint::Params) is `[T; K]`, not a struct: the same formula then reads them as `f32`, as `f64` or as
/// lanes gathered from several constraints, and a solver can store, upload and transpose them knowing only `K`.
/// Destructure them by name at the head of `eval`.
///
/// # The same in WGSL
/// [`WGSL`](Constraint::WGSL) is the twin of `eval` for the GPU: `struct Params` with the scalars of the parameters in their
/// order (`f32`, nothing else), and `fn eval(x: array<vec3f, N>, p: Params) -> Eval`, where `N` and `Eval` (`c: f32`,
/// `grad: array<vec3f, N>`) stand above it already. With the operations `+ − * /`, `sqrt`, `dot`, `cross`, `length`, `abs`,
/// `floor`, `clamp`, `min`, `max` and `select`, in the same order as in Rust, a software device gives the bits of the CPU.
/// `normalize`, `mix`, `fma`, `pow` and the transcendental functions differ. A denominator that may be zero is replaced by
/// `select` before the division. Drivers turn `a·b + a·c` into `a·(b + c)`: where a sum of products shares a factor, take it out
/// in both languages, or put the terms through `exact` (a scalar) or `exact3` (a vector), which return what they are given and
/// which no optimizer sees through. The battery of the crate `cutis-conformance` holds one against the other.
///
/// A constraint with an [`inverse_reach_squared`](Constraint::inverse_reach_squared) sets the private variable of that name in `eval`.
///
/// # Example
/// A constraint of one's own: a point that should stay on the plane `z = height`.
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
    /// `struct Params` and `fn eval`, the twin of [`eval`](Self::eval) in WGSL.
    const WGSL: &'static str;
    /// Per-constraint scalars, `[T; K]`.
    type Params<T: Real>: Params<T>;
    /// What the caller chooses when a constraint is built from its rest shape (for example a rest-area scale).
    type Material;
    /// Parameters of a constraint whose rest shape is `x` (positions in meters).
    fn from_rest<T: Real>(x: &[Point3<T>; N], material: &Self::Material) -> Self::Params<T>;
    /// `C` and `∇C` at `x` (positions in meters).
    fn eval<T: Real>(x: &[Point3<T>; N], params: &Self::Params<T>) -> Eval<T, N>;
    /// `1/r²` in 1/m², where `r` is the longest way on which a projection follows the gradient at `x`; none for no limit.
    ///
    /// A projection goes where the tangent of `C` meets zero. If the gradient of a collapsed element is tiny, that is far
    /// outside of the element, where the tangent says nothing. `r` is some times the larger of the element's present and rest
    /// size: it never acts on an element that has not lost its shape, and where it acts, steps get as small as the gradient.
    /// A constraint that is linear along its gradient, such as a length, needs none.
    fn inverse_reach_squared<T: Real>(x: &[Point3<T>; N], params: &Self::Params<T>) -> Option<T> {
        let _ = (x, params);
        None
    }
    /// The size that `C` is compared with in residuals: rest length (m), rest area (m²), rest volume (m³). Zero stands for a
    /// rest shape without size, from which `SystemBuilder` takes no parameters.
    fn rest_size<T: Real>(params: &Self::Params<T>) -> T;
}
