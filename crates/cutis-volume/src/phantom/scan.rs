//! The simulated scanner: each voxel is a mean over sample points, plus noise.

use rayon::prelude::*;

use super::anatomy::Anatomy;
use super::layered_solid::{InBox, SampleRow, in_box, in_plane};
use super::random::{hash, normal};
use super::turn::Turn;
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
/// Number of sample points of a row that are tested together against the solids of a turned person.
const SAMPLES_PER_BOX: usize = 16;

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
/// the grid. With a `turn` the person is turned in the scanner; the noise is not.
pub(super) fn fill(
    grid: &Grid,
    seed: u64,
    anatomy: &Anatomy,
    turn: Option<&Turn>,
    first: usize,
    out: &mut [i16],
) {
    let [nx, ny, _] = grid.shape;
    let [xs, ys, zs] = [0, 1, 2].map(|axis| Samples::new(grid, axis));
    let blend_mm = (xs.step + ys.step + zs.step) / 3.0;
    let centers: Vec<f32> = (0..nx).map(|i| grid.mm([i, 0, 0]).x as f32).collect();
    let noise =
        Noise { key: hash(seed, NOISE_STREAM), edge_mm: -(centers[0] - 0.5 * xs.step * xs.factor as f32) };

    out.par_chunks_mut(nx * ny).enumerate().for_each(|(slice, out)| {
        let k = first + slice;
        let planes: Vec<(f32, Content<'_>)> =
            zs.of(k).iter().map(|&z| (z, Content::of_plane(anatomy, turn, z, blend_mm))).collect();
        let scratch = || (Painter::new(&xs, blend_mm, turn.is_some()), vec![0.0_f32; nx]);
        out.par_chunks_mut(nx).with_min_len(ROWS_PER_TASK).enumerate().for_each_init(
            scratch,
            |(painter, sums), (j, out)| {
                sums.fill(0.0);
                for (z, content) in &planes {
                    for &y in ys.of(j) {
                        let hu = painter.paint(content, anatomy, y, *z);
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

/// What a plane of the scan can show.
enum Content<'a> {
    /// The solids of the upright person that reach the plane.
    Upright(Vec<InBox<'a>>),
    /// A turned person. The solids are found for short pieces of rows.
    Turned(&'a Turn),
}

impl<'a> Content<'a> {
    fn of_plane(anatomy: &'a Anatomy, turn: Option<&'a Turn>, z: f32, blend_mm: f32) -> Self {
        match turn {
            None => Self::Upright(in_plane(&anatomy.solids, z, blend_mm)),
            Some(turn) => Self::Turned(turn),
        }
    }
}

/// Buffers for painting a row of sample points.
struct Painter<'a> {
    xs: &'a [f32],
    blend_mm: f32,
    /// The whole row of an upright person, or one point of a turned person.
    row: SampleRow,
    /// Points of the upright person in a piece of the row, and Hounsfield units of the row.
    points: Vec<[f32; 3]>,
    hu: Vec<f32>,
}

impl<'a> Painter<'a> {
    fn new(xs: &'a Samples, blend_mm: f32, is_turned: bool) -> Self {
        let at = if is_turned { &xs.at[..1] } else { &xs.at };
        let row = SampleRow::new(at, xs.step, blend_mm);
        Self { xs: &xs.at, blend_mm, row, points: Vec::new(), hu: Vec::new() }
    }

    /// Hounsfield units of the row at `(y, z)`.
    fn paint(&mut self, content: &Content<'_>, anatomy: &Anatomy, y: f32, z: f32) -> &[f32] {
        let around = &anatomy.surroundings;
        let turn = match content {
            Content::Upright(solids) => return self.row.paint(solids, around, y, z, BACKGROUND_HU),
            Content::Turned(turn) => turn,
        };
        self.hu.clear();
        for xs in self.xs.chunks(SAMPLES_PER_BOX) {
            self.points.clear();
            self.points.extend(xs.iter().map(|&x| turn.to_person([x, y, z])));
            let end = |choose: fn(f32, f32) -> f32, start: f32| {
                let choose = |end: [f32; 3], point: &[f32; 3]| [0, 1, 2].map(|c| choose(end[c], point[c]));
                self.points.iter().fold([start; 3], choose)
            };
            let corners = [end(f32::min, f32::INFINITY), end(f32::max, f32::NEG_INFINITY)];
            let solids = in_box(&anatomy.solids, corners, self.blend_mm);
            for &point in &self.points {
                self.hu.push(self.row.paint_point(&solids, around, point, BACKGROUND_HU));
            }
        }
        &self.hu
    }
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

    /// Without a turn the path of turned persons has the bits of the upright path.
    #[test]
    fn points_and_rows_have_the_same_bits() -> Result<(), crate::VolumeError> {
        let grid = centered_grid([40, 36, 12], [9.0, 10.0, 30.0])?;
        let anatomy = Anatomy::new(3);
        let (xs, still) = (Samples::new(&grid, 0), Turn::identity());
        let blend_mm = xs.step;
        let [mut rows, mut points] = [false, true].map(|turned| Painter::new(&xs, blend_mm, turned));
        let mut tissue = 0;
        for z in (-170..170).step_by(17).map(|z| z as f32 + 0.3) {
            let [upright, turned] =
                [None, Some(&still)].map(|turn| Content::of_plane(&anatomy, turn, z, blend_mm));
            for y in (-140..140).step_by(7).map(|y| y as f32 - 0.4) {
                let wanted = rows.paint(&upright, &anatomy, y, z);
                tissue += wanted.iter().filter(|hu| **hu > -500.0).count();
                assert_eq!(points.paint(&turned, &anatomy, y, z), wanted, "y {y}, z {z}");
            }
        }
        assert!(tissue > 10_000, "{tissue} points of tissue");
        Ok(())
    }

    #[test]
    fn stored_values_are_rounded_and_clamped() {
        assert_eq!([-1.6, -1.4, 0.4, 0.6, 9999.0, -2000.0].map(stored), [-2, -1, 0, 1, 3071, -1024]);
    }
}
