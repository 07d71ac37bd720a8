//! Choosing vertices: by HU, by box, by half-space.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::{Lattice, MeshError, TetMesh};

/// The side of a plane that its normal points to, in world millimeters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HalfSpace {
    /// A point of the plane, mm.
    pub point_mm: [f64; 3],
    /// Points into the half-space; any length but zero.
    pub normal: [f64; 3],
}

impl HalfSpace {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`MeshError::Plane`] if one is not finite or the normal is zero.
    pub fn validate(&self) -> Result<(), MeshError> {
        let finite = self.point_mm.iter().chain(&self.normal).all(|v| v.is_finite());
        let length = Vector3::from(self.normal).norm();
        if finite && length > 0.0 && length.is_finite() {
            return Ok(());
        }
        Err(MeshError::Plane { point_mm: self.point_mm, normal: self.normal })
    }

    /// True if a point lies strictly inside.
    pub fn contains(&self, mm: Point3<f64>) -> bool {
        (mm - Point3::from(self.point_mm)).dot(&Vector3::from(self.normal)) > 0.0
    }
}

/// Points that are tissue (not `air`) and in none of the half-spaces cut away.
pub(crate) fn present(
    lattice: &Lattice,
    air: &[bool],
    cut_away: &[HalfSpace],
) -> Result<Vec<bool>, MeshError> {
    let grid = lattice.grid();
    if air.len() != grid.len() {
        return Err(MeshError::Length { array: "air", expected: grid.len(), found: air.len() });
    }
    cut_away.iter().try_for_each(HalfSpace::validate)?;
    let kept = |point: usize| {
        cut_away.is_empty() || {
            let mm = lattice.mm(grid.point(point));
            !cut_away.iter().any(|half_space| half_space.contains(mm))
        }
    };
    Ok(air.iter().enumerate().map(|(point, &air)| !air && kept(point)).collect())
}

impl TetMesh {
    /// Vertices of at least `hu` (bone, for instance).
    pub fn vertices_at_least_hu(&self, hu: f32) -> Vec<bool> {
        self.hu.iter().map(|&value| value >= hu).collect()
    }

    /// Vertices in the closed box between two corners, mm; the corners may come in any order.
    pub fn vertices_in_box_mm(&self, corner: [f64; 3], opposite: [f64; 3]) -> Vec<bool> {
        let within = |axis: usize, v: f64| {
            let (a, b) = (corner[axis], opposite[axis]);
            (a.min(b)..=a.max(b)).contains(&v)
        };
        self.select_mm(|mm| (0..3).all(|axis| within(axis, mm[axis])))
    }

    /// Vertices strictly inside a half-space.
    ///
    /// # Errors
    /// [`MeshError::Plane`] as [`HalfSpace::validate`].
    pub fn vertices_beyond(&self, half_space: &HalfSpace) -> Result<Vec<bool>, MeshError> {
        half_space.validate()?;
        Ok(self.select_mm(|mm| half_space.contains(mm)))
    }

    /// Tests the exact positions of the lattice points, not their 32-bit roundings.
    fn select_mm(&self, inside: impl Fn(Point3<f64>) -> bool) -> Vec<bool> {
        let (lattice, grid) = (&self.lattice, self.lattice.grid());
        self.lattice_index.iter().map(|&point| inside(lattice.mm(grid.point(point as usize)))).collect()
    }
}
