//! The constraints of one kind, for any number type of their parameters.

use std::sync::Arc;

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

impl Evaluation {
    /// Takes the places of some vertices.
    #[inline]
    fn gather(&mut self, vertices: &[u32], x: &[Point3<f64>]) {
        if self.places.len() != vertices.len() {
            self.places.resize(vertices.len(), Point3::origin());
            self.gradients.resize(vertices.len(), Vector3::zeros());
        }
        for (place, &v) in self.places.iter_mut().zip(vertices) {
            *place = x[v as usize];
        }
    }
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
    /// Evaluates a constraint with its own vertices at the places in `to`.
    fn evaluate_at(&self, k: usize, to: &mut Evaluation);
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
        to.gather(&set.indices()[k * arity..][..arity], x);
        self.evaluate_at(k, to);
    }

    #[inline]
    fn evaluate_at(&self, k: usize, to: &mut Evaluation) {
        let set = self.as_ref();
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

/// Some constraints of a kind, whose vertices have other numbers.
pub(crate) struct Subset {
    kind: Arc<dyn Constraints>,
    /// Numbers of the constraints in the kind.
    constraints: Vec<u32>,
    /// The new numbers of their vertices, one constraint after the other.
    indices: Vec<u32>,
}

impl Subset {
    /// These constraints, with `number` for each vertex.
    pub fn of(kind: Arc<dyn Constraints>, constraints: Vec<u32>, number: &[u32]) -> Self {
        let arity = kind.arity();
        let vertices = constraints.iter().flat_map(|&k| &kind.indices()[k as usize * arity..][..arity]);
        let indices = vertices.map(|&v| number[v as usize]).collect();
        Self { kind, constraints, indices }
    }
}

impl Constraints for Subset {
    fn arity(&self) -> usize {
        self.kind.arity()
    }

    fn len(&self) -> usize {
        self.constraints.len()
    }

    fn indices(&self) -> &[u32] {
        &self.indices
    }

    fn check(&self) -> Result<(), RestError> {
        self.kind.check()
    }

    fn evaluate(&self, k: usize, x: &[Point3<f64>], to: &mut Evaluation) {
        let arity = self.kind.arity();
        to.gather(&self.indices[k * arity..][..arity], x);
        self.evaluate_at(k, to);
    }

    fn evaluate_at(&self, k: usize, to: &mut Evaluation) {
        self.kind.evaluate_at(self.constraints[k] as usize, to);
    }

    fn gradients(&self, k: usize, places: &[Point3<f64>], to: &mut [Vector3<f64>]) {
        self.kind.gradients(self.constraints[k] as usize, places, to);
    }

    fn energy_change(&self, constraints: &[u32], from: &[f64], to: &[f64]) -> f64 {
        let constraints: Vec<u32> = constraints.iter().map(|&k| self.constraints[k as usize]).collect();
        self.kind.energy_change(&constraints, from, to)
    }
}
