//! Where a volume is below or above a threshold, block by block, for skipping most voxels.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::field::{Field, clamp};

/// Cells per block along each axis.
const SIDE: usize = 2;
/// Blocks per large block along each axis.
const LARGE: usize = 8;

/// What is known of the values in a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// All are below the threshold.
    Empty,
    /// Some may be below the threshold, and some not.
    Mixed,
    /// None is below the threshold.
    Full,
}

/// The blocks of 2 × 2 × 2 cells of a grid, and large blocks of 16 × 16 × 16 cells.
pub struct Blocks {
    shape: [usize; 3],
    blocks: Vec<Block>,
    large_shape: [usize; 3],
    /// True for the large blocks in which all blocks are empty.
    large_empty: Vec<bool>,
    /// Largest index of a voxel along each axis.
    last: [f64; 3],
}

impl Blocks {
    /// Finds the blocks that meet a box of continuous indices, by visiting their voxels in
    /// parallel. All others count as mixed.
    pub fn new(field: &Field<'_>, threshold_hu: f32, within: &[Range<f64>; 3]) -> Self {
        let voxels = field.shape();
        let shape = voxels.map(|n| (n - 1).div_ceil(SIDE).max(1));
        let within: [Range<usize>; 3] = std::array::from_fn(|axis| {
            let Range { start, end } = within[axis];
            let last = (voxels[axis] - 1) as f64;
            let block = |at: f64| (clamp(at, last) as usize / SIDE).min(shape[axis] - 1);
            if start <= end && end >= 0.0 && start <= last { block(start)..block(end) + 1 } else { 0..0 }
        });
        let columns = voxels_of(&within[0], voxels[0]);
        let mut blocks = vec![Block::Mixed; shape.iter().product()];
        blocks.par_chunks_mut(shape[0]).enumerate().for_each(|(number, blocks)| {
            let [j, k] = [number % shape[1], number / shape[1]];
            if !(within[1].contains(&j) && within[2].contains(&k)) {
                return;
            }
            let [rows, slices] = [span(j, voxels[1]), span(k, voxels[2])];
            let first = &field.row(rows.start, slices.start)[columns.clone()];
            let (mut low, mut high) = (first.to_vec(), first.to_vec());
            for (k, j) in slices.flat_map(|k| rows.clone().map(move |j| (k, j))) {
                let row = &field.row(j, k)[columns.clone()];
                for ((low, high), &stored) in low.iter_mut().zip(&mut high).zip(row) {
                    (*low, *high) = (stored.min(*low), stored.max(*high));
                }
            }
            for (n, block) in blocks[within[0].clone()].iter_mut().enumerate() {
                let columns = span(n, columns.len());
                let low = low[columns.clone()].iter().fold(i16::MAX, |least, &stored| least.min(stored));
                let high = high[columns].iter().fold(i16::MIN, |most, &stored| most.max(stored));
                // HU rise or fall with the stored values.
                let reaches = [low, high].map(|stored| field.hu(stored) >= threshold_hu);
                *block = match reaches {
                    [true, true] => Block::Full,
                    [false, false] => Block::Empty,
                    _ => Block::Mixed,
                };
            }
        });
        let large_shape = shape.map(|n| n.div_ceil(LARGE));
        let mut large_empty = vec![true; large_shape.iter().product()];
        large_empty.par_chunks_mut(large_shape[0]).enumerate().for_each(|(number, large_empty)| {
            let part = |large: usize, axis: usize| large * LARGE..((large + 1) * LARGE).min(shape[axis]);
            let slices = part(number / large_shape[1], 2);
            for (k, j) in slices.flat_map(|k| part(number % large_shape[1], 1).map(move |j| (k, j))) {
                let row = &blocks[shape[0] * (j + shape[1] * k)..][..shape[0]];
                for (empty, blocks) in large_empty.iter_mut().zip(row.chunks(LARGE)) {
                    *empty &= blocks.iter().all(|&block| block == Block::Empty);
                }
            }
        });
        Self { shape, blocks, large_shape, large_empty, last: voxels.map(|n| (n - 1) as f64) }
    }

    /// Number of steps from `position` (within the grid) to the end of an empty block. `None` if
    /// the block at `position` is not empty. `steps_per_index` is 0 along axes where the steps do
    /// not move.
    #[inline]
    pub fn skip(&self, position: Point3<f64>, steps_per_index: &Vector3<f64>) -> Option<f64> {
        let at = self.place(position);
        let large = at.map(|block| block / LARGE);
        let (block, cells) = if self.large_empty[number(self.large_shape, large)] {
            (large, SIDE * LARGE)
        } else if self.blocks[number(self.shape, at)] == Block::Empty {
            (at, SIDE)
        } else {
            return None;
        };
        let mut exit = f64::INFINITY;
        for axis in 0..3 {
            let steps = steps_per_index[axis];
            if steps != 0.0 {
                let wall = (block[axis] + usize::from(steps > 0.0)) * cells;
                let end = (wall as f64 - position[axis]) * steps;
                exit = if end < exit { end } else { exit };
            }
        }
        Some(if exit > 0.0 { exit } else { 0.0 })
    }

    /// The block at a position, moved into the grid.
    #[inline]
    pub fn at(&self, position: Point3<f64>) -> Block {
        self.blocks[number(self.shape, self.place(position))]
    }

    #[inline]
    fn place(&self, position: Point3<f64>) -> [usize; 3] {
        std::array::from_fn(|axis| {
            let block = clamp(position[axis], self.last[axis]) as i32 as usize / SIDE;
            block.min(self.shape[axis] - 1)
        })
    }
}

/// The voxels of a block along one axis. Those at the far face belong to the next block too.
fn span(block: usize, voxels: usize) -> Range<usize> {
    block * SIDE..(block * SIDE + SIDE + 1).min(voxels)
}

/// The voxels of some blocks along one axis.
fn voxels_of(blocks: &Range<usize>, voxels: usize) -> Range<usize> {
    if blocks.is_empty() { 0..0 } else { blocks.start * SIDE..span(blocks.end - 1, voxels).end }
}

#[inline]
fn number(shape: [usize; 3], [i, j, k]: [usize; 3]) -> usize {
    i + shape[0] * (j + shape[1] * k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutis_test_kit::Random;
    use cutis_volume::{Affine, Grid, Volume};

    #[test]
    fn values_in_blocks_are_on_their_side_of_the_threshold() {
        let mut random = Random::new(8);
        for (shape, slope) in [([40, 23, 19], 1.5), ([3, 50, 2], -3.0), ([1, 1, 9], 1.0)] {
            let grid = Grid { shape, affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
            // A half of air, a half of tissue, and noise in between.
            let stored = |v: usize| {
                let [i, j, k] = grid.point(v);
                let noise = if random.below(9) == 0 { random.below(800) as i16 } else { 0 };
                noise + if i + j + k < shape.iter().sum::<usize>() / 2 { -700 } else { 100 }
            };
            let volume = Volume::new(grid, (0..grid.len()).map(stored).collect(), slope, 0.0).unwrap();
            let (field, threshold) = (Field::new(&volume), -200.0);
            let blocks = Blocks::new(&field, threshold, &shape.map(|n| 0.0..n as f64));
            let mut counts = [0; 3];
            let mut random = Random::new(9);
            for _ in 0..2000 {
                let mut place = |n: usize| random.below(100 * n + 200) as f64 / 100.0 - 1.0;
                let position = Point3::from(shape.map(&mut place));
                let block = blocks.at(position);
                counts[block as usize] += 1;
                let reaches = field.at(position) >= threshold;
                assert!(
                    block == Block::Mixed || reaches == (block == Block::Full),
                    "{block:?} at {position}"
                );
                let inside =
                    Point3::from([0, 1, 2].map(|a: usize| clamp(position[a], shape[a] as f64 - 1.0)));
                for step in [Vector3::new(0.3, 0.5, -0.1), Vector3::new(0.0, -0.5, 0.0)] {
                    let Some(free) = blocks.skip(inside, &step.map(|x| if x == 0.0 { 0.0 } else { 1.0 / x }))
                    else {
                        continue;
                    };
                    assert_eq!(block, Block::Empty);
                    for part in 0..=20 {
                        let on_way = inside + step * (free * f64::from(part) / 20.0 * 0.999);
                        assert!(field.at(on_way) < threshold, "at {on_way} from {inside}");
                    }
                }
            }
            assert!(counts[0] > 0 && counts[1] > 0, "{counts:?} of {shape:?}");
        }
    }

    /// Blocks that meet the box are as they are without it, and the others are mixed.
    #[test]
    fn only_blocks_within_a_box_are_found() {
        let mut random = Random::new(3);
        let grid = Grid { shape: [21, 18, 40], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
        let stored = |v: usize| {
            let noise = if random.below(20) == 0 { 700 } else { 0 };
            noise - if grid.point(v)[2] < 20 { 700 } else { 0 }
        };
        let volume = Volume::new(grid, (0..grid.len()).map(stored).collect(), 1.0, 0.0).unwrap();
        let field = Field::new(&volume);
        let of = |within: [Range<f64>; 3]| Blocks::new(&field, -200.0, &within).blocks;
        let all = of(grid.shape.map(|n| -1.0..n as f64));
        let shape = grid.shape.map(|n| (n - 1).div_ceil(SIDE));
        for (within, expected) in [
            ([3.0..9.5, -4.0..5.0, 11.0..90.0], [1..5, 0..3, 5..20]),
            ([20.0..20.0, 17.0..30.0, 0.0..0.5], [9..10, 8..9, 0..1]),
            ([2.0..3.0, 2.0..3.0, 40.0..50.0], [0..0, 0..0, 0..0]),
            ([2.0..3.0, -9.0..-1.0, 0.0..50.0], [0..0, 0..0, 0..0]),
            ([f64::INFINITY..f64::NEG_INFINITY, 0.0..9.0, 0.0..9.0], [0..0, 0..0, 0..0]),
        ] {
            for (n, (&found, &known)) in of(within.clone()).iter().zip(&all).enumerate() {
                let at = [n % shape[0], n / shape[0] % shape[1], n / shape[0] / shape[1]];
                let inside = (0..3).all(|axis| expected[axis].contains(&at[axis]));
                assert_eq!(found, if inside { known } else { Block::Mixed }, "{at:?} within {within:?}");
            }
        }
    }
}
