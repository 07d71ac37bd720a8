//! The state of a slab after its passes.

use crate::report::ResampleReport;

/// The voxels of a slab after all passes over it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SlabState {
    /// Key of the tet that owns each voxel: its number, plus [`SlabState::NEAR`] if it only comes
    /// near the center. [`SlabState::NONE`] for no owner.
    pub owners: Vec<u32>,
    /// Four planes with one bit per voxel, 32 voxels per word. The bits mean: held strictly by a
    /// body tet, held strictly by two, held strictly by a body tet that moved, covered at rest by a
    /// tet that moved or was removed.
    pub marks: Vec<u32>,
    /// Stored values.
    pub values: Vec<i16>,
    /// Moved, vacated and folded voxels.
    pub counts: [u32; 3],
}

/// Number of words of `marks` for a number of voxels.
pub fn mark_words(voxels: usize) -> usize {
    4 * voxels.div_ceil(32)
}

impl SlabState {
    /// Bit of an owner's key: the tet only comes near the voxel's center. A tet that holds the
    /// center wins over it.
    pub const NEAR: u32 = 1 << 31;
    /// Key of a voxel without an owner.
    pub const NONE: u32 = u32::MAX;

    /// A slab without owners, marks and values.
    pub fn clear(voxels: usize) -> Self {
        Self {
            owners: vec![Self::NONE; voxels],
            marks: vec![0; mark_words(voxels)],
            values: vec![0; voxels],
            counts: [0; 3],
        }
    }

    /// The counts of this slab. Inverted tets belong to no slab.
    pub fn report(&self) -> ResampleReport {
        report(&self.counts)
    }
}

/// A report with the numbers in `counts`.
pub fn report(counts: &[u32; 3]) -> ResampleReport {
    let [moved_voxels, vacated_voxels, folds] = counts.map(|count| count as usize);
    ResampleReport { moved_voxels, vacated_voxels, folds, inverted_tets: 0 }
}
