//! Hounsfield units of a volume at any position, by trilinear interpolation.

use cutis_volume::{AIR_HU, Volume};
use nalgebra::{Matrix3, Point3, Vector3};

/// A volume as a continuous field. Padding below air counts as air.
pub struct Field<'a> {
    volume: &'a Volume,
    voxels: &'a [i16],
    shape: [usize; 3],
    slope: f32,
    intercept: f32,
}

impl<'a> Field<'a> {
    pub fn new(volume: &'a Volume) -> Self {
        let (slope, intercept) = (volume.slope(), volume.intercept());
        Self { volume, voxels: volume.voxels(), shape: volume.grid().shape, slope, intercept }
    }

    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// HU of one voxel. Padding counts as air.
    #[inline]
    pub fn voxel(&self, index: usize) -> f32 {
        (self.slope * f32::from(self.voxels[index]) + self.intercept).max(AIR_HU)
    }

    /// HU at a continuous index, clamped to the grid.
    #[inline]
    pub fn at(&self, position: Point3<f64>) -> f32 {
        let (mut base, mut stride) = (0, 1);
        let mut step = [0; 3];
        let mut fraction = [0.0; 3];
        for axis in 0..3 {
            let last = self.shape[axis] - 1;
            let clamped = position[axis].max(0.0).min(last as f64);
            let low = clamped as usize;
            fraction[axis] = (clamped - low as f64) as f32;
            step[axis] = if low < last { stride } else { 0 };
            base += low * stride;
            stride *= self.shape[axis];
        }
        let [sx, sy, sz] = step;
        let [fx, fy, fz] = fraction;
        let mix = |a: f32, b: f32, part: f32| a + part * (b - a);
        let along_x = |at: usize| mix(self.voxel(at), self.voxel(at + sx), fx);
        let along_y = |at: usize| mix(along_x(at), along_x(at + sy), fy);
        mix(along_y(base), along_y(base + sz), fz)
    }

    /// HU at a world position in mm.
    pub fn at_mm(&self, mm: Point3<f64>) -> f32 {
        self.at(self.volume.grid().affine.to_index(mm))
    }

    /// Smoothed gradient of HU by index: central differences over one voxel to either side,
    /// averaged over the position and its six neighbors. Without the average, the steps between
    /// voxels appear as rings on the skin.
    pub fn index_gradient(&self, position: Point3<f64>) -> Vector3<f64> {
        let unit = |axis: usize| Vector3::from_fn(|row, _| if row == axis { 1.0 } else { 0.0 });
        let at = |offset: Vector3<f64>| f64::from(self.at(position + offset));
        let mut sum = Vector3::zeros();
        for axis in 0..3 {
            let along = unit(axis);
            sum[axis] += at(along) - at(-along) + at(along * 2.0) - at(along * -2.0);
            // Each diagonal neighbor contributes to the differences along both of its axes.
            let other = (axis + 1) % 3;
            let across = unit(other);
            let [pp, pm, mp, mm] =
                [at(along + across), at(along - across), at(across - along), at(-along - across)];
            sum[axis] += pp + pm - mp - mm;
            sum[other] += pp + mp - pm - mm;
        }
        sum / 14.0
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
