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

use cutis_constraints::Scalar;
use nalgebra::Vector3;

use crate::batch::VertexChunk;
use crate::descent::{Descent, VertexForce};
use crate::system::check_finite;
use crate::{SolverError, System};

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

    /// Returns the force of all constraints on each vertex at the present positions, in N.
    ///
    /// The sum has the operations and the order of vertex block descent. With the negative of the
    /// result as the load, vertex block descent therefore moves no vertex, not by one bit.
    ///
    /// # Errors
    /// Returns the errors of [`Descent::new`] for a kind whose forces are not defined: a PBD
    /// stiffness, or a compliance of zero.
    pub fn constraint_forces(&self) -> Result<Vec<Vector3<T>>, SolverError> {
        let incidences = Descent::incidences_of(self)?;
        let indices: Vec<u32> = (0..self.vertices.len() as u32).collect();
        let mut forces = vec![VertexForce::none(); indices.len()];
        for (kind, incidence) in self.kinds.iter().zip(&incidences) {
            let vertices = self.vertices.as_slice();
            kind.vertex_forces(VertexChunk { incidence, indices: &indices, vertices, forces: &mut forces });
        }
        Ok(forces.iter().map(|force| force.force).collect())
    }
}

/// The load of vertex `index`; zero if there are no loads.
#[inline]
pub(crate) fn load_of<T: Scalar>(loads: &[Vector3<T>], index: usize) -> Vector3<T> {
    loads.get(index).copied().unwrap_or_else(Vector3::zeros)
}
