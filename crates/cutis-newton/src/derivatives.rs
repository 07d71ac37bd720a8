//! Comparison of gradients and Hessians with finite differences.

use nalgebra::{Point3, Vector3};

use crate::hessian::{assemble, extent};
use crate::objective::{Objective, Outer, State};
use crate::{NewtonError, Problem};

/// The largest relative deviations of the derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derivatives {
    /// Deviation of the slope of the energy along a direction from central differences, relative to
    /// the sum of the contributions of the forces.
    pub gradient: f64,
    /// Deviation of the change of the gradient along a direction from central differences, relative
    /// to the norm of the change.
    pub hessian: f64,
}

impl Problem {
    /// Compares the derivatives of elastic energy and gravity at `x` with central differences along
    /// `samples` pseudo-random directions.
    ///
    /// Correct derivatives deviate by the error of the differences: about 1e-9, and more for thin
    /// elements. If no element has a size from which a step can be derived, the deviations are NaN.
    ///
    /// # Errors
    /// A wrong length, a position that is not finite, or a lack of memory.
    pub fn check_derivatives(&self, x: &[Point3<f64>], samples: usize) -> Result<Derivatives, NewtonError> {
        self.check("x", x)?;
        let objective = Objective { problem: self, outer: Outer::Weight };
        let state = objective.at(self.local(x));
        let pattern = self.pattern()?;
        let mut factors = pattern.factors()?;
        assemble(&objective, &state, &pattern.places, 0.0, &mut factors);
        let step = f64::EPSILON.cbrt() * self.smallest_extent(&state);
        let mut found = Derivatives { gradient: 0.0, hessian: 0.0 };
        for sample in 0..samples {
            let direction: Vec<f64> = (0..state.gradient.len()).map(|n| noise(sample, n)).collect();
            let ahead = objective.moved(&state, &direction, step);
            let behind = objective.moved(&state, &direction, -step);
            let slope: f64 = state.gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
            let difference = objective.difference(&behind, &ahead) / (2.0 * step);
            let lengths = direction.chunks_exact(3).map(|d| Vector3::from_column_slice(d).norm());
            let scale: f64 = state.parts.iter().zip(lengths).map(|(part, length)| part * length).sum();
            found.gradient = larger(found.gradient, (slope - difference).abs(), scale);

            let product = factors.product(&direction);
            let (mut error, mut whole) = (0.0, 0.0);
            for n in 0..direction.len() {
                let change = (ahead.gradient[n] - behind.gradient[n]) / (2.0 * step);
                error += (product[n] - change).powi(2);
                whole += change.powi(2);
            }
            found.hessian = larger(found.hessian, error.sqrt(), whole.sqrt());
        }
        Ok(found)
    }

    /// Returns the size of the smallest element with a size above 0; infinite if there is none.
    fn smallest_extent(&self, state: &State) -> f64 {
        let mut smallest = f64::INFINITY;
        for (elements, evaluated) in self.elastic.kinds.iter().zip(&state.field.kinds) {
            let mut places = vec![Point3::origin(); elements.arity()];
            let gradients = evaluated.gradients.chunks_exact(elements.arity().max(1));
            for (k, (&c, gradients)) in evaluated.values.iter().zip(gradients).enumerate() {
                elements.gather(k, &state.x, &mut places);
                let extent = extent(&places, c, gradients);
                if extent > 0.0 {
                    smallest = smallest.min(extent);
                }
            }
        }
        smallest
    }
}

/// Returns the larger one of a deviation and `error/scale`. NaN counts as the largest.
fn larger(deviation: f64, error: f64, scale: f64) -> f64 {
    let ratio = if error == 0.0 { 0.0 } else { error / scale };
    if deviation.is_nan() || ratio <= deviation { deviation } else { ratio }
}

/// Returns a pseudo-random number from −1 to 1.
fn noise(sample: usize, n: usize) -> f64 {
    let mixed = (n as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (sample as u64 + 1).wrapping_mul(0xD1B5_4A32_D192_ED03);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((mixed ^ (mixed >> 32)) >> 11) as f64 / 2f64.powi(52) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_is_the_largest_deviation() {
        assert!(larger(f64::NAN, 0.1, 1.0).is_nan() && larger(0.1, f64::NAN, 1.0).is_nan());
        assert_eq!((larger(0.1, 0.0, 0.0), larger(0.1, 1.0, 2.0)), (0.1, 0.5));
    }
}
