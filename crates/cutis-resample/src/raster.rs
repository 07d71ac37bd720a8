//! Tetrahedra over the voxel grid. [`GROUP`] tets are prepared at once, in loops that vectorize.

use nalgebra::Vector3;

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
    /// A group without tets.
    pub fn empty() -> Self {
        let zero = [0.0; GROUP];
        Self {
            constant: [zero; 4],
            gradient: [[zero; 3]; 4],
            at: [zero; 4],
            by_j: [zero; 4],
            by_k: [zero; 4],
            slack: [zero; 4],
            low: [zero; 3],
            high: [zero; 3],
            valid: [false; GROUP],
        }
    }

    /// Prepares a group of tets.
    pub fn new(corners: &Corners, tolerance: f64) -> Self {
        let mut all = Self::empty();
        all.fill(corners, tolerance);
        all
    }

    /// Prepares a group of tets in place of the ones before.
    #[inline(always)]
    pub fn fill(&mut self, corners: &Corners, tolerance: f64) {
        let [a, b, c, d] = corners;
        let zero = [[0.0; GROUP]; 3];
        let (mut ab, mut ac, mut ad) = (zero, zero, zero);
        for axis in 0..3 {
            for n in 0..GROUP {
                ab[axis][n] = b[axis][n] - a[axis][n];
                ac[axis][n] = c[axis][n] - a[axis][n];
                ad[axis][n] = d[axis][n] - a[axis][n];
            }
        }
        // The normals of the faces at the first corner.
        let (mut of_b, mut of_c, mut of_d) = (zero, zero, zero);
        for x in 0..3 {
            let (y, z) = ((x + 1) % 3, (x + 2) % 3);
            for n in 0..GROUP {
                of_b[x][n] = ac[y][n] * ad[z][n] - ac[z][n] * ad[y][n];
                of_c[x][n] = ad[y][n] * ab[z][n] - ad[z][n] * ab[y][n];
                of_d[x][n] = ab[y][n] * ac[z][n] - ab[z][n] * ac[y][n];
            }
        }
        let mut scale = [0.0; GROUP];
        for n in 0..GROUP {
            scale[n] = 1.0 / ((ab[0][n] * of_b[0][n] + ab[1][n] * of_b[1][n]) + ab[2][n] * of_b[2][n]);
        }
        let [g0, g1, g2, g3] = &mut self.gradient;
        for axis in 0..3 {
            for n in 0..GROUP {
                let (b, c, d) =
                    (of_b[axis][n] * scale[n], of_c[axis][n] * scale[n], of_d[axis][n] * scale[n]);
                g0[axis][n] = -((b + c) + d);
                g1[axis][n] = b;
                g2[axis][n] = c;
                g3[axis][n] = d;
            }
        }
        let mut sums = [0.0; GROUP];
        for [x, y, z] in &self.gradient {
            for n in 0..GROUP {
                sums[n] += x[n].abs() + y[n].abs() + z[n].abs();
            }
        }
        for n in 0..GROUP {
            self.valid[n] = sums[n].is_finite();
        }
        for corner in 0..4 {
            let [x, y, z] = &self.gradient[corner];
            let constant_at_corner = if corner == 0 { 1.0 } else { 0.0 };
            for n in 0..GROUP {
                let constant = constant_at_corner - ((x[n] * a[0][n] + y[n] * a[1][n]) + z[n] * a[2][n]);
                self.constant[corner][n] = constant;
                // A row parallel to the face crosses it far away, on the side that keeps or drops
                // the whole row. The lower bound of 1e-200 keeps the products finite.
                let along = if x[n].abs() < 1e-200 { 1e-200 } else { x[n] };
                let per_column = 1.0 / along;
                let length = ((x[n] * x[n] + y[n] * y[n]) + z[n] * z[n]).sqrt();
                let slack = tolerance * length * per_column;
                self.slack[corner][n] = slack;
                self.at[corner][n] = -constant * per_column - slack;
                self.by_j[corner][n] = -y[n] * per_column;
                self.by_k[corner][n] = -z[n] * per_column;
            }
        }
        self.surround(corners, tolerance);
    }

    /// Finds only the boxes around the tets.
    #[inline(always)]
    pub fn surround(&mut self, [a, b, c, d]: &Corners, tolerance: f64) {
        for axis in 0..3 {
            let (a, b, c, d) = (&a[axis], &b[axis], &c[axis], &d[axis]);
            for n in 0..GROUP {
                self.low[axis][n] = less(less(a[n], b[n]), less(c[n], d[n])) - tolerance;
                self.high[axis][n] = more(more(a[n], b[n]), more(c[n], d[n])) + tolerance;
            }
        }
    }

    /// One of the tets. `None` if it has no volume.
    #[inline(always)]
    pub fn tet(&self, lane: usize) -> Option<TetRaster<'_>> {
        self.valid[lane].then_some(TetRaster { all: self, lane })
    }
}

/// The maps from deformed to rest voxel indices inside the tets of a group.
pub struct RestMaps {
    linear: [[Each; 3]; 3],
    offset: [Each; 3],
}

impl RestMaps {
    /// A group without tets.
    pub fn empty() -> Self {
        Self { linear: [[[0.0; GROUP]; 3]; 3], offset: [[0.0; GROUP]; 3] }
    }

    /// For each tet the map from deformed to rest indices, for these corners at rest.
    pub fn new(rasters: &Rasters, rest: &Corners) -> Self {
        let mut maps = Self::empty();
        maps.fill(rasters, rest);
        maps
    }

    /// Does the same in place of the maps before.
    #[inline(always)]
    pub fn fill(&mut self, rasters: &Rasters, rest: &Corners) {
        let Self { linear, offset } = self;
        *linear = [[[0.0; GROUP]; 3]; 3];
        *offset = rest[0];
        for corner in 1..4 {
            for row in 0..3 {
                let mut edge = [0.0; GROUP];
                for n in 0..GROUP {
                    edge[n] = rest[corner][row][n] - rest[0][row][n];
                }
                for column in 0..3 {
                    let (sum, gradient) = (&mut linear[row][column], &rasters.gradient[corner][column]);
                    for n in 0..GROUP {
                        sum[n] += edge[n] * gradient[n];
                    }
                }
                for n in 0..GROUP {
                    offset[row][n] += edge[n] * rasters.constant[corner][n];
                }
            }
        }
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_tet_has_no_raster() {
        let flat = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]];
        assert!(Rasters::new(&flat.map(|corner| corner.map(|x| [x; GROUP])), 1e-6).tet(0).is_none());
    }
}
