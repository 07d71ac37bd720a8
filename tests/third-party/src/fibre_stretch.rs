//! Fibre stretch: a tetrahedron keeps its length along a fibre.

use cutis_constraints::{Constraint, Eval, Real};
use nalgebra::{Point3, Vector3};

/// A tetrahedron keeps its length along a fibre.
///
/// ```text
/// f   = F a = b1 e1 + b2 e2 + b3 e3,  e_i = x_i − x_0
/// C   = |f| − s                                       [1]
/// ∇iC = b_i f/|f|,  ∇0C = −(b1 + b2 + b3) f/|f|       [1/m]
/// ```
///
/// `F` is the deformation gradient and `a` the direction of the fibre at rest; `b = D⁻¹ a`, where the columns of `D` are the edges
/// at rest. Parameters `[b1, b2, b3, s]`, `b` in 1/m. The gradient is zero where the fibre has shrunk to a point.
#[derive(Clone, Copy, Debug)]
pub struct FibreStretch;

/// How a [`FibreStretch`] is built from its rest shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fibre {
    /// Direction at rest; of any length but 0.
    pub direction: [f64; 3],
    /// Rest length over initial length: below 1 the fibre contracts.
    pub rest_stretch: f64,
}

impl Constraint<4> for FibreStretch {
    const NAME: &'static str = "fibre_stretch";
    const WGSL: &'static str = include_str!("fibre_stretch.wgsl");
    type Params<T: Real> = [T; 4];
    type Material = Fibre;

    fn from_rest<T: Real>([x0, x1, x2, x3]: &[Point3<T>; 4], fibre: &Fibre) -> [T; 4] {
        let (e1, e2, e3) = (x1 - x0, x2 - x0, x3 - x0);
        let a = Vector3::from(fibre.direction).normalize().map(T::constant);
        let determinant = e1.dot(&e2.cross(&e3));
        let b = [e2.cross(&e3), e3.cross(&e1), e1.cross(&e2)].map(|normal| a.dot(&normal) / determinant);
        [b[0], b[1], b[2], T::constant(fibre.rest_stretch)]
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
    FibreStretch,
    4,
    cutis_conformance::Subject::new([
        Fibre { direction: [1.0, 0.0, 0.0], rest_stretch: 1.0 },
        Fibre { direction: [1.0, -2.0, 0.5], rest_stretch: 0.8 },
    ])
);
