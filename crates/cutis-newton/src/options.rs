//! What a minimization is asked for, and what it finds.

use nalgebra::Point3;

use crate::NewtonError;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The norm of the gradient over the norm of its scale, at which a minimum is taken as found.
    ///
    /// The gradient at a vertex is a sum of forces: of each constraint, and of gravity or inertia. Its scale there is the sum of the
    /// norms of these; so the quotient says how well the forces cancel, from 0 to 1, whatever the units. Both norms are the root of
    /// the sum of squares over the vertices that can move. The scale is the largest of those met on the way, so that a body which
    /// comes to rest without any force has a minimum too.
    ///
    /// Below what the rounding of positions leaves of the gradient there is nothing to be gained; what is known to no better than
    /// that is taken as found as well, and [`Minimum::gradient`] says how far it is.
    pub tolerance: f64,
    /// Iterations, each with one factorization at least.
    pub max_iterations: usize,
}

impl Default for Options {
    /// 1e-10, within 200 iterations.
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

/// A minimum that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum {
    /// Positions of all vertices in m, in the caller's coordinates.
    pub positions: Vec<Point3<f64>>,
    /// Relative gradient reached; see [`Options::tolerance`].
    pub gradient: f64,
    /// Iterations that it took.
    pub iterations: usize,
    /// Elastic and gravitational energy there, in J. Zero for gravity is at the caller's origin.
    pub energy_j: f64,
    /// Whether the Hessian, when it was last factorized, was positive definite: then this is a minimum and the only one near. If not,
    /// it may be a saddle, as a straight column under too heavy a load, or one of many, as of a body on a hinge.
    pub definite: bool,
}

/// Root of the sum of `|found − reference|²` over that of `|reference − start|²`: how far `found` is from the reference, as a share of
/// the way from `start` to it. Without unit; 0 where nothing differs, infinite where only the way is zero.
///
/// With the minimizer of an implicit step as reference and what the step started from it is the error E1; with other references the
/// same serves for errors in time and against closed forms. Vertices that do not move add nothing to either sum.
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
