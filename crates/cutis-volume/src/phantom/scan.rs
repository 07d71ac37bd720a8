//! The simulated scanner: each voxel is a mean over sample points, plus noise.

use rayon::prelude::*;

use super::anatomy::Anatomy;
use super::layered_solid::{InPlane, SampleRow, in_plane};
use super::random::{hash, normal};
use crate::{AIR_HU, Grid};

/// Largest distance between sample points in mm.
const SAMPLE_MM: f64 = 2.5;
const BACKGROUND_HU: f32 = -1000.0;
/// Highest value of a 12-bit scanner in HU.
const HIGHEST_HU: f32 = 3071.0;
/// Standard deviation of the noise in HU at the edge of the field of view, and its increase in the
/// middle.
const NOISE_HU: [f32; 2] = [6.0, 7.0];
/// Number of the random stream for the noise.
const NOISE_STREAM: u64 = 100;
/// Smallest number of rows per parallel task.
const ROWS_PER_TASK: usize = 4;

/// Sample points along one axis: `factor` points per voxel, evenly spaced over it.
struct Samples {
    at: Vec<f32>,
    factor: usize,
    step: f32,
}

impl Samples {
    fn new(grid: &Grid, axis: usize) -> Self {
        let spacing = grid.affine.spacing_mm()[axis];
        let first = grid.mm([0; 3])[axis];
        let factor = (spacing / SAMPLE_MM).ceil().max(1.0) as usize;
        let step = spacing / factor as f64;
        let start = first - 0.5 * spacing + 0.5 * step;
        let at = (0..grid.shape[axis] * factor).map(|n| (start + step * n as f64) as f32).collect();
        Self { at, factor, step: step as f32 }
    }

    fn of(&self, voxel: usize) -> &[f32] {
        &self.at[voxel * self.factor..(voxel + 1) * self.factor]
    }
}

/// Computes slices until `out` is full, beginning with slice `first`. `out` holds whole slices of
/// the grid.
pub(super) fn fill(grid: &Grid, seed: u64, anatomy: &Anatomy, first: usize, out: &mut [i16]) {
    let [nx, ny, _] = grid.shape;
    let [xs, ys, zs] = [0, 1, 2].map(|axis| Samples::new(grid, axis));
    let blend_mm = (xs.step + ys.step + zs.step) / 3.0;
    let centers: Vec<f32> = (0..nx).map(|i| grid.mm([i, 0, 0]).x as f32).collect();
    let noise =
        Noise { key: hash(seed, NOISE_STREAM), edge_mm: -(centers[0] - 0.5 * xs.step * xs.factor as f32) };

    out.par_chunks_mut(nx * ny).enumerate().for_each(|(slice, out)| {
        let k = first + slice;
        let planes: Vec<(f32, Vec<InPlane<'_>>)> =
            zs.of(k).iter().map(|&z| (z, in_plane(&anatomy.solids, z, blend_mm))).collect();
        let scratch = || (SampleRow::new(&xs.at, xs.step, blend_mm), vec![0.0_f32; nx]);
        out.par_chunks_mut(nx).with_min_len(ROWS_PER_TASK).enumerate().for_each_init(
            scratch,
            |(row, sums), (j, out)| {
                sums.fill(0.0);
                for (z, solids) in &planes {
                    for &y in ys.of(j) {
                        let hu = row.paint(solids, &anatomy.surroundings, y, *z, BACKGROUND_HU);
                        for (sum, samples) in sums.iter_mut().zip(hu.chunks_exact(xs.factor)) {
                            *sum += samples.iter().sum::<f32>();
                        }
                    }
                }
                let scale = 1.0 / (xs.factor * ys.factor * zs.factor) as f32;
                let y = grid.mm([0, j, 0]).y as f32;
                let counter = grid.index([0, j, k]) as u64;
                for (i, voxel) in out.iter_mut().enumerate() {
                    *voxel = stored(sums[i] * scale + noise.at(centers[i], y, counter + i as u64));
                }
            },
        );
    });
}

/// Noise that increases towards the middle of the field of view, where the rays pass through more
/// tissue.
struct Noise {
    key: u64,
    edge_mm: f32,
}

impl Noise {
    fn at(&self, x: f32, y: f32, counter: u64) -> f32 {
        let middle = 1.0 - (x * x + y * y) / (self.edge_mm * self.edge_mm);
        (NOISE_HU[0] + NOISE_HU[1] * middle.max(0.0)) * normal(hash(self.key, counter))
    }
}

/// Rounds a value and clamps it to the range of the scanner.
fn stored(hu: f32) -> i16 {
    // The offset makes the value positive, because a cast truncates towards 0.
    ((hu.clamp(AIR_HU, HIGHEST_HU) + 4096.5) as i32 - 4096) as i16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::centered_grid;

    #[test]
    fn samples_are_centered_on_their_voxels() -> Result<(), crate::VolumeError> {
        let grid = centered_grid([4, 4, 2], [1.0, 6.0, 2.5])?;
        assert_eq!(Samples::new(&grid, 0).at, [-1.5, -0.5, 0.5, 1.5]);
        assert_eq!(Samples::new(&grid, 1).of(2), [1.0, 3.0, 5.0]);
        assert_eq!(Samples::new(&grid, 2).at, [-1.25, 1.25]);
        Ok(())
    }

    #[test]
    fn stored_values_are_rounded_and_clamped() {
        assert_eq!([-1.6, -1.4, 0.4, 0.6, 9999.0, -2000.0].map(stored), [-2, -1, 0, 1, 3071, -1024]);
    }
}
