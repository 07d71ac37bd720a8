//! One tetrahedron over the voxel grid, and the rows of voxel centers that it covers.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

/// Part of the tolerance that covers the rounding of `f64`, so that a center on a shared face is
/// inside both tets.
const ROUNDING: f64 = 1.0 / 1024.0;

/// A deformed tet over the voxel grid.
///
/// Its barycentric coordinates are linear functions `λ(x) = constant + gradient · x` of the
/// continuous voxel index. A center counts as inside if it is at most the tolerance (a length in
/// voxels) outside of every face. With the rounding of `f32` positions as tolerance, no center
/// falls between two tets that share a face.
pub struct TetRaster {
    constant: [f64; 4],
    gradient: [Vector3<f64>; 4],
    /// Columns where a row enters the tet: the largest of four.
    enter: Crossings,
    /// Columns where a row leaves the tet: the smallest of four.
    leave: Crossings,
    low: [f64; 3],
    high: [f64; 3],
}

/// Columns at which row `(j, k)` crosses the four faces: `constant + by_j · j + by_k · k`. A face
/// that the row crosses in the other direction has an infinite constant, and so has no effect.
struct Crossings {
    constant: [f64; 4],
    by_j: [f64; 4],
    by_k: [f64; 4],
    /// The tolerance as a number of columns, positive towards the inside.
    slack: [f64; 4],
}

/// Ranges of columns of a row, as first and end, for three strictness levels of the test whether
/// the tet holds a center. Each range lies within the previous one.
#[derive(Clone, Copy)]
pub struct HeldColumns {
    /// Inside, or outside by at most the tolerance.
    pub near: (usize, usize),
    /// Inside or on a face, edge or corner, within the rounding of `f64`.
    pub inside: (usize, usize),
    /// Inside by more than the tolerance.
    pub strict: (usize, usize),
}

impl TetRaster {
    /// Prepares a tet. `None` if it has no volume.
    #[inline]
    pub fn new(corners: &[Point3<f64>; 4], tolerance: f64) -> Option<Self> {
        let [a, b, c, d] = corners;
        let (ab, ac, ad) = (b - a, c - a, d - a);
        let (n1, n2, n3) = (ac.cross(&ad), ad.cross(&ab), ab.cross(&ac));
        let scale = 1.0 / ab.dot(&n1);
        let (g1, g2, g3) = (n1 * scale, n2 * scale, n3 * scale);
        let gradient = [-(g1 + g2 + g3), g1, g2, g3];
        if !(gradient[0].abs() + g1.abs() + g2.abs() + g3.abs()).sum().is_finite() {
            return None;
        }
        let mut constant = [1.0, 0.0, 0.0, 0.0];
        let mut enter = Crossings::none(f64::NEG_INFINITY);
        let mut leave = Crossings::none(f64::INFINITY);
        for corner in 0..4 {
            let g = &gradient[corner];
            constant[corner] -= g.dot(&a.coords);
            // A row parallel to the face crosses it far away, on the side that keeps or drops the
            // whole row. The lower bound of 1e-200 keeps the products finite.
            let along = if g.x.abs() < 1e-200 { 1e-200 } else { g.x };
            let crossings = if along > 0.0 { &mut enter } else { &mut leave };
            let per_column = 1.0 / along;
            crossings.slack[corner] = tolerance * g.norm() * per_column;
            crossings.constant[corner] = -constant[corner] * per_column - crossings.slack[corner];
            crossings.by_j[corner] = -g.y * per_column;
            crossings.by_k[corner] = -g.z * per_column;
        }
        let mut raster = Self { constant, gradient, enter, leave, low: [0.0; 3], high: [0.0; 3] };
        for axis in 0..3 {
            raster.low[axis] = less(less(a[axis], b[axis]), less(c[axis], d[axis])) - tolerance;
            raster.high[axis] = more(more(a[axis], b[axis]), more(c[axis], d[axis])) + tolerance;
        }
        Some(raster)
    }

    /// Calls `visit(j, k, row)` for the rows of `region` that come near the tet.
    #[inline(always)]
    pub fn rows(&self, region: &[Range<usize>; 3], mut visit: impl FnMut(usize, usize, RowCrossings<'_>)) {
        let span =
            |axis: usize| covered(self.low[axis], self.high[axis], region[axis].start, region[axis].end);
        let (columns, rows, slices) = (span(0), span(1), span(2));
        for k in slices.0..slices.1 {
            let (enter_slice, leave_slice) = (self.enter.slice(k as f64), self.leave.slice(k as f64));
            for j in rows.0..rows.1 {
                let enter = self.enter.row(&enter_slice, j as f64);
                let leave = self.leave.row(&leave_slice, j as f64);
                let near = covered(largest(&enter), smallest(&leave), columns.0, columns.1);
                if near.0 < near.1 {
                    visit(j, k, RowCrossings { raster: self, enter, leave, near });
                }
            }
        }
    }

    /// Barycentric coordinates of a center.
    pub fn lambda(&self, center: [f64; 3]) -> [f64; 4] {
        std::array::from_fn(|c| self.constant[c] + self.gradient[c].dot(&Vector3::from(center)))
    }

    /// Gradient of the barycentric coordinate of a corner.
    #[inline]
    pub fn gradient_of(&self, corner: usize) -> Vector3<f64> {
        self.gradient[corner]
    }

    /// Barycentric coordinate of a corner at voxel index (0, 0, 0).
    #[inline]
    pub fn constant_of(&self, corner: usize) -> f64 {
        self.constant[corner]
    }
}

impl Crossings {
    #[inline]
    fn none(far: f64) -> Self {
        Self { constant: [far; 4], by_j: [0.0; 4], by_k: [0.0; 4], slack: [0.0; 4] }
    }

    #[inline]
    fn slice(&self, k: f64) -> [f64; 4] {
        std::array::from_fn(|c| self.constant[c] + self.by_k[c] * k)
    }

    #[inline]
    fn row(&self, slice: &[f64; 4], j: f64) -> [f64; 4] {
        std::array::from_fn(|c| slice[c] + self.by_j[c] * j)
    }
}

/// One row with its crossings of the tet's faces.
pub struct RowCrossings<'a> {
    raster: &'a TetRaster,
    enter: [f64; 4],
    leave: [f64; 4],
    /// Columns, as first and end, that are inside or outside by at most the tolerance.
    pub near: (usize, usize),
}

impl RowCrossings<'_> {
    /// The ranges of columns for the three strictness levels.
    #[inline]
    pub fn columns(&self) -> HeldColumns {
        let level = |times: f64| {
            let enter = std::array::from_fn(|c| self.enter[c] + times * self.raster.enter.slack[c]);
            let leave = std::array::from_fn(|c| self.leave[c] + times * self.raster.leave.slack[c]);
            covered(largest(&enter), smallest(&leave), self.near.0, self.near.1)
        };
        HeldColumns { near: self.near, inside: level(1.0 - ROUNDING), strict: level(2.0) }
    }
}

/// The smaller number. It does not handle NaN, which takes [`f64::min`] three more instructions.
#[inline]
fn less(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger number, without handling NaN.
#[inline]
fn more(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline]
fn smallest(x: &[f64; 4]) -> f64 {
    less(less(x[0], x[1]), less(x[2], x[3]))
}

#[inline]
fn largest(x: &[f64; 4]) -> f64 {
    more(more(x[0], x[1]), more(x[2], x[3]))
}

/// The integers of `start..end` in the closed interval from `low` to `high`, as first and end.
#[inline]
fn covered(low: f64, high: f64, start: usize, end: usize) -> (usize, usize) {
    let low = more(low, start as f64);
    let high = less(high, end as f64 - 1.0);
    if low <= high {
        // Both are in the range and not negative, so that truncation is a floor.
        let floor = low as usize;
        (floor + usize::from((floor as f64) < low), high as usize + 1)
    } else {
        (start, start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covered_keeps_both_ends_and_stays_within() {
        let covered = |low, high, within: Range<usize>| {
            let (first, end) = covered(low, high, within.start, within.end);
            first..end
        };
        assert_eq!(covered(1.0, 3.0, 0..10), 1..4);
        assert_eq!(covered(1.1, 2.9, 0..10), 2..3);
        assert_eq!(covered(-7.0, 99.0, 2..5), 2..5);
        assert!(covered(3.2, 3.8, 0..10).is_empty());
        assert!(covered(12.0, 14.0, 0..10).is_empty());
        assert!(covered(-3.0, -1.0, 0..10).is_empty());
        assert!(covered(f64::NAN, 1.0, 0..0).is_empty());
    }

    #[test]
    fn rows_list_exactly_the_centers_inside() {
        let corners = [[0.3, 0.2, 0.1], [7.7, 1.0, 2.0], [2.0, 8.3, 1.0], [3.0, 2.0, 6.6]].map(Point3::from);
        let mut flipped = corners;
        flipped.swap(1, 2);
        for corners in [corners, flipped] {
            let raster = TetRaster::new(&corners, 1e-9).unwrap();
            let mut found = 0;
            raster.rows(&[0..10, 0..10, 0..10], |_, _, row| {
                let row = row.columns();
                found += row.strict.1 - row.strict.0;
                assert_eq!((row.near, row.inside), (row.strict, row.strict), "no center lies near a face");
            });
            let mut expected = 0;
            let all: f64 = volume(corners).abs();
            for i in 0..1000 {
                let p = Point3::new((i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64);
                let parts: f64 = (0..4)
                    .map(|c| {
                        let mut part = corners;
                        part[c] = p;
                        volume(part).abs()
                    })
                    .sum();
                expected += usize::from(parts <= all * (1.0 + 1e-12));
            }
            assert_eq!(found, expected);
            assert!(found > 20);
        }
    }

    fn volume(c: [Point3<f64>; 4]) -> f64 {
        (c[1] - c[0]).dot(&(c[2] - c[0]).cross(&(c[3] - c[0])))
    }

    #[test]
    fn a_flat_tet_has_no_raster() {
        let flat = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]].map(Point3::from);
        assert!(TetRaster::new(&flat, 1e-6).is_none());
    }
}
