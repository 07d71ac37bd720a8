//! Counts of a resampling.

use std::ops::Add;

use serde::Serialize;

/// Counts of voxels and tets in one resampling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ResampleReport {
    /// Voxels whose center is in a deformed tet that moved, and that this tet owns.
    pub moved_voxels: usize,
    /// Voxels of the rest shape that no deformed tet covers. They became air.
    pub vacated_voxels: usize,
    /// Voxels whose center is strictly inside two or more deformed body tets, of which one moved.
    pub folds: usize,
    /// Tets of the whole mesh whose volume changed its sign or vanished.
    pub inverted_tets: usize,
}

impl Add for ResampleReport {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            moved_voxels: self.moved_voxels + other.moved_voxels,
            vacated_voxels: self.vacated_voxels + other.vacated_voxels,
            folds: self.folds + other.folds,
            inverted_tets: self.inverted_tets + other.inverted_tets,
        }
    }
}
