//! The state of a body: vertices, velocities, kinds of constraints, handles.

use std::sync::Arc;

use cutis_coloring::Groups;
use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{
    Energy, Kind, KinematicHandle, MemoryPart, Momentum, Residual, SolverError, Vertex, VertexBlock,
};

/// A body that is ready to be solved. [`SystemBuilder`](crate::SystemBuilder) builds and validates
/// it.
///
/// A kind that was not added takes no memory. Clones share the kinds.
#[derive(Clone)]
pub struct System<T: Scalar> {
    pub(crate) origin: Vector3<T>,
    pub(crate) vertices: Vec<Vertex<T>>,
    pub(crate) previous: Vec<Point3<T>>,
    pub(crate) velocities: Vec<Vector3<T>>,
    /// Constant forces in N, one per vertex; empty if there are none.
    pub(crate) loads: Vec<Vector3<T>>,
    pub(crate) kinds: Vec<Kind<T>>,
    pub(crate) handles: Vec<KinematicHandle<T>>,
    /// Vertex groups of the caller, used instead of greedy coloring.
    pub(crate) vertex_groups: Option<Arc<Groups>>,
}

impl<T: Scalar> System<T> {
    /// Returns the origin of the solver's coordinates in the caller's coordinates (m). Zero unless
    /// the body lies farther from the caller's origin than its own extent.
    pub fn origin(&self) -> Point3<T> {
        Point3::from(self.origin)
    }

    /// Returns the vertices, relative to [`origin`](Self::origin).
    pub fn vertices(&self) -> &[Vertex<T>] {
        &self.vertices
    }

    /// Returns all positions in the caller's coordinates (m). A vertex that never moved has exactly
    /// the position that the caller gave.
    pub fn positions(&self) -> Vec<Point3<T>> {
        self.vertices.iter().map(|vertex| vertex.position() + self.origin).collect()
    }

    /// Returns the positions of some vertices in the caller's coordinates (m), in the order of
    /// `vertices`.
    ///
    /// # Errors
    /// Returns [`SolverError::Vertex`] for a vertex that does not exist.
    pub fn positions_of(&self, vertices: &[u32]) -> Result<Vec<Point3<T>>, SolverError> {
        self.check_vertices(vertices)?;
        Ok(vertices.iter().map(|&v| self.vertices[v as usize].position() + self.origin).collect())
    }

    /// Checks that all vertices exist.
    ///
    /// # Errors
    /// Returns [`SolverError::Vertex`] for the first vertex that does not exist.
    pub fn check_vertices(&self, vertices: &[u32]) -> Result<(), SolverError> {
        let count = self.vertices.len();
        match vertices.iter().find(|&&vertex| vertex as usize >= count) {
            None => Ok(()),
            Some(&vertex) => Err(SolverError::Vertex {
                vertex: vertex as usize,
                what: "index",
                value: vertex.into(),
                expected: "the index of a vertex of the body",
            }),
        }
    }

    /// Returns the velocities in m/s.
    pub fn velocities(&self) -> &[Vector3<T>] {
        &self.velocities
    }

    /// Returns the kinds of constraints in the order in which they were added.
    pub fn kinds(&self) -> &[Kind<T>] {
        &self.kinds
    }

    /// Returns the handles in the order in which they were added.
    pub fn handles(&self) -> &[KinematicHandle<T>] {
        &self.handles
    }

    /// Returns the vertices and the kinds, for a [`ConstraintColor`](crate::ConstraintColor).
    pub fn projection_parts(&mut self) -> (&mut [Vertex<T>], &[Kind<T>]) {
        (&mut self.vertices, &self.kinds)
    }

    /// Returns the same body in double precision, for reference solutions. All numbers stay the
    /// same, and a solver computes with smaller rounding errors.
    pub fn to_f64(&self) -> System<f64> {
        System {
            origin: self.origin.map(T::to_f64),
            vertices: self.vertices.iter().map(|vertex| vertex.to_f64()).collect(),
            previous: self.previous.iter().map(|position| position.map(T::to_f64)).collect(),
            velocities: self.velocities.iter().map(|velocity| velocity.map(T::to_f64)).collect(),
            loads: self.loads.iter().map(|load| load.map(T::to_f64)).collect(),
            kinds: self.kinds.iter().map(|kind| kind.to_f64()).collect(),
            handles: self.handles.iter().map(KinematicHandle::to_f64).collect(),
            vertex_groups: self.vertex_groups.clone(),
        }
    }

    pub(crate) fn block(&mut self) -> VertexBlock<'_, T> {
        VertexBlock {
            vertices: &mut self.vertices,
            previous: &mut self.previous,
            velocities: &mut self.velocities,
            loads: &self.loads,
            columns: None,
        }
    }

    pub(crate) fn restore(
        &mut self,
        positions: &[Point3<T>],
        velocities: &[Vector3<T>],
    ) -> Result<(), SolverError> {
        let expected = self.vertices.len();
        for (what, found) in [("positions", positions.len()), ("velocities", velocities.len())] {
            if found != expected {
                return Err(SolverError::VertexLength { what, found, expected });
            }
        }
        check_finite("coordinate", positions.iter().map(|position| &position.coords))?;
        check_finite("velocity", velocities.iter())?;
        for (vertex, position) in self.vertices.iter_mut().zip(positions) {
            vertex.set_position(position - self.origin);
        }
        self.velocities.copy_from_slice(velocities);
        Ok(())
    }

    pub(crate) fn set_state(
        &mut self,
        vertices: &[Vertex<T>],
        velocities: impl ExactSizeIterator<Item = Vector3<T>>,
    ) -> Result<(), SolverError> {
        let expected = self.vertices.len();
        for (what, found) in [("vertices", vertices.len()), ("velocities", velocities.len())] {
            if found != expected {
                return Err(SolverError::VertexLength { what, found, expected });
            }
        }
        self.vertices.copy_from_slice(vertices);
        for (old, new) in self.velocities.iter_mut().zip(velocities) {
            *old = new;
        }
        Ok(())
    }

    pub(crate) fn move_handles(&mut self, time_s: f64) {
        for handle in &self.handles {
            handle.advance(&mut self.vertices, time_s);
        }
    }

    /// Returns the residual of each kind at the present positions.
    pub fn residuals(&self) -> Vec<Residual> {
        self.kinds.iter().map(|kind| kind.residual(&self.vertices)).collect()
    }

    /// Checks that every violated constraint can act at the present positions. A constraint counts
    /// as violated if its value is more than `tolerance` times its rest size.
    ///
    /// # Errors
    /// Returns [`SolverError::Collapsed`] for the first violated constraint without a gradient.
    pub fn check_collapsed(&self, tolerance: f64) -> Result<(), SolverError> {
        for set in &self.kinds {
            if let Some((k, ratio)) = set.collapsed(&self.vertices, tolerance) {
                let vertices = set.indices().chunks_exact(set.arity()).nth(k).unwrap_or_default().to_vec();
                return Err(SolverError::Collapsed { kind: set.name(), vertices, ratio });
            }
        }
        Ok(())
    }

    /// Returns mass in kg, position in the caller's coordinates and velocity of each vertex with
    /// finite mass.
    fn masses(&self) -> impl Iterator<Item = (f64, Vector3<f64>, Vector3<f64>)> {
        self.vertices.iter().zip(&self.velocities).filter_map(|(vertex, velocity)| {
            let inverse_mass = vertex.inverse_mass().to_f64();
            let x = vertex.position().coords.map(T::to_f64) + self.origin.map(T::to_f64);
            (inverse_mass > 0.0).then(|| (1.0 / inverse_mass, x, velocity.map(T::to_f64)))
        })
    }

    /// Returns the energy at the present positions and velocities, with gravity in m/s².
    pub fn energy(&self, gravity_m_s2: [f64; 3]) -> Energy {
        let gravity = Vector3::from(gravity_m_s2);
        let (mut kinetic_j, mut gravity_j) = (0.0, 0.0);
        for (mass, x, velocity) in self.masses() {
            kinetic_j += 0.5 * mass * velocity.norm_squared();
            gravity_j -= mass * gravity.dot(&x);
        }
        let elastic_j = self.kinds.iter().map(|kind| kind.elastic_energy(&self.vertices)).sum();
        Energy { kinetic_j, elastic_j, gravity_j, load_j: self.load_energy() }
    }

    /// Returns the potential energy of the loads on the moving vertices, `−Σ load·x` in J.
    fn load_energy(&self) -> f64 {
        let origin = self.origin.map(T::to_f64);
        let work = |(vertex, load): (&Vertex<T>, &Vector3<T>)| {
            let x = vertex.position().coords.map(T::to_f64) + origin;
            if vertex.inverse_mass() > T::zero() { load.map(T::to_f64).dot(&x) } else { 0.0 }
        };
        -self.vertices.iter().zip(&self.loads).map(work).sum::<f64>()
    }

    /// Returns the linear momentum, the angular momentum about the center of mass, and the center
    /// of mass.
    pub fn momentum(&self) -> Momentum {
        let (mut total, mut center, mut linear) = (0.0, Vector3::zeros(), Vector3::zeros());
        for (mass, x, velocity) in self.masses() {
            total += mass;
            center += x * mass;
            linear += velocity * mass;
        }
        if total > 0.0 {
            center /= total;
        }
        let angular = self.masses().map(|(mass, x, v)| (x - center).cross(&v) * mass).sum();
        Momentum { linear, angular, center: Point3::from(center) }
    }

    /// Returns the largest distance in meters between a vertex and its position in `reference`
    /// (caller's coordinates).
    ///
    /// # Errors
    /// Returns [`SolverError::VertexLength`] unless `reference` has one position per vertex.
    pub fn max_displacement<S: Scalar>(&self, reference: &[Point3<S>]) -> Result<f64, SolverError> {
        let (found, expected) = (reference.len(), self.vertices.len());
        if found != expected {
            return Err(SolverError::VertexLength { what: "reference", found, expected });
        }
        let origin = self.origin.map(T::to_f64);
        let distance = |(vertex, reference): (&Vertex<T>, &Point3<S>)| {
            (vertex.position().coords.map(T::to_f64) + origin - reference.coords.map(S::to_f64)).norm()
        };
        Ok(self.vertices.iter().zip(reference).map(distance).fold(0.0, f64::max))
    }

    /// Returns the memory of the vertices, of each kind, and of loads and handles if there are any.
    pub fn bytes(&self) -> Vec<MemoryPart> {
        let vertices = size_of_val(self.vertices.as_slice())
            + size_of_val(self.previous.as_slice())
            + size_of_val(self.velocities.as_slice());
        let mut parts = vec![MemoryPart { name: "vertices", bytes: vertices }];
        // A body may have a kind twice.
        for kind in &self.kinds {
            match parts.iter_mut().find(|part| part.name == kind.name()) {
                Some(part) => part.bytes += kind.bytes(),
                None => parts.push(MemoryPart { name: kind.name(), bytes: kind.bytes() }),
            }
        }
        if !self.loads.is_empty() {
            parts.push(MemoryPart { name: "loads", bytes: size_of_val(self.loads.as_slice()) });
        }
        if !self.handles.is_empty() {
            let bytes = self.handles.iter().map(KinematicHandle::bytes).sum();
            parts.push(MemoryPart { name: "handles", bytes });
        }
        parts
    }
}

/// Returns an error for the first vector with a component that is not finite.
pub(crate) fn check_finite<'a, S: Scalar>(
    what: &'static str,
    vectors: impl Iterator<Item = &'a Vector3<S>>,
) -> Result<(), SolverError> {
    for (vertex, vector) in vectors.enumerate() {
        if let Some(value) = vector.iter().map(|value| value.to_f64()).find(|value| !value.is_finite()) {
            return Err(SolverError::Vertex { vertex, what, value, expected: "a finite number" });
        }
    }
    Ok(())
}
