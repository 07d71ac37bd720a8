//! Hounsfield units of a volume at any position, by trilinear interpolation.

use cutis_volume::{AIR_HU, Volume};
use nalgebra::{Matrix3, Point3, Vector3};

/// A volume as a continuous field. Padding below air counts as air.
pub struct Field<'a> {
    volume: &'a Volume,
    voxels: &'a [i16],
    shape: [usize; 3],
    /// Largest index of a voxel along each axis.
    last: [f64; 3],
    slope: f32,
    intercept: f32,
}

impl<'a> Field<'a> {
    pub fn new(volume: &'a Volume) -> Self {
        let (slope, intercept) = (volume.slope(), volume.intercept());
        let shape = volume.grid().shape;
        let last = shape.map(|n| (n - 1) as f64);
        Self { volume, voxels: volume.voxels(), shape, last, slope, intercept }
    }

    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Stored values of a row.
    pub fn row(&self, j: usize, k: usize) -> &'a [i16] {
        &self.voxels[self.shape[0] * (j + self.shape[1] * k)..][..self.shape[0]]
    }

    /// HU of a stored value. Padding counts as air.
    #[inline]
    pub fn hu(&self, stored: i16) -> f32 {
        let hu = self.slope * f32::from(stored) + self.intercept;
        // As `max`, but one instruction: neither value is NaN.
        if hu > AIR_HU { hu } else { AIR_HU }
    }

    /// HU of one voxel. Padding counts as air.
    #[inline]
    pub fn voxel(&self, index: usize) -> f32 {
        self.hu(self.voxels[index])
    }

    /// HU at a continuous index, clamped to the grid.
    #[inline]
    pub fn at(&self, position: Point3<f64>) -> f32 {
        let [nx, ny, nz] = self.shape;
        let (i, fx) = cell(position.x, self.last[0]);
        let (j, fy) = cell(position.y, self.last[1]);
        let (k, fz) = cell(position.z, self.last[2]);
        let base = i + nx * (j + ny * k);
        // The last voxel along an axis has no next one.
        let step = |low: usize, count: usize, stride: usize| if low + 1 < count { stride } else { 0 };
        let (dx, dy, dz) = (step(i, nx, 1), step(j, ny, nx), step(k, nz, nx * ny));
        let along_x = |at: usize| mix(self.voxel(at), self.voxel(at + dx), fx);
        let along_y = |at: usize| mix(along_x(at), along_x(at + dy), fy);
        mix(along_y(base), along_y(base + dz), fz)
    }

    /// HU at a world position in mm.
    pub fn at_mm(&self, mm: Point3<f64>) -> f32 {
        self.at(self.volume.grid().affine.to_index(mm))
    }

    /// Smoothed gradient of HU by index: central differences over one voxel to either side,
    /// averaged over the position and its six neighbors. Without the average, the steps between
    /// voxels appear as rings on the skin.
    pub fn index_gradient(&self, position: Point3<f64>) -> Vector3<f64> {
        let near = self.around(position);
        let at = |x: isize, y: isize, z: isize| f64::from(near.at([x, y, z]));
        let axis = |ahead: [isize; 3]| {
            let [x, y, z] = ahead;
            at(x, y, z) - at(-x, -y, -z) + at(2 * x, 2 * y, 2 * z) - at(-2 * x, -2 * y, -2 * z)
        };
        let mut sum = Vector3::new(axis([1, 0, 0]), axis([0, 1, 0]), axis([0, 0, 1]));
        // Each diagonal neighbor contributes to the differences along both of its axes.
        let mut diagonal = |[first, second]: [usize; 2], [pp, pm, mp, mm]: [f64; 4]| {
            sum[first] += pp + pm - mp - mm;
            sum[second] += pp + mp - pm - mm;
        };
        diagonal([0, 1], [at(1, 1, 0), at(1, -1, 0), at(-1, 1, 0), at(-1, -1, 0)]);
        diagonal([1, 2], [at(0, 1, 1), at(0, 1, -1), at(0, -1, 1), at(0, -1, -1)]);
        diagonal([2, 0], [at(1, 0, 1), at(-1, 0, 1), at(1, 0, -1), at(-1, 0, -1)]);
        sum / 14.0
    }

    /// Reads the voxels around a position once, for the values at whole offsets from it.
    #[inline(always)]
    fn around(&self, position: Point3<f64>) -> Around {
        let mut first = [0; 3];
        let mut fraction = [0.0; 3];
        for axis in 0..3 {
            let low = position[axis].floor();
            fraction[axis] = (position[axis] - low) as f32;
            first[axis] = low as isize - Around::REACH;
        }
        // Indices outside the grid are those of its sides.
        let [columns, rows, slices]: [[usize; 6]; 3] = std::array::from_fn(|axis| {
            std::array::from_fn(|n| {
                (first[axis] + n as isize).clamp(0, self.shape[axis] as isize - 1) as usize
            })
        });
        let in_row = columns[0] + 5 == columns[5];
        let mut along_x = [[[0.0; 5]; 6]; 6];
        for (k, of_slice) in along_x.iter_mut().enumerate() {
            let far = |n: usize| n == 0 || n == 5;
            let middle = |n: usize| n == 2 || n == 3;
            for (j, mixed) in of_slice.iter_mut().enumerate() {
                // No offset is this far along two axes.
                if (far(j) && !middle(k)) || (far(k) && !middle(j)) {
                    continue;
                }
                let start = self.shape[0] * (rows[j] + self.shape[1] * slices[k]);
                let values: [f32; 6] = if in_row {
                    let row = &self.voxels[start + columns[0]..][..6];
                    std::array::from_fn(|n| self.hu(row[n]))
                } else {
                    columns.map(|i| self.voxel(start + i))
                };
                *mixed = std::array::from_fn(|n| mix(values[n], values[n + 1], fraction[0]));
            }
        }
        Around { along_x, fraction }
    }

    /// Linear part of the map from world mm to index.
    pub fn index_per_mm(&self) -> Matrix3<f64> {
        let affine = &self.volume.grid().affine;
        let zero = affine.to_index(Point3::origin());
        // A power of two, so that the division is exact.
        let reach = 1024.0;
        let column = |axis: usize| {
            let mut end = Point3::origin();
            end[axis] = reach;
            (affine.to_index(end) - zero) / reach
        };
        Matrix3::from_columns(&[column(0), column(1), column(2)])
    }

    /// Smallest voxel spacing along an index axis, mm.
    pub fn finest_mm(&self) -> f64 {
        self.volume.grid().affine.spacing_mm().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Corners of the box of voxels in world mm, including the outer halves of the outer voxels.
    pub fn corners_mm(&self) -> [Point3<f64>; 8] {
        std::array::from_fn(|corner| {
            let index =
                |axis: usize| if corner >> axis & 1 == 1 { self.shape[axis] as f64 - 0.5 } else { -0.5 };
            self.volume.grid().affine.to_mm(Point3::new(index(0), index(1), index(2)))
        })
    }

    /// Continuous index of a world position in mm.
    pub fn to_index(&self, mm: Point3<f64>) -> Point3<f64> {
        self.volume.grid().affine.to_index(mm)
    }

    /// World position in mm of a continuous index.
    pub fn to_mm(&self, index: Point3<f64>) -> Point3<f64> {
        self.volume.grid().affine.to_mm(index)
    }
}

/// The voxels around a position, interpolated along the first axis.
struct Around {
    /// By slice and row; then by offset along the first axis, from −2 to 2.
    along_x: [[[f32; 5]; 6]; 6],
    fraction: [f32; 3],
}

impl Around {
    /// Largest offset.
    const REACH: isize = 2;

    /// HU at an offset: at most two along an axis and none along the others, or at most one along
    /// two axes.
    #[inline]
    fn at(&self, offset: [isize; 3]) -> f32 {
        let [i, j, k] = offset.map(|n| (n + Self::REACH) as usize);
        let [_, fy, fz] = self.fraction;
        let along_y = |k: usize| mix(self.along_x[k][j][i], self.along_x[k][j + 1][i], fy);
        mix(along_y(k), along_y(k + 1), fz)
    }
}

/// The lower voxel along an axis, and the position between it and the next one.
#[inline]
fn cell(position: f64, last: f64) -> (usize, f32) {
    let clamped = clamp(position, last);
    // An axis has fewer than 2³¹ voxels, and `i32` is the fastest type to convert to.
    let low = clamped as i32;
    (low as usize, (clamped - f64::from(low)) as f32)
}

/// A number moved into the range from 0 to `last`; 0 for NaN. Faster than `f64::clamp`.
#[inline]
pub fn clamp(x: f64, last: f64) -> f64 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < last { x } else { last }
}

/// The value a part of the way from `a` to `b`.
#[inline]
fn mix(a: f32, b: f32, part: f32) -> f32 {
    a + part * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutis_test_kit::Random;
    use cutis_volume::{Affine, Grid};

    /// The sum of 24 values, each interpolated on its own.
    #[test]
    fn gradient_is_the_mean_of_central_differences() {
        let mut random = Random::new(5);
        for shape in [[9, 8, 7], [2, 5, 1], [1, 3, 12]] {
            let grid = Grid { shape, affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
            let voxels = (0..grid.len()).map(|_| random.below(3000) as i16 - 1200).collect();
            let volume = Volume::new(grid, voxels, 1.5, -7.0).unwrap();
            let field = Field::new(&volume);
            for _ in 0..300 {
                // Also at voxel centers and outside of the grid.
                let position = Point3::from(shape.map(|n| {
                    let at = random.below(1000 * (n + 4)) as f64 / 1000.0 - 2.0;
                    if random.below(5) == 0 { at.round() } else { at }
                }));
                let mut exact = Vector3::zeros();
                for axis in 0..3 {
                    let unit =
                        |axis: usize| Vector3::<f64>::from_fn(|row, _| f64::from(u8::from(row == axis)));
                    let around = (0..3).flat_map(|other| [unit(other), -unit(other)]);
                    for center in around.chain([Vector3::zeros()]) {
                        let at = |end: f64| f64::from(field.at(position + center + end * unit(axis)));
                        exact[axis] += (at(1.0) - at(-1.0)) / 14.0;
                    }
                }
                let found = field.index_gradient(position);
                assert!((found - exact).norm() < 0.01, "{found} for {exact} at {position} of {shape:?}");
            }
        }
    }
}
