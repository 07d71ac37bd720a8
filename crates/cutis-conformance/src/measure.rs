//! Deviations between two evaluations of a constraint.

use cutis_constraints::{Constraint, Eval, Scalar};
use nalgebra::Vector3;

use crate::{Case, SCALES};

/// Returns the largest norm among the vectors of a gradient; NaN if any is NaN.
pub(crate) fn length<const N: usize>(grad: &[Vector3<f64>; N]) -> f64 {
    grad.iter().map(Vector3::norm).fold(0.0, largest)
}

/// Returns the larger number; NaN if one of them is NaN.
pub(crate) fn largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// Returns an evaluation converted to `f64`.
pub(crate) fn double<T: Scalar, const N: usize>(eval: &Eval<T, N>) -> Eval<f64, N> {
    Eval { c: eval.c.to_f64(), grad: eval.grad.map(|g| g.map(T::to_f64)) }
}

/// Returns the numbers of an evaluation: the value, then the gradients.
pub(crate) fn numbers<T: Scalar, const N: usize>(eval: &Eval<T, N>) -> impl Iterator<Item = T> {
    std::iter::once(eval.c).chain(eval.grad.iter().flatten().copied())
}

/// The largest and the mean of many errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Deviation {
    /// The largest error; NaN if any is NaN.
    pub(crate) worst: f64,
    /// The root mean square of the errors.
    pub(crate) rms: f64,
}

impl Deviation {
    /// Returns the deviation of these errors.
    pub(crate) fn of(errors: impl IntoIterator<Item = f64>) -> Self {
        let (mut worst, mut sum, mut count) = (0.0, 0.0, 0.0);
        for error in errors {
            worst = largest(error, worst);
            sum += error * error;
            count += 1.0;
        }
        Self { worst, rms: if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 } }
    }
}

/// Allowed deviation of a device from `f64`, as a multiple of that of the CPU in `f32`.
pub const ALLOWANCE: f64 = 4.0;

/// Smallest assumed deviation of the CPU, in ulp. Where the CPU is exact by chance, a device still
/// divides to 2.5 ulp and computes square roots by two such operations (Vulkan 1.3, "Precision and
/// Operation of SPIR-V Instructions").
const FLOOR: f64 = 2.0;

/// Returns the allowed deviation of a device where the CPU deviates by `cpu`. `ulp` is the size of
/// an ulp.
pub(crate) fn tolerance(cpu: Deviation, ulp: f64) -> Deviation {
    let of = |cpu: f64| ALLOWANCE * largest(cpu, FLOOR * ulp);
    Deviation { worst: of(cpu.worst), rms: of(cpu.rms) }
}

/// Returns a deviation divided by its tolerance.
pub(crate) fn excess(found: Deviation, tolerance: Deviation) -> f64 {
    largest(found.worst / tolerance.worst, found.rms / tolerance.rms)
}

/// Errors of value and gradient at one length scale, relative to [`Case::size`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Errors {
    /// Length scale in m.
    pub(crate) scale: f64,
    /// Errors of the value.
    pub(crate) value: Deviation,
    /// Errors of the gradient.
    pub(crate) gradient: Deviation,
}

/// Returns the deviations of `found` from the evaluation in `f64`, per scale. `found` has one
/// evaluation for each case.
pub(crate) fn errors<C: Constraint<N>, T: Scalar, const N: usize>(
    cases: &[Case<N>],
    found: &[Eval<T, N>],
) -> Vec<Errors> {
    let of_scale = |scale: f64| {
        let (mut value, mut gradient) = (Vec::new(), Vec::new());
        for (case, found) in cases.iter().zip(found).filter(|(case, _)| case.scale == scale) {
            let (exact, found, size) = (case.eval::<C, f64>(), double(found), case.size::<C>());
            value.push((found.c - exact.c).abs() / size);
            let difference = std::array::from_fn::<_, N, _>(|i| found.grad[i] - exact.grad[i]);
            gradient.push(length(&difference) * scale / size);
        }
        Errors { scale, value: Deviation::of(value), gradient: Deviation::of(gradient) }
    };
    SCALES.map(of_scale).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nan_is_reported() {
        assert!(largest(f64::NAN, 1.0).is_nan() && largest(1.0, f64::NAN).is_nan());
        let deviation = Deviation::of([1.0, f64::NAN, 2.0]);
        assert!(deviation.worst.is_nan() && deviation.rms.is_nan());
        assert_eq!(Deviation::of([3.0, 4.0]), Deviation { worst: 4.0, rms: f64::sqrt(12.5) });
    }
}
