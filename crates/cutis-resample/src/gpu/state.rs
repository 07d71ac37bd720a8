//! What the passes over a slab leave.

use crate::report::ResampleReport;

/// In the key of an owner that only comes near a center: any tet that holds it wins.
pub const NEAR: u32 = 1 << 31;
/// The owner of a voxel that no tet claims.
pub const NONE: u32 = u32::MAX;

/// The voxels of a slab after the passes over it, on the GPU or by its [`twin`](crate::twin).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SlabState {
    /// Key of the tet that each voxel belongs to: its number, with the highest bit set if it only comes near the center;
    /// `u32::MAX` for none.
    pub owners: Vec<u32>,
    /// Three planes of a bit for each voxel, 32 voxels to a word: held strictly by a body tet, by two, covered at rest by a
    /// tet that moved or was removed.
    pub marks: Vec<u32>,
    /// Stored values.
    pub values: Vec<i16>,
    /// Covered, moved, vacated and folded voxels.
    pub counts: [u32; 4],
}

/// How far two states of a slab are apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SlabDifference {
    /// Voxels with different owners.
    pub owners: usize,
    /// Voxels with the same owner and different values.
    pub values: usize,
    /// Largest difference of a value where the owner is the same.
    pub largest: u16,
    /// Largest difference of a value where it is not.
    pub largest_elsewhere: u16,
}

/// Words of `marks` for so many voxels.
pub fn mark_words(voxels: usize) -> usize {
    3 * voxels.div_ceil(32)
}

impl SlabState {
    /// A slab that nobody has claimed.
    pub(crate) fn clear(voxels: usize) -> Self {
        Self {
            owners: vec![NONE; voxels],
            marks: vec![0; mark_words(voxels)],
            values: vec![0; voxels],
            counts: [0; 4],
        }
    }

    fn word(&self, plane: usize, voxel: usize) -> usize {
        plane * self.owners.len().div_ceil(32) + voxel / 32
    }

    /// Sets a voxel's bit; true if it was not set before.
    pub(crate) fn mark(&mut self, plane: usize, voxel: usize) -> bool {
        let (word, bit) = (self.word(plane, voxel), 1 << (voxel % 32));
        let before = self.marks[word];
        self.marks[word] = before | bit;
        before & bit == 0
    }

    pub(crate) fn is_marked(&self, plane: usize, voxel: usize) -> bool {
        self.marks[self.word(plane, voxel)] >> (voxel % 32) & 1 == 1
    }

    /// How far two states of a slab are apart; they have the same number of voxels.
    ///
    /// On hardware that contracts `a * b + c` a center within the rounding of a face can have another owner, and a value another
    /// rounding. [`SlabDifference`] tells such from errors.
    pub fn difference(&self, other: &Self) -> SlabDifference {
        let mut found = SlabDifference::default();
        for (voxel, (a, b)) in self.owners.iter().zip(&other.owners).enumerate() {
            let apart = self.values[voxel].abs_diff(other.values[voxel]);
            if a & !NEAR == b & !NEAR {
                found.values += usize::from(apart > 0);
                found.largest = found.largest.max(apart);
            } else {
                found.owners += 1;
                found.largest_elsewhere = found.largest_elsewhere.max(apart);
            }
        }
        found
    }

    /// The counts of this slab; inverted tets are of no slab.
    pub fn report(&self) -> ResampleReport {
        report(&self.counts)
    }
}

/// Counts as they lie in `counts`.
pub fn report(counts: &[u32; 4]) -> ResampleReport {
    let [covered_voxels, moved_voxels, vacated_voxels, folds] = counts.map(|count| count as usize);
    ResampleReport { covered_voxels, moved_voxels, vacated_voxels, folds, inverted_tets: 0 }
}
