//! The constraints of one kind, for any number type of their parameters.

use std::sync::Arc;

use cutis_constraints::Scalar;
use cutis_solver::{Kind, Stiffness};
use nalgebra::{Point3, Vector3};

use crate::RestError;

/// Constraints that are evaluated together. Their numbers stay in the nearest cache.
pub(crate) const GROUP: usize = 32;

/// Some constraints of one kind, evaluated together.
#[derive(Default)]
pub(crate) struct Evaluation {
    /// Positions of their vertices, one constraint after the other.
    pub places: Vec<Point3<f64>>,
    /// `C` and `1/α` of each constraint.
    pub c: Vec<f64>,
    pub stiffness: Vec<f64>,
    /// `∇C` at each vertex, one constraint after the other.
    pub gradients: Vec<Vector3<f64>>,
}

impl Evaluation {
    /// Evaluates these constraints of a kind, with all vertices at `x`. They have `N` vertices
    /// each, or any number if `N` is zero.
    pub fn of<const N: usize>(&mut self, kind: &dyn Constraints, constraints: &[u32], x: &[Point3<f64>]) {
        let arity = if N > 0 { N } else { kind.arity() };
        let indices = kind.indices();
        self.places.clear();
        for &k in constraints {
            let vertices = &indices[k as usize * arity..][..arity];
            self.places.extend(vertices.iter().map(|&v| x[v as usize]));
        }
        self.of_places(kind, constraints);
        self.stiffness.clear();
        kind.stiffness(constraints, &mut self.stiffness);
    }

    /// Evaluates these constraints with their own vertices at `places`.
    pub fn of_places(&mut self, kind: &dyn Constraints, constraints: &[u32]) {
        self.c.resize(constraints.len(), 0.0);
        self.gradients.resize(self.places.len(), Vector3::zeros());
        kind.evaluate(constraints, self);
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
    /// Writes `C` and `∇C` of some constraints, with their own vertices at the places in `to`.
    fn evaluate(&self, constraints: &[u32], to: &mut Evaluation);
    /// Appends `1/α` of some constraints.
    fn stiffness(&self, constraints: &[u32], to: &mut Vec<f64>);
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
        let Stiffness::Compliance(values) = self.as_ref().stiffness() else {
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

    fn evaluate(&self, constraints: &[u32], to: &mut Evaluation) {
        let Evaluation { places, c, gradients, .. } = to;
        self.as_ref().evaluate_all(constraints, places, c, gradients);
    }

    fn stiffness(&self, constraints: &[u32], to: &mut Vec<f64>) {
        let values = self.as_ref().stiffness().values();
        to.extend(constraints.iter().map(|&k| 1.0 / values.at(k as usize).to_f64()));
    }

    fn energy_change(&self, constraints: &[u32], from: &[f64], to: &[f64]) -> f64 {
        let values = self.as_ref().stiffness().values();
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

    /// The numbers of some constraints in the kind.
    fn in_kind(&self, constraints: &[u32]) -> Vec<u32> {
        constraints.iter().map(|&k| self.constraints[k as usize]).collect()
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

    fn evaluate(&self, constraints: &[u32], to: &mut Evaluation) {
        self.kind.evaluate(&self.in_kind(constraints), to);
    }

    fn stiffness(&self, constraints: &[u32], to: &mut Vec<f64>) {
        self.kind.stiffness(&self.in_kind(constraints), to);
    }

    fn energy_change(&self, constraints: &[u32], from: &[f64], to: &[f64]) -> f64 {
        self.kind.energy_change(&self.in_kind(constraints), from, to)
    }
}
