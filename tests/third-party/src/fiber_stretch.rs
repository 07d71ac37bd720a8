//! The fiber stretch constraint: a tetrahedron keeps its length along a fiber.

use cutis_constraints::{Constraint, Eval, Real};
use nalgebra::{Point3, Vector3};

/// A constraint that keeps the length of a tetrahedron along a fiber.
///
/// ```text
/// f   = F a = b1 e1 + b2 e2 + b3 e3,  e_i = x_i − x_0
/// C   = |f| − s                                       [1]
/// ∇iC = b_i f/|f|,  ∇0C = −(b1 + b2 + b3) f/|f|       [1/m]
/// ```
///
/// `F` is the deformation gradient and `a` is the direction of the fiber at rest. `b = D⁻¹ a`,
/// where the columns of `D` are the edges at rest. The parameters are `[b1, b2, b3, s]`, with `b`
/// in 1/m. The gradient is zero where the fiber has shrunk to a point.
#[derive(Clone, Copy, Debug)]
pub struct FiberStretch;

/// The direction and the rest stretch of a [`FiberStretch`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fiber {
    /// Direction at rest. Its length may be any number but 0.
    pub direction: [f64; 3],
    /// Rest length divided by initial length. Below 1 the fiber contracts.
    pub rest_stretch: f64,
}

impl Constraint<4> for FiberStretch {
    const NAME: &'static str = "fiber_stretch";
    const WGSL: &'static str = include_str!("fiber_stretch.wgsl");
    type Params<T: Real> = [T; 4];
    type Material = Fiber;

    fn from_rest<T: Real>([x0, x1, x2, x3]: &[Point3<T>; 4], fiber: &Fiber) -> [T; 4] {
        let (e1, e2, e3) = (x1 - x0, x2 - x0, x3 - x0);
        let a = Vector3::from(fiber.direction).normalize().map(T::constant);
        let determinant = e1.dot(&e2.cross(&e3));
        let b = [e2.cross(&e3), e3.cross(&e1), e1.cross(&e2)].map(|normal| a.dot(&normal) / determinant);
        [b[0], b[1], b[2], T::constant(fiber.rest_stretch)]
    }

    #[inline(always)]
    fn eval<T: Real>([x0, x1, x2, x3]: &[Point3<T>; 4], &[b1, b2, b3, rest]: &[T; 4]) -> Eval<T, 4> {
        let f = (x1 - x0) * b1 + (x2 - x0) * b2 + (x3 - x0) * b3;
        let length = f.dot(&f).simd_sqrt();
        let zero = T::zero();
        let direction = f * (T::one() / length).select(length.simd_gt(zero), zero);
        let grad = [direction * -(b1 + b2 + b3), direction * b1, direction * b2, direction * b3];
        Eval { c: length - rest, grad }
    }

    fn rest_size<T: Real>(&[_, _, _, rest]: &[T; 4]) -> T {
        rest
    }
}

#[cfg(test)]
cutis_conformance::conformance!(
    FiberStretch,
    4,
    cutis_conformance::Subject::new([
        Fiber { direction: [1.0, 0.0, 0.0], rest_stretch: 1.0 },
        Fiber { direction: [1.0, -2.0, 0.5], rest_stretch: 0.8 },
    ])
);
