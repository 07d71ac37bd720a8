//! A body as a sum of energies: masses, constraints, gravity, and nothing of how a solver steps.

use std::sync::OnceLock;

use cutis_constraints::Scalar;
use cutis_solver::System;
use nalgebra::{Point3, Vector3};

use crate::field::Elastic;
use crate::floating;
use crate::newton::minimize;
use crate::objective::{Objective, Outer};
use crate::pattern::Pattern;
use crate::{Minimum, NewtonError, Options};

/// The energies of a system, in double precision and independent of it: the constraints as `½C²/α`, the masses, gravity.
///
/// Positions that are given and returned are in meters, in the caller's coordinates, one per vertex of the system.
/// Vertices with inverse mass 0 do not move.
pub struct Problem {
    pub(crate) elastic: Elastic,
    /// The vertices that can move, ascending.
    pub(crate) free: Vec<u32>,
    origin: Vector3<f64>,
    positions: Vec<Point3<f64>>,
    masses: Vec<f64>,
    pub(crate) gravity: Vector3<f64>,
    pattern: OnceLock<Result<Pattern, NewtonError>>,
}

impl Problem {
    /// What `system` is made of, with the parameters and stiffnesses that it stores, under the gravity given in m/s².
    ///
    /// # Errors
    /// A kind with a PBD stiffness, a constraint with compliance 0, no vertex that can move, a gravity that is not finite.
    pub fn of<T: Scalar>(system: &System<T>, gravity_m_s2: [f64; 3]) -> Result<Self, NewtonError> {
        for value in gravity_m_s2 {
            if !value.is_finite() {
                let (what, expected) = ("gravity_m_s2", "three finite numbers");
                return Err(NewtonError::Value { what, value, expected });
            }
        }
        let system = system.to_f64();
        let vertices = system.vertices();
        let masses: Vec<f64> = vertices.iter().map(|vertex| 1.0 / vertex.inverse_mass()).collect();
        let free: Vec<u32> =
            (0..).zip(&masses).filter(|(_, mass)| mass.is_finite()).map(|(v, _)| v).collect();
        if free.is_empty() {
            return Err(NewtonError::NothingMoves { vertices: vertices.len() });
        }
        Ok(Self {
            elastic: Elastic::of(&system)?,
            free,
            origin: system.origin().coords,
            positions: system.positions(),
            masses,
            gravity: Vector3::from(gravity_m_s2),
            pattern: OnceLock::new(),
        })
    }

    /// Positions that the system had, in m.
    pub fn positions(&self) -> &[Point3<f64>] {
        &self.positions
    }

    /// Mass of each vertex in kg; infinity for those that do not move.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Bytes that the factors of the Hessian take, the most of what a minimization needs.
    ///
    /// # Errors
    /// [`NewtonError::Memory`] if they cannot be counted.
    pub fn factor_bytes(&self) -> Result<usize, NewtonError> {
        Ok(self.pattern()?.factor_len().saturating_mul(size_of::<f64>()))
    }

    /// Number of vertices that can move.
    pub fn free_count(&self) -> usize {
        self.free.len()
    }

    /// `Σ ½C²/α − Σ m g·x` in J; the second sum is over the vertices that can move.
    ///
    /// # Panics
    /// If `x` has not one position per vertex.
    pub fn energy(&self, x: &[Point3<f64>]) -> f64 {
        let weight = |&v: &u32| self.masses[v as usize] * self.gravity.dot(&x[v as usize].coords);
        self.elastic.energy(&self.local(x)) - self.free.iter().map(weight).sum::<f64>()
    }

    /// `−∂U/∂x` of the elastic energy at each vertex, in N. At vertices that do not move it is the force that the body
    /// exerts on what holds them.
    ///
    /// # Panics
    /// If `x` has not one position per vertex.
    pub fn forces(&self, x: &[Point3<f64>]) -> Vec<Vector3<f64>> {
        self.elastic.at(&self.local(x)).gradient.into_iter().map(|gradient| -gradient).collect()
    }

    /// `x̃ = x + h·v + h²·g` of the vertices that can move, for a step of `h` seconds from the positions `x` and the
    /// velocities `v` (m/s). The others stay where `x` has them.
    ///
    /// # Panics
    /// If `x` or `v` has not one entry per vertex.
    pub fn predicted(&self, x: &[Point3<f64>], v: &[Vector3<f64>], h: f64) -> Vec<Point3<f64>> {
        assert_eq!((x.len(), v.len()), (self.masses.len(), self.masses.len()), "one entry per vertex");
        let mut predicted = x.to_vec();
        for &vertex in &self.free {
            let vertex = vertex as usize;
            predicted[vertex] += (v[vertex] + self.gravity * h) * h;
        }
        predicted
    }

    /// An implicit Euler step of `h` seconds: the minimizer of `Σ m/(2h²)|x − x̃|² + Σ ½C²/α`, from `start`. Gravity is in
    /// `x̃`, see [`predicted`](Self::predicted). Vertices that do not move stay where `start` has them.
    ///
    /// # Errors
    /// Lengths that differ, numbers that are not finite, an `h` of 0 or less, no memory, no convergence.
    pub fn step(
        &self,
        start: &[Point3<f64>],
        predicted: &[Point3<f64>],
        h: f64,
        options: &Options,
    ) -> Result<Minimum, NewtonError> {
        let inverse_h_squared = 1.0 / (h * h);
        if !(h > 0.0 && inverse_h_squared.is_finite() && inverse_h_squared > 0.0) {
            let (what, expected) = ("h", "a time above 0 s whose inverse square is a finite number above 0");
            return Err(NewtonError::Value { what, value: h, expected });
        }
        self.check("start", start)?;
        self.check("predicted", predicted)?;
        let outer = Outer::Inertia { predicted: self.local(predicted), inverse_h_squared };
        self.minimum(start, outer, options)
    }

    /// Static equilibrium under gravity: a minimum of [`energy`](Self::energy), from `start`. Vertices that do not move stay
    /// where `start` has them.
    ///
    /// # Errors
    /// As for [`step`](Self::step), and [`NewtonError::Floating`] for a part of the body that nothing holds.
    pub fn equilibrium(&self, start: &[Point3<f64>], options: &Options) -> Result<Minimum, NewtonError> {
        self.check("start", start)?;
        floating::refuse(self, &self.local(start))?;
        self.minimum(start, Outer::Gravity(self.gravity), options)
    }

    fn minimum(
        &self,
        start: &[Point3<f64>],
        outer: Outer,
        options: &Options,
    ) -> Result<Minimum, NewtonError> {
        options.check()?;
        let objective = Objective { problem: self, outer };
        let found = minimize(&objective, self.local(start), options)?;
        let mut positions = start.to_vec();
        for &v in &self.free {
            positions[v as usize] = found.state.x[v as usize] + self.origin;
        }
        let energy_j = self.energy(&positions);
        let (gradient, iterations, definite) = (found.gradient, found.iterations, found.definite);
        Ok(Minimum { positions, gradient, iterations, energy_j, definite })
    }

    /// Where the entries of the Hessian and of its factors are; found once.
    pub(crate) fn pattern(&self) -> Result<&Pattern, NewtonError> {
        let pattern = self.pattern.get_or_init(|| Pattern::of(self, &self.local(&self.positions)));
        pattern.as_ref().map_err(Clone::clone)
    }

    /// Positions relative to the system's origin, in which its constraints are stored.
    pub(crate) fn local(&self, x: &[Point3<f64>]) -> Vec<Point3<f64>> {
        assert_eq!(x.len(), self.masses.len(), "one position per vertex");
        x.iter().map(|x| x - self.origin).collect()
    }

    pub(crate) fn check(&self, what: &'static str, x: &[Point3<f64>]) -> Result<(), NewtonError> {
        if x.len() != self.masses.len() {
            return Err(NewtonError::Length { what, found: x.len(), expected: self.masses.len() });
        }
        match x.iter().position(|x| !x.iter().all(|x| x.is_finite())) {
            None => Ok(()),
            Some(vertex) => Err(NewtonError::NotFinite { vertex, what }),
        }
    }
}
