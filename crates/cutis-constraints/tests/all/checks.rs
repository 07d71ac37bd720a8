//! Error measures. Each returns a relative error. Tests require it to be below a bound for the
//! correct input and above it for a wrong one.

use cutis_constraints::{Constraint, Eval};
use nalgebra::{Point3, Vector3};

use crate::shapes::Shape;

/// Largest norm among the vectors of a gradient: the reference for its errors.
pub fn gradient_size<const N: usize>(grad: &[Vector3<f64>; N]) -> f64 {
    grad.iter().map(Vector3::norm).fold(0.0, f64::max)
}

/// Error of `grad` against fourth-order central differences of `c`, relative to the differences.
pub fn gradient_error<const N: usize>(
    eval: impl Fn(&[Point3<f64>; N]) -> Eval<f64, N>,
    shape: &Shape<N>,
) -> f64 {
    let step = 1e-4 * shape.scale;
    let mut expected = [Vector3::zeros(); N];
    for i in 0..N {
        for axis in 0..3 {
            let c = |steps: f64| {
                let mut x = shape.x;
                x[i][axis] += steps * step;
                eval(&x).c
            };
            expected[i][axis] = (8.0 * (c(1.0) - c(-1.0)) - (c(2.0) - c(-2.0))) / (12.0 * step);
        }
    }
    let grad = eval(&shape.x).grad;
    let difference: [Vector3<f64>; N] = std::array::from_fn(|i| grad[i] - expected[i]);
    gradient_size(&difference) / gradient_size(&expected)
}

/// Norm of the sum of the gradients, relative to their size: the linear momentum that a projection
/// would add.
pub fn momentum_error<const N: usize>(grad: &[Vector3<f64>; N]) -> f64 {
    grad.iter().sum::<Vector3<f64>>().norm() / gradient_size(grad)
}

/// Norm of the torque of the gradients about the first point, relative to scale and gradient size.
pub fn torque_error<const N: usize>(grad: &[Vector3<f64>; N], shape: &Shape<N>) -> f64 {
    let torque: Vector3<f64> = (0..N).map(|i| (shape.x[i] - shape.x[0]).cross(&grad[i])).sum();
    torque.norm() / (shape.scale * gradient_size(grad))
}

/// Error of an `f32` evaluation against `f64` on the same numbers. It is the larger one of two
/// errors: `C` relative to gradient size times scale, and the gradient relative to its size.
pub fn single_error<const N: usize>(single: &Eval<f32, N>, double: &Eval<f64, N>, scale: f64) -> f64 {
    let size = gradient_size(&double.grad);
    let difference: [Vector3<f64>; N] =
        std::array::from_fn(|i| single.grad[i].cast::<f64>() - double.grad[i]);
    let in_value = (f64::from(single.c) - double.c).abs() / (size * scale);
    in_value.max(gradient_size(&difference) / size)
}

/// One projection `Δx_i = −w_i ∇_iC C / Σ w|∇C|²` (PBD, stiffness 1).
pub fn project<const N: usize>(
    x: &[Point3<f64>; N],
    inverse_mass: &[f64; N],
    eval: &Eval<f64, N>,
) -> [Point3<f64>; N] {
    let denominator: f64 = (0..N).map(|i| inverse_mass[i] * eval.grad[i].norm_squared()).sum();
    std::array::from_fn(|i| x[i] - eval.grad[i] * (inverse_mass[i] * eval.c / denominator))
}

/// The `eval` function of `C` with fixed parameters.
pub fn with<const N: usize, C: Constraint<N>>(
    params: C::Params<f64>,
) -> impl Fn(&[Point3<f64>; N]) -> Eval<f64, N> {
    move |x| C::eval(x, &params)
}
