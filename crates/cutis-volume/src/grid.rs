//! Regular grids of points in world space.

use nalgebra::Point3;
use ndarray::{ArrayView3, ShapeBuilder};

use crate::{Affine, VolumeError};

/// A regular grid of points: the voxel centers of a volume, or the vertices of a lattice.
///
/// It has `shape[0] × shape[1] × shape[2]` points. Arrays over a grid are flat, with index `i`
/// fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Number of points along each axis.
    pub shape: [usize; 3],
    /// Maps a point index to RAS+ world millimeters.
    pub affine: Affine,
}

impl Grid {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Number of points. `None` if an axis has no points or the number overflows `usize`.
    pub fn checked_len(&self) -> Option<usize> {
        self.shape.iter().try_fold(1usize, |len, &n| len.checked_mul(n)).filter(|&len| len > 0)
    }

    /// True if an axis has no points.
    pub fn is_empty(&self) -> bool {
        self.shape.contains(&0)
    }

    /// Flat index of the point `(i, j, k)`: `i + nx (j + ny k)`.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.shape[0] * (j + self.shape[1] * k)
    }

    /// The point `(i, j, k)` of a flat index.
    pub fn point(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.shape;
        [index % nx, (index / nx) % ny, index / (nx * ny)]
    }

    /// World position of a point in mm.
    pub fn mm(&self, [i, j, k]: [usize; 3]) -> Point3<f64> {
        self.affine.to_mm(Point3::new(i as f64, j as f64, k as f64))
    }

    /// Views one value per point as an `ndarray` array, without a copy.
    ///
    /// The view has the shape `shape` and is indexed `[i, j, k]`: axis 0 is `i`, which varies
    /// fastest in memory, axis 2 is `k`. It works for any field over a volume or a lattice, such as
    /// the result of [`sample::to_grid`](crate::sample::to_grid).
    ///
    /// ```
    /// use cutis_volume::{Affine, Grid};
    /// let grid = Grid { shape: [4, 3, 2], affine: Affine::from_spacing([1.0; 3], [0.0; 3])? };
    /// let field: Vec<f32> = (0..24).map(|n| n as f32).collect();
    /// let view = grid.view(&field)?;
    /// assert_eq!(view[[1, 2, 1]], field[grid.index([1, 2, 1])]);
    /// assert_eq!((view.dim(), view.strides()), ((4, 3, 2), &[1, 4, 12][..]));
    /// // The second slice along k.
    /// assert_eq!(view.index_axis(ndarray::Axis(2), 1).sum(), (12..24).sum::<i32>() as f32);
    /// # Ok::<(), cutis_volume::VolumeError>(())
    /// ```
    ///
    /// # Errors
    /// [`VolumeError::VoxelCount`] if `values` does not have one value per point.
    /// [`VolumeError::Shape`] if the grid has no points or more than memory can address.
    pub fn view<'a, T>(&self, values: &'a [T]) -> Result<ArrayView3<'a, T>, VolumeError> {
        let impossible = VolumeError::Shape { shape: self.shape };
        let Some(expected) = self.checked_len() else { return Err(impossible) };
        if values.len() != expected {
            return Err(VolumeError::VoxelCount { shape: self.shape, expected, found: values.len() });
        }
        ArrayView3::from_shape(self.shape.f(), values).map_err(|_| impossible)
    }
}
