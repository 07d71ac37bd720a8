//! A regular grid of points in world space: the voxel centers of a volume, or the vertices of a lattice.

use nalgebra::Point3;

use crate::Affine;

/// `shape[0] × shape[1] × shape[2]` points, index `i` fastest, placed in world millimeters by an [`Affine`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Points per axis.
    pub shape: [usize; 3],
    /// Index → mm.
    pub affine: Affine,
}

impl Grid {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Number of points; none if some axis has no points, or there are more than memory can address.
    pub fn checked_len(&self) -> Option<usize> {
        self.shape.iter().try_fold(1usize, |len, &n| len.checked_mul(n)).filter(|&len| len > 0)
    }

    /// True if some axis has no points.
    pub fn is_empty(&self) -> bool {
        self.shape.contains(&0)
    }

    /// Flat index of point `(i, j, k)`: `i + nx (j + ny k)`.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.shape[0] * (j + self.shape[1] * k)
    }

    /// The point of a flat index.
    pub fn point(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.shape;
        [index % nx, (index / nx) % ny, index / (nx * ny)]
    }

    /// World position of a point, mm.
    pub fn mm(&self, [i, j, k]: [usize; 3]) -> Point3<f64> {
        self.affine.to_mm(Point3::new(i as f64, j as f64, k as f64))
    }
}
