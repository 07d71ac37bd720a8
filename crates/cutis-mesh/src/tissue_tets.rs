//! The tissue of a lattice: its points, and the tets with four tissue corners.

use crate::cells::CellMasks;
use crate::{HalfSpace, Lattice, MeshError};

/// The tissue of a lattice.
pub(crate) struct TissueTets {
    /// One flag per lattice point: true if the point is tissue.
    pub points: Vec<bool>,
    /// The tets with four tissue corners.
    pub masks: CellMasks,
}

impl TissueTets {
    /// Points are tissue if they are not `air` and in none of the half-spaces `cut_away`.
    pub fn find(lattice: &Lattice, air: &[bool], cut_away: &[HalfSpace]) -> Result<Self, MeshError> {
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
        let points: Vec<bool> = air.iter().enumerate().map(|(point, &air)| !air && kept(point)).collect();
        Ok(Self { masks: CellMasks::of_points(lattice, &points), points })
    }
}
