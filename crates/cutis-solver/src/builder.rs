//! Building a system: everything is checked here, so that nothing has to be checked in a step.

use std::collections::HashSet;
use std::sync::Arc;

use cutis_coloring::Groups;
use cutis_constraints::{Constraint, Scalar};
use nalgebra::{Point3, Vector3};

use crate::batch::Batch;
use crate::system::check_finite;
use crate::{Handle, KinematicHandle, SolverError, Stiffness, System, Vertex};

/// Collects vertices, kinds of constraints and handles into a [`System`].
pub struct SystemBuilder<T: Scalar> {
    system: System<T>,
    held: HashSet<u32>,
}

impl<T: Scalar> SystemBuilder<T> {
    /// Starts with positions in meters and inverse masses in 1/kg (0 = fixed), one of each per vertex. Their number
    /// type may differ from the solver's.
    ///
    /// A body that lies farther from zero than its own extent (along an axis) is moved there, so that single
    /// precision is not spent on the distance; [`System::positions`] gives the caller's coordinates back exactly.
    ///
    /// # Errors
    /// Lengths that differ, more than `u32::MAX` vertices, a coordinate that is not finite, an inverse mass that is
    /// negative or not finite.
    pub fn new<S: Scalar, M: Scalar>(
        positions: &[Point3<S>],
        inverse_masses: &[M],
    ) -> Result<Self, SolverError> {
        Self::about(origin_of(positions), positions, inverse_masses)
    }

    /// As [`new`](Self::new), but the body stays where it is, however far that may be. For a part of a body: it is
    /// stepped with the same bits as in the whole one, and a saved state can be gone on from with the same bits.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn in_place<S: Scalar, M: Scalar>(
        positions: &[Point3<S>],
        inverse_masses: &[M],
    ) -> Result<Self, SolverError> {
        Self::about(Vector3::zeros(), positions, inverse_masses)
    }

    fn about<S: Scalar, M: Scalar>(
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
            kinds: Vec::new(),
            handles: Vec::new(),
            vertex_groups: None,
        };
        Ok(Self { system, held: HashSet::new() })
    }

    /// Velocities at the start in m/s, one per vertex. Without this call all are zero.
    ///
    /// # Errors
    /// A wrong length, or a velocity that is not finite.
    pub fn velocities(mut self, velocities: &[Vector3<T>]) -> Result<Self, SolverError> {
        let (found, expected) = (velocities.len(), self.system.vertices.len());
        if found != expected {
            return Err(SolverError::VertexLength { what: "velocities", found, expected });
        }
        check_finite("velocity", velocities.iter())?;
        self.system.velocities.copy_from_slice(velocities);
        Ok(self)
    }

    /// Adds all constraints of the kind `C`: vertices and parameters of each, their stiffness and their groups. Kinds
    /// are projected in the order in which they are added.
    ///
    /// # Errors
    /// Lengths that differ, a vertex that does not exist or appears twice in a constraint, a parameter that is not
    /// finite, a stiffness out of range, groups that do not fit.
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

    /// The same with parameters taken from the positions given to [`new`](Self::new).
    ///
    /// # Errors
    /// As for [`add`](Self::add), and [`SolverError::RestShape`] for a rest shape without size. A rest size of zero that
    /// is wanted, as of a spring of length zero, is given to [`add`](Self::add).
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
            for (place, &vertex) in x.iter_mut().zip(tuple) {
                let (kind, vertex_count) = (C::NAME, vertices.len());
                let error = SolverError::VertexOutOfRange { kind, constraint, vertex, vertex_count };
                *place = vertices.get(vertex as usize).ok_or(error)?.position();
            }
            let of_rest = C::from_rest(&x, material);
            if C::rest_size(&of_rest) == T::zero() {
                let (kind, vertices) = (C::NAME, tuple.to_vec());
                return Err(SolverError::RestShape { kind, constraint, vertices });
            }
            params.push(of_rest);
        }
        self.add::<C, N>(indices, &params, stiffness, groups)
    }

    /// Groups of the vertices for [`Formulation::Vbd`](crate::Formulation::Vbd), where the caller knows better ones than
    /// greedy coloring finds, for example those of a lattice in closed form. Vertices that do not move may be among them. They are
    /// checked when a solver is made; other formulations do not look at them.
    pub fn vertex_groups(mut self, groups: Groups) -> Self {
        self.system.vertex_groups = Some(Arc::new(groups));
        self
    }

    /// Adds a handle; its vertices leave the dynamics.
    ///
    /// # Errors
    /// A vertex that does not exist or is moved by a handle already, a path or a time that is not finite, a negative
    /// time.
    pub fn handle(mut self, handle: Handle) -> Result<Self, SolverError> {
        let System { vertices, handles, .. } = &mut self.system;
        let held = KinematicHandle::new(handles.len(), handle, vertices, &mut self.held)?;
        handles.push(held);
        Ok(self)
    }

    /// The finished system.
    pub fn build(self) -> System<T> {
        self.system
    }
}

/// Center of the bounding box along the axes where it is farther from zero than the box is long, zero along the
/// others. Then subtracting it is exact in the number type of the positions (Sterbenz), and so is adding it again.
fn origin_of<S: Scalar>(positions: &[Point3<S>]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| {
        let values = positions.iter().map(|position| position[axis].to_f64());
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let center = S::constant(0.5 * low + 0.5 * high).to_f64();
        if center.abs() > high - low && center.is_finite() { center } else { 0.0 }
    })
}
