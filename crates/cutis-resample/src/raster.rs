//! Tetrahedra over the voxel grid. [`GROUP`] tets are prepared at once, in loops that vectorize.

use nalgebra::{Point3, Vector3};

use crate::lanes::{less, more};

/// Number of tets that are prepared at once.
pub const GROUP: usize = 32;

/// One number for each tet of a group.
type Each = [f64; GROUP];

/// Corners of the tets of a group in continuous voxel indices, by corner and axis.
pub type Corners = [[Each; 3]; 4];

/// A group of deformed tets over the voxel grid.
///
/// Barycentric coordinates are linear functions `λ(x) = constant + gradient · x` of the continuous
/// voxel index. A center counts as inside if it is at most the tolerance (a length in voxels)
/// outside of every face. With the rounding of `f32` positions as tolerance, no center falls
/// between two tets that share a face.
pub struct Rasters {
    constant: [Each; 4],
    gradient: [[Each; 3]; 4],
    /// Where rows cross the faces. Row `(j, k)` crosses a face at column `at + by_j · j + by_k ·
    /// k`.
    pub at: [Each; 4],
    pub by_j: [Each; 4],
    pub by_k: [Each; 4],
    /// The tolerance as a number of columns: positive at a face where rows enter the tet, negative
    /// where they leave it. Includes the sign of a tolerance of zero.
    pub slack: [Each; 4],
    pub low: [Each; 3],
    pub high: [Each; 3],
    /// False for a tet without a volume.
    valid: [bool; GROUP],
}

/// One tet of a group.
#[derive(Clone, Copy)]
pub struct TetRaster<'a> {
    pub all: &'a Rasters,
    pub lane: usize,
}

impl Rasters {
    /// Prepares a group of tets.
    #[inline(always)]
    pub fn new(corners: &Corners, tolerance: f64) -> Self {
        let zero = [0.0; GROUP];
        let mut all = Self {
            constant: [[1.0; GROUP], zero, zero, zero],
            gradient: [[zero; 3]; 4],
            at: [zero; 4],
            by_j: [zero; 4],
            by_k: [zero; 4],
            slack: [zero; 4],
            low: [zero; 3],
            high: [zero; 3],
            valid: [true; GROUP],
        };
        let [a, b, c, d] = corners;
        for n in 0..GROUP {
            let edge = |end: &[Each; 3]| [end[0][n] - a[0][n], end[1][n] - a[1][n], end[2][n] - a[2][n]];
            let (ab, ac, ad) = (edge(b), edge(c), edge(d));
            let (n1, n2, n3) = (cross(ac, ad), cross(ad, ab), cross(ab, ac));
            let scale = 1.0 / dot(ab, n1);
            for axis in 0..3 {
                let (g1, g2, g3) = (n1[axis] * scale, n2[axis] * scale, n3[axis] * scale);
                all.gradient[0][axis][n] = -((g1 + g2) + g3);
                all.gradient[1][axis][n] = g1;
                all.gradient[2][axis][n] = g2;
                all.gradient[3][axis][n] = g3;
            }
        }
        for n in 0..GROUP {
            let mut sum = 0.0;
            for gradient in &all.gradient {
                sum += gradient[0][n].abs() + gradient[1][n].abs() + gradient[2][n].abs();
            }
            all.valid[n] = sum.is_finite();
        }
        for corner in 0..4 {
            for n in 0..GROUP {
                let g = [0, 1, 2].map(|axis| all.gradient[corner][axis][n]);
                let constant = all.constant[corner][n] - dot(g, [a[0][n], a[1][n], a[2][n]]);
                all.constant[corner][n] = constant;
                // A row parallel to the face crosses it far away, on the side that keeps or drops
                // the whole row. The lower bound of 1e-200 keeps the products finite.
                let along = if g[0].abs() < 1e-200 { 1e-200 } else { g[0] };
                let per_column = 1.0 / along;
                let slack = tolerance * dot(g, g).sqrt() * per_column;
                all.slack[corner][n] = slack;
                all.at[corner][n] = -constant * per_column - slack;
                all.by_j[corner][n] = -g[1] * per_column;
                all.by_k[corner][n] = -g[2] * per_column;
            }
        }
        for axis in 0..3 {
            let [a, b, c, d] = [a, b, c, d].map(|corner| &corner[axis]);
            for n in 0..GROUP {
                all.low[axis][n] = less(less(a[n], b[n]), less(c[n], d[n])) - tolerance;
                all.high[axis][n] = more(more(a[n], b[n]), more(c[n], d[n])) + tolerance;
            }
        }
        all
    }

    /// One of the tets. `None` if it has no volume.
    #[inline(always)]
    pub fn tet(&self, lane: usize) -> Option<TetRaster<'_>> {
        self.valid[lane].then_some(TetRaster { all: self, lane })
    }

    /// For each tet the map from deformed to rest indices, for these corners at rest.
    #[inline(always)]
    pub fn rest_maps(&self, rest: &Corners) -> RestMaps {
        let mut linear = [[[0.0; GROUP]; 3]; 3];
        let mut offset = rest[0];
        for corner in 1..4 {
            for row in 0..3 {
                for n in 0..GROUP {
                    let edge = rest[corner][row][n] - rest[0][row][n];
                    for column in 0..3 {
                        linear[row][column][n] += edge * self.gradient[corner][column][n];
                    }
                    offset[row][n] += edge * self.constant[corner][n];
                }
            }
        }
        RestMaps { linear, offset }
    }
}

/// The maps from deformed to rest voxel indices inside the tets of a group.
pub struct RestMaps {
    linear: [[Each; 3]; 3],
    offset: [Each; 3],
}

impl RestMaps {
    /// The matrix of one map by rows, and its offset.
    #[inline(always)]
    pub fn map(&self, lane: usize) -> ([[f64; 3]; 3], [f64; 3]) {
        let mut linear = [[0.0; 3]; 3];
        let mut offset = [0.0; 3];
        for row in 0..3 {
            for column in 0..3 {
                linear[row][column] = self.linear[row][column][lane];
            }
            offset[row] = self.offset[row][lane];
        }
        (linear, offset)
    }

    /// The rest index of a deformed index.
    pub fn at(&self, lane: usize, index: [f64; 3]) -> [f64; 3] {
        let (linear, offset) = self.map(lane);
        [0, 1, 2].map(|row| dot(linear[row], index) + offset[row])
    }
}

/// A group that has the same tet in all places.
pub fn in_all_lanes(corners: &[Point3<f64>; 4]) -> Corners {
    corners.map(|corner| [0, 1, 2].map(|axis| [corner[axis]; GROUP]))
}

impl TetRaster<'_> {
    /// Barycentric coordinates of a center.
    pub fn lambda(&self, center: [f64; 3]) -> [f64; 4] {
        let center = Vector3::from(center);
        std::array::from_fn(|c| self.constant_of(c) + self.gradient_of(c).dot(&center))
    }

    /// The rest index for a center just outside the tet. The barycentric coordinates are clamped to
    /// the tet, however thin it is.
    pub fn nearest(&self, center: [f64; 3], rest: &Corners) -> [f64; 3] {
        let held = self.lambda(center).map(|l| l.max(0.0));
        let sum: f64 = held.iter().sum();
        [0, 1, 2].map(|axis| (0..4).fold(0.0, |at, c| at + rest[c][axis][self.lane] * (held[c] / sum)))
    }

    /// Gradient of the barycentric coordinate of a corner.
    #[inline]
    pub fn gradient_of(&self, corner: usize) -> Vector3<f64> {
        Vector3::from([0, 1, 2].map(|axis| self.all.gradient[corner][axis][self.lane]))
    }

    /// Barycentric coordinate of a corner at voxel index (0, 0, 0).
    #[inline]
    pub fn constant_of(&self, corner: usize) -> f64 {
        self.all.constant[corner][self.lane]
    }
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_tet_has_no_raster() {
        let flat = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]];
        assert!(Rasters::new(&flat.map(|corner| corner.map(|x| [x; GROUP])), 1e-6).tet(0).is_none());
    }
}
