//! A body as a sum of energies: masses, constraints and gravity, without any stepping scheme.

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

/// The energies of a system in double precision: the constraints as `½C²/α`, the masses, gravity
/// and loads.
///
/// All positions in arguments and results are in meters, in the caller's coordinates, one per
/// vertex of the system. Vertices with inverse mass 0 are fixed. The others are free.
pub struct Problem {
    pub(crate) elastic: Elastic,
    /// The free vertices, ascending.
    pub(crate) free: Vec<u32>,
    origin: Vector3<f64>,
    positions: Vec<Point3<f64>>,
    masses: Vec<f64>,
    gravity: Vector3<f64>,
    /// Constant forces in N, one per vertex; empty if there are none.
    loads: Vec<Vector3<f64>>,
    pattern: OnceLock<Result<Pattern, NewtonError>>,
}

impl Problem {
    /// Returns the problem of `system`, with the parameters and stiffnesses that it stores, under a
    /// gravity in m/s².
    ///
    /// # Errors
    /// A kind with a PBD stiffness, a constraint with compliance 0, no free vertex, or a gravity
    /// that is not finite.
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
            loads: system.loads().to_vec(),
            pattern: OnceLock::new(),
        })
    }

    /// Returns the positions of the system, in m.
    pub fn positions(&self) -> &[Point3<f64>] {
        &self.positions
    }

    /// Returns the mass of each vertex in kg; infinity for fixed vertices.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Returns the size of the Hessian's factors in bytes. They are the largest part of the memory
    /// of a minimization.
    ///
    /// # Errors
    /// [`NewtonError::Memory`] if the factors cannot be indexed.
    pub fn factor_bytes(&self) -> Result<usize, NewtonError> {
        Ok(self.pattern()?.factor_len().saturating_mul(size_of::<f64>()))
    }

    /// Returns the number of free vertices.
    pub fn free_count(&self) -> usize {
        self.free.len()
    }

    /// Returns the weight `m g` of a free vertex plus its load, in N.
    pub(crate) fn weight(&self, vertex: usize) -> Vector3<f64> {
        self.gravity * self.masses[vertex] + self.load(vertex)
    }

    fn load(&self, vertex: usize) -> Vector3<f64> {
        self.loads.get(vertex).copied().unwrap_or_else(Vector3::zeros)
    }

    /// Returns `Σ ½C²/α − Σ (m g + load)·x` in J. The second sum is over the free vertices.
    ///
    /// # Panics
    /// If `x` does not have one position per vertex.
    pub fn energy(&self, x: &[Point3<f64>]) -> f64 {
        let weight = |&v: &u32| self.weight(v as usize).dot(&x[v as usize].coords);
        self.elastic.energy(&self.local(x)) - self.free.iter().map(weight).sum::<f64>()
    }

    /// Returns `−∂U/∂x` of the elastic energy at each vertex, in N. At fixed vertices it is the
    /// force that the body exerts on its support.
    ///
    /// # Panics
    /// If `x` does not have one position per vertex.
    pub fn forces(&self, x: &[Point3<f64>]) -> Vec<Vector3<f64>> {
        self.elastic.at(&self.local(x)).gradient.into_iter().map(|gradient| -gradient).collect()
    }

    /// Returns `x̃ = x + h·v + h²·(g + load/m)` of the free vertices, for a step of `h` seconds
    /// from the positions `x` with the velocities `v` (m/s). Fixed vertices stay at `x`.
    ///
    /// # Panics
    /// If `x` or `v` does not have one entry per vertex.
    pub fn predicted(&self, x: &[Point3<f64>], v: &[Vector3<f64>], h: f64) -> Vec<Point3<f64>> {
        assert_eq!((x.len(), v.len()), (self.masses.len(), self.masses.len()), "one entry per vertex");
        let mut predicted = x.to_vec();
        for &vertex in &self.free {
            let vertex = vertex as usize;
            predicted[vertex] +=
                (v[vertex] + self.gravity * h + self.load(vertex) * (h / self.masses[vertex])) * h;
        }
        predicted
    }

    /// Returns an implicit Euler step of `h` seconds: the minimizer of
    /// `Σ m/(2h²)|x − x̃|² + Σ ½C²/α`, found from `start`. Gravity and loads are part of `x̃`, see
    /// [`predicted`](Self::predicted). Fixed vertices stay at `start`.
    ///
    /// # Errors
    /// Different lengths, numbers that are not finite, an `h` of 0 or less, a lack of memory, or no
    /// convergence.
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

    /// Returns the static equilibrium under gravity and loads: a minimum of [`energy`](Self::energy), found
    /// from `start`. Fixed vertices stay at `start`.
    ///
    /// # Errors
    /// The errors of [`step`](Self::step), and [`NewtonError::Floating`] for a part of the body
    /// that nothing holds.
    pub fn equilibrium(&self, start: &[Point3<f64>], options: &Options) -> Result<Minimum, NewtonError> {
        self.check("start", start)?;
        floating::refuse(self, &self.local(start))?;
        self.minimum(start, Outer::Weight, options)
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

    /// Returns the sparsity pattern of the Hessian and of its factors, found at the first call.
    pub(crate) fn pattern(&self) -> Result<&Pattern, NewtonError> {
        let pattern = self.pattern.get_or_init(|| Pattern::of(self, &self.local(&self.positions)));
        pattern.as_ref().map_err(Clone::clone)
    }

    /// Returns the positions relative to the system's origin. The parameters of its constraints
    /// refer to these.
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
