//! Options and results of a minimization.

use nalgebra::Point3;

use crate::NewtonError;

/// When a minimization stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Relative gradient at which a minimum counts as found, from 0 to below 1.
    ///
    /// The gradient at a vertex is a sum of forces: of each constraint, and of gravity or inertia.
    /// The scale at a vertex is the sum of the norms of these forces. The relative gradient is the
    /// norm of the gradient over the norm of the scale. It measures how well the forces cancel,
    /// from 0 to 1, in any units. Both norms are the root of the sum of squares over the free
    /// vertices. The largest scale during the iterations counts, so that a body that comes to rest
    /// without any force has a minimum too.
    ///
    /// A gradient below the rounding error of the positions cannot be improved and also counts as
    /// found. [`Minimum::gradient`] is the value that was reached.
    pub tolerance: f64,
    /// Largest number of iterations. Each factorizes the Hessian at least once.
    pub max_iterations: usize,
}

impl Default for Options {
    /// A tolerance of 1e-10 within 200 iterations.
    fn default() -> Self {
        Self { tolerance: 1e-10, max_iterations: 200 }
    }
}

impl Options {
    pub(crate) fn check(&self) -> Result<(), NewtonError> {
        if self.tolerance >= 0.0 && self.tolerance < 1.0 {
            return Ok(());
        }
        let expected = "a number from 0 to below 1";
        Err(NewtonError::Value { what: "tolerance", value: self.tolerance, expected })
    }
}

/// The result of a minimization.
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum {
    /// Positions of all vertices in m, in the caller's coordinates.
    pub positions: Vec<Point3<f64>>,
    /// The relative gradient that was reached; see [`Options::tolerance`].
    pub gradient: f64,
    /// Number of iterations.
    pub iterations: usize,
    /// Elastic and gravitational energy in J. The gravitational energy is zero at the caller's
    /// origin.
    pub energy_j: f64,
    /// Whether the Hessian was positive definite at the last factorization. If so, the result is an
    /// isolated minimum. If not, it may be a saddle, such as a straight column under too large a
    /// load, or one of many minima, such as a body on a hinge.
    pub definite: bool,
}

/// Returns the distance of `found` from `reference`, relative to the displacement from `start` to
/// `reference`: the root of `Σ |found − reference|²` over `Σ |reference − start|²`.
///
/// The result has no unit. It is 0 if `found` equals the reference, and infinite if only the
/// displacement is zero. Fixed vertices add nothing to either sum. With the minimizer of an
/// implicit step as the reference and the start of the step, this is the error E1. Other references
/// give errors in time or against closed forms.
///
/// # Panics
/// If the lengths differ.
pub fn relative_rms(found: &[Point3<f64>], reference: &[Point3<f64>], start: &[Point3<f64>]) -> f64 {
    assert!(found.len() == reference.len() && start.len() == reference.len(), "one position per vertex");
    let square = |a: &[Point3<f64>], b: &[Point3<f64>]| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum()
    };
    let (error, way) = (square(found, reference), square(reference, start));
    if error == 0.0 { 0.0 } else { (error / way).sqrt() }
}
