//! The elastic energy of a body at one placement of its vertices: value, gradient and rounding
//! errors.

use cutis_solver::System;
use nalgebra::{Point3, Vector3};

use crate::elements::Evaluated;
use crate::{NewtonError, elements::Elements};

/// All constraints of a body.
pub(crate) struct Elastic {
    pub kinds: Vec<Elements>,
}

/// The values and gradients of all constraints at one placement, and their sums.
pub(crate) struct Field {
    /// Values and gradients, kind by kind.
    pub kinds: Vec<Evaluated>,
    /// `Σ ½C²/α` in J.
    pub energy: f64,
    /// `Σ (C/α)∇_vC` for each vertex, in N.
    pub gradient: Vec<Vector3<f64>>,
    /// `Σ |(C/α)∇_vC|` for each vertex, in N: the size of the terms that cancel in the gradient.
    pub parts: Vec<f64>,
    /// `Σ |∇_vC| R/α` for each vertex, in N, with the reach `R = Σ_i |x_i||∇_iC|`. Times the
    /// machine epsilon, this is the error of the gradient due to rounded positions.
    pub rounding: Vec<f64>,
    /// `Σ |C| R/α` in J. Times the machine epsilon, this is the error of the energy due to rounded
    /// positions.
    pub energy_rounding: f64,
}

impl Elastic {
    /// Returns the constraints of a system. Refuses kinds without a finite energy.
    pub fn of(system: &System<f64>) -> Result<Self, NewtonError> {
        let kinds = system.kinds().iter().map(|kind| Elements::new(kind.clone()));
        Ok(Self { kinds: kinds.collect::<Result<_, _>>()? })
    }

    /// Returns `Σ ½C²/α` at `x`, in J.
    pub fn energy(&self, x: &[Point3<f64>]) -> f64 {
        let mut energy = 0.0;
        for elements in &self.kinds {
            for (k, c) in elements.evaluate(x).values.into_iter().enumerate() {
                energy += 0.5 * c * (c / elements.compliance(k));
            }
        }
        energy
    }

    /// Returns the values and gradients at the placement `x`.
    pub fn at(&self, x: &[Point3<f64>]) -> Field {
        let mut field = Field {
            kinds: Vec::with_capacity(self.kinds.len()),
            energy: 0.0,
            gradient: vec![Vector3::zeros(); x.len()],
            parts: vec![0.0; x.len()],
            rounding: vec![0.0; x.len()],
            energy_rounding: 0.0,
        };
        for elements in &self.kinds {
            let evaluated = elements.evaluate(x);
            let gradients = evaluated.gradients.chunks_exact(elements.arity().max(1));
            for (k, (&c, gradients)) in evaluated.values.iter().zip(gradients).enumerate() {
                let (vertices, compliance) = (elements.vertices(k), elements.compliance(k));
                let multiplier = c / compliance;
                let reach =
                    |(&v, gradient): (&u32, &Vector3<f64>)| x[v as usize].coords.norm() * gradient.norm();
                let reach: f64 = vertices.iter().zip(gradients).map(reach).sum();
                field.energy += 0.5 * c * multiplier;
                field.energy_rounding += multiplier.abs() * reach;
                for (&v, gradient) in vertices.iter().zip(gradients) {
                    let (v, size) = (v as usize, gradient.norm());
                    field.gradient[v] += gradient * multiplier;
                    field.parts[v] += size * multiplier.abs();
                    field.rounding[v] += size * (reach / compliance);
                }
            }
            field.kinds.push(evaluated);
        }
        field
    }

    /// Returns the elastic energy at `to` minus that at `from`. It sums the differences of the
    /// constraints, so it is accurate to the rounding of the difference and not of the energies.
    pub fn difference(&self, from: &Field, to: &Field) -> f64 {
        let mut sum = 0.0;
        for (elements, (from, to)) in self.kinds.iter().zip(from.kinds.iter().zip(&to.kinds)) {
            for (k, (&from, &to)) in from.values.iter().zip(&to.values).enumerate() {
                sum += 0.5 * (to - from) * ((to + from) / elements.compliance(k));
            }
        }
        sum
    }
}
