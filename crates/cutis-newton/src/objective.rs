//! The objective of a minimization: the elastic energy plus either gravity and loads or the inertia
//! of an implicit step.

use nalgebra::{Point3, Vector3};

use crate::Problem;
use crate::field::Field;

/// The term that is added to the elastic energy.
pub(crate) enum Outer {
    /// `−(m g + load)·x`: static equilibrium under gravity and loads.
    Weight,
    /// `m/(2h²)|x − x̃|²`: an implicit step. Gravity and loads are part of `x̃`.
    Inertia {
        /// `x̃` of each vertex, in the problem's local coordinates.
        predicted: Vec<Point3<f64>>,
        /// `1/h²` in 1/s².
        inverse_h_squared: f64,
    },
}

/// An energy to be minimized over the free vertices.
pub(crate) struct Objective<'a> {
    pub problem: &'a Problem,
    pub outer: Outer,
}

/// The objective at one placement of all vertices. Gradient, force sums and rounding cover the free
/// vertices only.
pub(crate) struct State {
    pub x: Vec<Point3<f64>>,
    pub field: Field,
    /// `∂U/∂x` of each free vertex, three numbers per vertex.
    pub gradient: Vec<f64>,
    /// For each free vertex, the sum of the norms of the terms of its gradient, in N.
    pub parts: Vec<f64>,
    /// Norm of the gradient, in N.
    pub norm: f64,
    /// Norm of `parts`, in N.
    pub scale: f64,
    /// Norm of the gradient that rounding alone can cause, in N.
    pub floor: f64,
    /// Change of the energy that rounding alone can cause, in J.
    pub noise: f64,
}

impl Objective<'_> {
    /// Returns the stiffness of the inertia of `mass` in N/m, which the outer energy adds to the
    /// diagonal of the Hessian.
    pub fn inertia(&self, mass: f64) -> f64 {
        match self.outer {
            Outer::Weight => 0.0,
            Outer::Inertia { inverse_h_squared, .. } => mass * inverse_h_squared,
        }
    }

    /// Returns the gradient of the outer energy at vertex `v`, and the size of its rounding error
    /// in units of the machine epsilon.
    fn outer_gradient(&self, v: usize, x: &Point3<f64>) -> (Vector3<f64>, f64) {
        let mass = self.problem.masses()[v];
        match &self.outer {
            Outer::Weight => (-self.problem.weight(v), 0.0),
            Outer::Inertia { predicted, inverse_h_squared } => {
                let stiffness = mass * inverse_h_squared;
                ((x - predicted[v]) * stiffness, stiffness * x.coords.norm())
            }
        }
    }

    /// Returns the objective and its derivatives at the placement `x`.
    pub fn at(&self, x: Vec<Point3<f64>>) -> State {
        let field = self.problem.elastic.at(&x);
        let free = &self.problem.free;
        let (mut gradient, mut parts) = (Vec::with_capacity(3 * free.len()), Vec::with_capacity(free.len()));
        let (mut square, mut scale, mut floor, mut noise) = (0.0, 0.0, 0.0, field.energy_rounding);
        for &v in free {
            let v = v as usize;
            let (outer, rounding) = self.outer_gradient(v, &x[v]);
            let total = field.gradient[v] + outer;
            let part = field.parts[v] + outer.norm();
            square += total.norm_squared();
            scale += part * part;
            floor += (field.rounding[v] + rounding).powi(2);
            noise += outer.norm() * x[v].coords.norm();
            gradient.extend(total.iter());
            parts.push(part);
        }
        let noise = f64::EPSILON * noise;
        let (norm, scale, floor) = (square.sqrt(), scale.sqrt(), f64::EPSILON * floor.sqrt());
        State { x, field, gradient, parts, norm, scale, floor, noise }
    }

    /// Returns the objective at `to` minus the objective at `from`, accurate to the rounding of the
    /// difference.
    pub fn difference(&self, from: &State, to: &State) -> f64 {
        let mut sum = self.problem.elastic.difference(&from.field, &to.field);
        for &v in &self.problem.free {
            let v = v as usize;
            let (mass, step) = (self.problem.masses()[v], to.x[v] - from.x[v]);
            sum += match &self.outer {
                Outer::Weight => -self.problem.weight(v).dot(&step),
                Outer::Inertia { predicted, inverse_h_squared } => {
                    let middle = (to.x[v] - predicted[v]) + (from.x[v] - predicted[v]);
                    0.5 * mass * inverse_h_squared * step.dot(&middle)
                }
            };
        }
        sum
    }

    /// Returns `from` with the free vertices displaced by `length · direction`.
    pub fn moved(&self, from: &State, direction: &[f64], length: f64) -> State {
        let mut x = from.x.clone();
        for (&v, step) in self.problem.free.iter().zip(direction.chunks_exact(3)) {
            x[v as usize] += Vector3::from_column_slice(step) * length;
        }
        self.at(x)
    }
}
