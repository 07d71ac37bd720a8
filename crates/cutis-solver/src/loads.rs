//! Constant external forces on vertices, and the load that keeps a body at rest.
//!
//! A load is a force of fixed size and direction (a dead load). It acts in the prediction of PBD
//! and XPBD, and in the energy of a substep of vertex block descent, as gravity does. A body
//! without loads stores none.
//!
//! A CT shows a patient at rest, although the skin is under tension. Let `f⁰` be the force of the
//! constraints on each vertex at the shape in the scan ([`System::constraint_forces`]). With the
//! load `−f⁰` that shape is an equilibrium, and a cut moves only what it sets free. Source:
//! sag-free initialization, Hsu et al., *A General Two-Stage Initialization for Sag-Free Deformable
//! Simulations*, ACM Trans. Graph. 41 (2022).

use cutis_coloring::{Incidence, Tuples};
use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::batch::VertexChunk;
use crate::descent::{VertexForce, check_compliances, groups_error};
use crate::system::check_finite;
use crate::{Kind, SolverError, System, Vertex};

impl<T: Scalar> System<T> {
    /// Returns the loads in N, one per vertex; empty without loads.
    pub fn loads(&self) -> &[Vector3<T>] {
        &self.loads
    }

    /// Replaces the loads, in N, one per vertex. No vectors, or only zeros, mean no loads.
    ///
    /// # Errors
    /// Returns an error unless there is one finite vector per vertex or none. The loads are then
    /// unchanged.
    pub fn set_loads(&mut self, loads: &[Vector3<T>]) -> Result<(), SolverError> {
        let (found, expected) = (loads.len(), self.vertices.len());
        if found != expected && found != 0 {
            return Err(SolverError::VertexLength { what: "loads", found, expected });
        }
        check_finite("load", loads.iter())?;
        let acts = loads.iter().any(|load| *load != Vector3::zeros());
        self.loads = if acts { loads.to_vec() } else { Vec::new() };
        Ok(())
    }

    /// Returns the vertices of all constraints that have one of some vertices, in ascending order.
    ///
    /// # Errors
    /// [`SolverError::Vertex`] for a vertex that does not exist.
    pub fn vertices_around(&self, wanted: &[u32]) -> Result<Vec<u32>, SolverError> {
        self.check_vertices(wanted)?;
        let mut held = vec![false; self.vertices.len()];
        wanted.iter().for_each(|&vertex| held[vertex as usize] = true);
        let mut around = held.clone();
        for kind in &self.kinds {
            let tuples = kind.indices().chunks_exact(kind.arity());
            let touching = tuples.filter(|tuple| tuple.iter().any(|&vertex| held[vertex as usize]));
            touching.flatten().for_each(|&vertex| around[vertex as usize] = true);
        }
        Ok((0..).zip(around).filter(|(_, around)| *around).map(|(vertex, _)| vertex).collect())
    }

    /// Returns the force of all constraints and loads on some vertices, in N. `around` are the
    /// vertices of [`System::vertices_around`], and `positions` their positions in the caller's
    /// coordinates (m).
    ///
    /// # Errors
    /// The errors of [`System::constraint_forces`], [`SolverError::Vertex`] for a vertex that does
    /// not exist, and [`SolverError::VertexLength`] unless there is one position per vertex of
    /// `around`.
    pub fn forces_on(
        &self,
        wanted: &[u32],
        around: &[u32],
        positions: &[Point3<T>],
    ) -> Result<Vec<Vector3<T>>, SolverError> {
        self.check_vertices(wanted)?;
        self.check_vertices(around)?;
        if around.len() != positions.len() {
            let (found, expected) = (positions.len(), around.len());
            return Err(SolverError::VertexLength { what: "positions", found, expected });
        }
        let mut vertices = self.vertices.clone();
        let origin = self.origin().coords;
        for (&vertex, position) in around.iter().zip(positions) {
            vertices[vertex as usize].set_position(position - origin);
        }
        let mut forces = vec![VertexForce::none(); wanted.len()];
        add_forces(&self.kinds, &vertices, wanted, &mut forces)?;
        let load = |&vertex: &u32| load_of(&self.loads, vertex as usize);
        Ok(forces.iter().zip(wanted).map(|(force, vertex)| force.force + load(vertex)).collect())
    }

    /// Returns the force of all constraints on each vertex at the present positions, in N.
    ///
    /// The sum at each vertex has the operations and the order of vertex block descent. With the
    /// negative of the result as the load, vertex block descent therefore moves no vertex, not by
    /// one bit.
    ///
    /// # Errors
    /// Returns the errors of [`Descent::new`](crate::Descent::new) for a kind whose forces are not
    /// defined: a PBD stiffness, or a compliance of zero.
    pub fn constraint_forces(&self) -> Result<Vec<Vector3<T>>, SolverError> {
        let mut forces = vec![Vector3::zeros(); self.vertices.len()];
        for kind in &self.kinds {
            check_compliances(kind)?;
            kind.add_forces(&self.vertices, &mut forces);
        }
        Ok(forces)
    }
}

/// Adds the forces of some kinds on some vertices to `forces`, one per entry of `wanted`. The sum
/// has the operations and the order of vertex block descent.
///
/// # Errors
/// Returns the errors of [`System::constraint_forces`], and [`SolverError::VertexLength`] if the
/// lengths of `wanted` and `forces` differ, or a kind was built for another number of vertices.
///
/// # Panics
/// Panics if a wanted vertex does not exist.
pub fn add_forces<T: Scalar>(
    kinds: &[Kind<T>],
    vertices: &[Vertex<T>],
    wanted: &[u32],
    forces: &mut [VertexForce<T>],
) -> Result<(), SolverError> {
    if wanted.len() != forces.len() {
        let (found, expected) = (forces.len(), wanted.len());
        return Err(SolverError::VertexLength { what: "forces", found, expected });
    }
    for kind in kinds {
        if kind.vertex_count() != vertices.len() {
            let (found, expected) = (vertices.len(), kind.vertex_count());
            return Err(SolverError::VertexLength { what: "vertices of a kind", found, expected });
        }
        check_compliances(kind)?;
        let tuples = Tuples { vertices: kind.indices(), arity: kind.arity() };
        let incidence = &Incidence::new(tuples, vertices.len()).map_err(groups_error)?;
        kind.vertex_forces(VertexChunk { incidence, indices: wanted, vertices, forces });
    }
    Ok(())
}

/// The load of vertex `index`; zero if there are no loads.
#[inline]
pub(crate) fn load_of<T: Scalar>(loads: &[Vector3<T>], index: usize) -> Vector3<T> {
    loads.get(index).copied().unwrap_or_else(Vector3::zeros)
}
