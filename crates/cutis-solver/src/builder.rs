//! Construction of a system. All input is checked here, so that a step needs no checks.

use std::collections::HashSet;
use std::sync::Arc;

use cutis_coloring::Groups;
use cutis_constraints::{Constraint, Scalar};
use nalgebra::{Point3, Vector3};

use crate::batch::Batch;
use crate::system::check_finite;
use crate::{Handle, Kind, KinematicHandle, SolverError, Stiffness, System, Vertex};

/// Collects vertices, kinds of constraints and handles into a [`System`].
pub struct SystemBuilder<T: Scalar> {
    system: System<T>,
    /// Vertices that a handle moves.
    kinematic: HashSet<u32>,
}

impl<T: Scalar> SystemBuilder<T> {
    /// Starts a system with positions in meters and inverse masses in 1/kg (0 = fixed), one of
    /// each per vertex. Their number type may differ from the solver's.
    ///
    /// If the body is farther from zero along an axis than its own extent, the solver subtracts the
    /// center of the body on this axis. Positions in single precision then keep their accuracy.
    /// [`System::positions`] returns the caller's coordinates exactly.
    ///
    /// # Errors
    /// Returns an error for arrays of different lengths, more than `u32::MAX` vertices, a
    /// coordinate that is not finite, or an inverse mass that is negative or not finite.
    pub fn new<S: Scalar, M: Scalar>(
        positions: &[Point3<S>],
        inverse_masses: &[M],
    ) -> Result<Self, SolverError> {
        Self::with_origin(origin_of(positions), positions, inverse_masses)
    }

    /// Starts a system as [`new`](Self::new) does, but never subtracts a center. Use it for a part
    /// of a body: the part then steps with the same bits as within the whole body, and a run that
    /// is continued from a saved state has the bits of an uninterrupted run.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Self::new).
    pub fn in_place<S: Scalar, M: Scalar>(
        positions: &[Point3<S>],
        inverse_masses: &[M],
    ) -> Result<Self, SolverError> {
        Self::with_origin(Vector3::zeros(), positions, inverse_masses)
    }

    fn with_origin<S: Scalar, M: Scalar>(
        origin: Vector3<f64>,
        positions: &[Point3<S>],
        inverse_masses: &[M],
    ) -> Result<Self, SolverError> {
        let count = positions.len();
        if u32::try_from(count).is_err() {
            return Err(SolverError::TooMany { what: "vertices", count });
        }
        if inverse_masses.len() != count {
            let what = "inverse_masses";
            return Err(SolverError::VertexLength { what, found: inverse_masses.len(), expected: count });
        }
        let refuse =
            |vertex, what, value, expected| Err(SolverError::Vertex { vertex, what, value, expected });
        for (vertex, position) in positions.iter().enumerate() {
            for value in position.coords.iter().map(|&value| T::constant(value.to_f64()).to_f64()) {
                if !value.is_finite() {
                    return refuse(vertex, "coordinate", value, "a finite number");
                }
            }
        }
        let origin: Vector3<T> = origin.map(T::constant);
        let shift = origin.map(T::to_f64);
        let mut vertices = Vec::with_capacity(count);
        for (vertex, (position, inverse_mass)) in positions.iter().zip(inverse_masses).enumerate() {
            let inverse_mass = T::constant(inverse_mass.to_f64());
            let value = inverse_mass.to_f64();
            if !(value.is_finite() && value >= 0.0) {
                return refuse(vertex, "inverse mass", value, "a finite number, 0 or more");
            }
            let local = (position.coords.map(S::to_f64) - shift).map(T::constant);
            vertices.push(Vertex::new(Point3::from(local), inverse_mass));
        }
        let previous = vertices.iter().map(Vertex::position).collect();
        let velocities = vec![Vector3::zeros(); count];
        let system = System {
            origin,
            vertices,
            previous,
            velocities,
            loads: Vec::new(),
            kinds: Vec::new(),
            handles: Vec::new(),
            vertex_groups: None,
        };
        Ok(Self { system, kinematic: HashSet::new() })
    }

    /// Sets the initial velocities in m/s, one per vertex. Without this call all are zero.
    ///
    /// # Errors
    /// Returns an error for a wrong length or a velocity that is not finite.
    pub fn velocities(mut self, velocities: &[Vector3<T>]) -> Result<Self, SolverError> {
        let (found, expected) = (velocities.len(), self.system.vertices.len());
        if found != expected {
            return Err(SolverError::VertexLength { what: "velocities", found, expected });
        }
        check_finite("velocity", velocities.iter())?;
        self.system.velocities.copy_from_slice(velocities);
        Ok(self)
    }

    /// Sets constant forces on the vertices in N, as [`System::set_loads`] does. Without this call
    /// there are none.
    ///
    /// # Errors
    /// Returns an error for a wrong length or a load that is not finite.
    pub fn loads(mut self, loads: &[Vector3<T>]) -> Result<Self, SolverError> {
        self.system.set_loads(loads)?;
        Ok(self)
    }

    /// Adds all constraints of the kind `C`, with the vertices and parameters of each constraint,
    /// their stiffness and their color groups. The solver projects kinds in the order in which
    /// they are added.
    ///
    /// # Errors
    /// Returns an error for arrays of different lengths, a vertex that does not exist or appears
    /// twice in a constraint, a parameter that is not finite, a stiffness out of range, or groups
    /// in which two constraints of one color share a vertex.
    pub fn add<C: Constraint<N>, const N: usize>(
        mut self,
        indices: &[[u32; N]],
        params: &[C::Params<T>],
        stiffness: Stiffness<T>,
        groups: &Groups,
    ) -> Result<Self, SolverError> {
        let batch = Batch::<C, N, T, _>::new(self.system.vertices.len(), indices, params, stiffness, groups)?;
        self.system.kinds.push(Arc::new(batch));
        Ok(self)
    }

    /// Adds constraints as [`add`](Self::add) does, with parameters computed from the positions
    /// that were given to [`new`](Self::new).
    ///
    /// # Errors
    /// Returns the errors of [`add`](Self::add), and [`SolverError::RestShape`] for a rest shape
    /// of size zero. For a spring of length zero on purpose, use [`add`](Self::add).
    pub fn add_from_rest<C: Constraint<N>, const N: usize>(
        self,
        indices: &[[u32; N]],
        material: &C::Material,
        stiffness: Stiffness<T>,
        groups: &Groups,
    ) -> Result<Self, SolverError> {
        let vertices = &self.system.vertices;
        let mut params = Vec::with_capacity(indices.len());
        for (constraint, tuple) in indices.iter().enumerate() {
            let mut x = [Point3::origin(); N];
            for (corner, &vertex) in x.iter_mut().zip(tuple) {
                let (kind, vertex_count) = (C::NAME, vertices.len());
                let error = SolverError::VertexOutOfRange { kind, constraint, vertex, vertex_count };
                *corner = vertices.get(vertex as usize).ok_or(error)?.position();
            }
            let rest_params = C::from_rest(&x, material);
            if C::rest_size(&rest_params) == T::zero() {
                let (kind, vertices) = (C::NAME, tuple.to_vec());
                return Err(SolverError::RestShape { kind, constraint, vertices });
            }
            params.push(rest_params);
        }
        self.add::<C, N>(indices, &params, stiffness, groups)
    }

    /// Sets color groups of the vertices for [`Formulation::Vbd`](crate::Formulation::Vbd). Use it
    /// if you know better groups than greedy coloring finds, for example the closed-form groups of
    /// a lattice. The groups may contain vertices that do not move. They are checked when a solver
    /// is built. Other formulations ignore them.
    pub fn vertex_groups(mut self, groups: Groups) -> Self {
        self.system.vertex_groups = Some(Arc::new(groups));
        self
    }

    /// Adds a handle. Its vertices become kinematic: they follow the handle's path and ignore
    /// forces.
    ///
    /// # Errors
    /// Returns an error for a vertex that does not exist or belongs to another handle, a path or
    /// duration that is not finite, or a negative duration.
    pub fn handle(mut self, handle: Handle) -> Result<Self, SolverError> {
        let System { vertices, handles, .. } = &mut self.system;
        KinematicHandle::<T>::check(handles.len(), &handle, vertices.len(), &mut self.kinematic)?;
        handles.push(KinematicHandle::grab(handle, vertices));
        Ok(self)
    }

    /// Takes the kinds that were added so far, and leaves none. Use it with
    /// [`Change`](crate::Change).
    pub fn take_kinds(&mut self) -> Vec<Kind<T>> {
        std::mem::take(&mut self.system.kinds)
    }

    /// Returns the finished system.
    pub fn build(self) -> System<T> {
        self.system
    }
}

/// Returns the center of the bounding box along each axis on which the center is farther from zero
/// than the box is long, and zero along the other axes. Subtracting such a center is exact in the
/// number type of the positions (Sterbenz's lemma), and so is adding it again.
fn origin_of<S: Scalar>(positions: &[Point3<S>]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| {
        let values = positions.iter().map(|position| position[axis].to_f64());
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let center = S::constant(0.5 * low + 0.5 * high).to_f64();
        if center.abs() > high - low && center.is_finite() { center } else { 0.0 }
    })
}
