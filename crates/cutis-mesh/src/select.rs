//! Selection of vertices by half-space or box.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::{MeshError, TetMesh};

/// The half-space on one side of a plane, in world millimeters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct HalfSpace {
    /// A point of the plane, mm.
    pub point_mm: [f64; 3],
    /// Normal of the plane, pointing into the half-space; any length but zero.
    pub normal: [f64; 3],
}

impl HalfSpace {
    /// Checks that all numbers are finite and the normal is not zero.
    ///
    /// # Errors
    /// [`MeshError::Plane`] if they are not.
    pub fn validate(&self) -> Result<(), MeshError> {
        let finite = self.point_mm.iter().chain(&self.normal).all(|v| v.is_finite());
        let length = Vector3::from(self.normal).norm();
        if finite && length > 0.0 && length.is_finite() {
            return Ok(());
        }
        Err(MeshError::Plane { point_mm: self.point_mm, normal: self.normal })
    }

    /// True if a point is strictly inside.
    pub fn contains(&self, mm: Point3<f64>) -> bool {
        (mm - Point3::from(self.point_mm)).dot(&Vector3::from(self.normal)) > 0.0
    }
}

impl TetMesh {
    /// Selects the vertices in the closed box between two opposite corners in mm, in any order.
    pub fn vertices_in_box_mm(&self, corner: [f64; 3], opposite: [f64; 3]) -> Vec<bool> {
        let within = |axis: usize, v: f64| {
            let (a, b) = (corner[axis], opposite[axis]);
            (a.min(b)..=a.max(b)).contains(&v)
        };
        self.select_mm(|mm| (0..3).all(|axis| within(axis, mm[axis])))
    }

    /// Selects the vertices strictly inside a half-space.
    ///
    /// # Errors
    /// [`MeshError::Plane`] if the half-space is not valid.
    pub fn vertices_beyond(&self, half_space: &HalfSpace) -> Result<Vec<bool>, MeshError> {
        half_space.validate()?;
        Ok(self.select_mm(|mm| half_space.contains(mm)))
    }

    /// Selects vertices by the exact positions of their lattice points, not the rounded 32-bit
    /// positions.
    fn select_mm(&self, inside: impl Fn(Point3<f64>) -> bool) -> Vec<bool> {
        let (lattice, grid) = (&self.lattice, self.lattice.grid());
        self.lattice_index.iter().map(|&point| inside(lattice.mm(grid.point(point as usize)))).collect()
    }
}
