//! The constraints of one kind as energies `½C²/α`, evaluated in parallel. The bits do not depend
//! on the number of threads, because each result has its own place and the sums follow in a fixed
//! order.

use cutis_solver::{Kind, Stiffness, Values};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::NewtonError;

/// Least number of constraints per thread, so that distributing them costs less than the work.
const MIN_LEN: usize = 256;

/// The constraints of one kind and their compliances.
pub(crate) struct Elements {
    kind: Kind<f64>,
    compliance: Values<f64>,
}

/// Values and gradients of all constraints of a kind.
pub(crate) struct Evaluated {
    /// `C` of each constraint.
    pub values: Vec<f64>,
    /// `∇C` of each constraint, one vector per vertex.
    pub gradients: Vec<Vector3<f64>>,
}

impl Elements {
    /// Returns the constraints of a kind. Refuses those without a finite energy.
    pub fn new(kind: Kind<f64>) -> Result<Self, NewtonError> {
        let Stiffness::Compliance(compliance) = kind.stiffness().clone() else {
            return Err(NewtonError::PbdStiffness { kind: kind.name() });
        };
        let elements = Self { kind, compliance };
        for k in 0..elements.len() {
            let compliance = elements.compliance(k);
            if !(1.0 / compliance).is_finite() {
                let (kind, vertices) = (elements.kind.name(), elements.vertices(k).to_vec());
                return Err(NewtonError::Rigid { kind, vertices, compliance });
            }
        }
        Ok(elements)
    }

    /// Returns the vertices of one constraint.
    pub fn arity(&self) -> usize {
        self.kind.arity()
    }

    /// Returns the number of constraints.
    pub fn len(&self) -> usize {
        self.kind.len()
    }

    /// Returns the vertices of constraint `k`.
    pub fn vertices(&self, k: usize) -> &[u32] {
        &self.kind.indices()[k * self.arity()..][..self.arity()]
    }

    /// Returns `α` of constraint `k`.
    pub fn compliance(&self, k: usize) -> f64 {
        self.compliance.at(k)
    }

    /// Copies the positions of the vertices of constraint `k` to `places`.
    pub fn gather(&self, k: usize, x: &[Point3<f64>], places: &mut [Point3<f64>]) {
        for (place, &vertex) in places.iter_mut().zip(self.vertices(k)) {
            *place = x[vertex as usize];
        }
    }

    /// Returns `C` of constraint `k` with its vertices at `places`. Writes `∇C` to `gradients`.
    pub fn evaluate_one(&self, k: usize, places: &[Point3<f64>], gradients: &mut [Vector3<f64>]) -> f64 {
        self.kind.evaluate(k, places, gradients)
    }

    /// Evaluates all constraints, with the body's vertices at `x`.
    pub fn evaluate(&self, x: &[Point3<f64>]) -> Evaluated {
        let arity = self.arity();
        let mut values = vec![0.0; self.len()];
        let mut gradients = vec![Vector3::zeros(); self.len() * arity];
        values
            .par_iter_mut()
            .zip(gradients.par_chunks_mut(arity.max(1)))
            .enumerate()
            .with_min_len(MIN_LEN)
            .for_each_init(
                || vec![Point3::origin(); arity],
                |places, (k, (value, gradients))| {
                    self.gather(k, x, places);
                    *value = self.evaluate_one(k, places, gradients);
                },
            );
        Evaluated { values, gradients }
    }
}
