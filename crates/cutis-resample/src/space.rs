//! The map from local meters of the mesh to continuous voxel indices of the volume.

use cutis_volume::Affine;
use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

/// An affine map from local meters to voxel indices, with the rounding error of `f32` positions.
pub struct IndexSpace {
    /// Voxels per meter.
    pub linear: Matrix3<f64>,
    /// Voxel index of the local origin.
    pub offset: Vector3<f64>,
    /// Length in voxels below which two `f32` positions cannot be distinguished.
    pub tolerance: f64,
}

impl IndexSpace {
    /// The map for a mesh with its local origin at `origin_mm`. The tolerance is four roundings of
    /// the largest coordinate of `positions`.
    pub fn new(affine: &Affine, origin_mm: Point3<f64>, positions: [&[Point3<f32>]; 2]) -> Self {
        // A power of two, so that the division is exact, and about the size of a body.
        let reach = 1024.0;
        let zero = affine.to_index(Point3::origin());
        let column = |axis: usize| {
            let mut end = Point3::origin();
            end[axis] = reach;
            (affine.to_index(end) - zero) * (1000.0 / reach)
        };
        let linear = Matrix3::from_columns(&[column(0), column(1), column(2)]);
        let extent =
            |points: &[Point3<f32>]| points.par_iter().map(|p| p.coords.amax()).reduce(|| 0.0, f32::max);
        let largest = f64::from(extent(positions[0]).max(extent(positions[1])));
        let stretch = (0..3).map(|row| linear.row(row).norm()).fold(0.0, f64::max);
        Self {
            linear,
            offset: affine.to_index(origin_mm).coords,
            tolerance: 4.0 * f64::from(f32::EPSILON) * largest * stretch,
        }
    }

    /// Continuous voxel index of a position in local meters.
    #[inline]
    pub fn index(&self, local: Point3<f32>) -> Point3<f64> {
        Point3::from(self.linear * local.coords.map(f64::from) + self.offset)
    }

    /// Continuous voxel indices of positions in local meters.
    pub fn indices(&self, positions: &[Point3<f32>]) -> Vec<Point3<f64>> {
        positions.par_iter().map(|&position| self.index(position)).collect()
    }

    /// The third component of [`IndexSpace::index`], with the same bits.
    #[inline]
    pub fn slice(&self, local: Point3<f32>) -> f64 {
        self.index(local).z
    }
}
