//! The constraints of one kind, for any number type of their parameters.

use cutis_constraints::Scalar;
use cutis_solver::{Kind, Stiffness};
use nalgebra::{Point3, Vector3};

use crate::RestError;

/// Memory for one constraint.
#[derive(Default)]
pub(crate) struct Evaluation {
    /// Positions of its vertices.
    pub places: Vec<Point3<f64>>,
    /// `C`, `1/α` and `∇C`.
    pub c: f64,
    pub stiffness: f64,
    pub gradients: Vec<Vector3<f64>>,
}

/// All constraints of one kind. A body reads those of a system, and has no copy of them.
pub(crate) trait Constraints: Send + Sync {
    fn arity(&self) -> usize;
    fn len(&self) -> usize;
    /// The vertices of all constraints, one constraint after the other.
    fn indices(&self) -> &[u32];
    /// Checks that every constraint has a finite energy where it is not met.
    ///
    /// # Errors
    /// [`RestError::PbdStiffness`], [`RestError::Rigid`].
    fn check(&self) -> Result<(), RestError>;
    /// Evaluates a constraint with all vertices at `x`.
    fn evaluate(&self, k: usize, x: &[Point3<f64>], to: &mut Evaluation);
    /// The gradients of a constraint with its own vertices at `places`.
    fn gradients(&self, k: usize, places: &[Point3<f64>], to: &mut [Vector3<f64>]);
    /// The change of the energy of some constraints, whose `C` changes `from` some values `to`
    /// others.
    fn energy_change(&self, constraints: &[u32], from: &[f64], to: &[f64]) -> f64;
}

impl<T: Scalar> Constraints for Kind<T> {
    fn arity(&self) -> usize {
        self.as_ref().arity()
    }

    fn len(&self) -> usize {
        self.as_ref().len()
    }

    fn indices(&self) -> &[u32] {
        self.as_ref().indices()
    }

    fn check(&self) -> Result<(), RestError> {
        let kind = self.name();
        let Stiffness::Compliance(values) = self.stiffness() else {
            return Err(RestError::PbdStiffness { kind });
        };
        for constraint in 0..self.as_ref().len() {
            let compliance = values.at(constraint).to_f64();
            if !(compliance > 0.0 && (1.0 / compliance).is_finite()) {
                return Err(RestError::Rigid { kind, constraint, compliance });
            }
        }
        Ok(())
    }

    fn evaluate(&self, k: usize, x: &[Point3<f64>], to: &mut Evaluation) {
        let set = self.as_ref();
        let arity = set.arity();
        if to.places.len() != arity {
            to.places.resize(arity, Point3::origin());
            to.gradients.resize(arity, Vector3::zeros());
        }
        for (place, &v) in to.places.iter_mut().zip(&set.indices()[k * arity..][..arity]) {
            *place = x[v as usize];
        }
        to.c = set.evaluate(k, &to.places, &mut to.gradients);
        to.stiffness = 1.0 / set.stiffness().values().at(k).to_f64();
    }

    fn gradients(&self, k: usize, places: &[Point3<f64>], to: &mut [Vector3<f64>]) {
        self.as_ref().evaluate(k, places, to);
    }

    fn energy_change(&self, constraints: &[u32], from: &[f64], to: &[f64]) -> f64 {
        let values = self.stiffness().values();
        let change = |((&k, from), to): ((&u32, &f64), &f64)| {
            0.5 * (to - from) * (to + from) / values.at(k as usize).to_f64()
        };
        constraints.iter().zip(from).zip(to).map(change).sum()
    }
}
