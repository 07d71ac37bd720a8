//! The largest HU of every block of cells, for skipping empty space.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::field::Field;

/// Cells per block along each axis.
const SIDE: usize = 8;

/// For each block of 8 × 8 × 8 cells: whether it may hold a value at or above a threshold.
pub struct Blocks {
    shape: [usize; 3],
    full: Vec<bool>,
}

/// Number of blocks along each axis of a grid of voxels.
pub fn block_shape(voxels: [usize; 3]) -> [usize; 3] {
    voxels.map(|n| n.saturating_sub(1).div_ceil(SIDE).max(1))
}

impl Blocks {
    /// Finds the blocks by visiting all voxels in parallel.
    pub fn new(field: &Field<'_>, threshold_hu: f32) -> Self {
        let voxels = field.shape();
        let shape = block_shape(voxels);
        let mut full = vec![false; shape.iter().product()];
        full.par_chunks_mut(shape[0] * shape[1]).enumerate().for_each(|(block_k, full)| {
            // The voxels at the far faces of a block belong to the next block too.
            let span = |block: usize, axis: usize| block * SIDE..(block * SIDE + SIDE + 1).min(voxels[axis]);
            for k in span(block_k, 2) {
                for block_j in 0..shape[1] {
                    for j in span(block_j, 1) {
                        let row = voxels[0] * (j + voxels[1] * k);
                        for block_i in 0..shape[0] {
                            let flag = &mut full[block_i + shape[0] * block_j];
                            *flag = *flag || span(block_i, 0).any(|i| field.voxel(row + i) >= threshold_hu);
                        }
                    }
                }
            }
        });
        Self { shape, full }
    }

    /// Distance, in units of `step`, from `position` (within the grid) to the end of an empty
    /// block. `None` if the block at `position` is not empty.
    #[inline]
    pub fn skip(&self, position: Point3<f64>, step: &Vector3<f64>) -> Option<f64> {
        let mut flat = 0;
        let mut stride = 1;
        let mut exit = f64::INFINITY;
        for axis in 0..3 {
            let block = ((position[axis].max(0.0) as usize) / SIDE).min(self.shape[axis] - 1);
            flat += block * stride;
            stride *= self.shape[axis];
            if step[axis] != 0.0 {
                let wall = if step[axis] > 0.0 { (block + 1) * SIDE } else { block * SIDE };
                exit = exit.min((wall as f64 - position[axis]) / step[axis]);
            }
        }
        (!self.full[flat]).then_some(exit.max(0.0))
    }
}
