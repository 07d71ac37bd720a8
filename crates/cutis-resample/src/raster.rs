//! One tetrahedron as four linear functions over the voxel grid, and the rows of voxel centres that it covers.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

/// Barycentric coordinates of a tet as linear functions `λ(x) = constant + gradient · x` of the continuous voxel index.
///
/// A centre counts as inside when no face has it further out than the tolerance, a length in voxels. With the rounding of
/// `f32` positions as tolerance no centre falls between two tets that share a face.
pub struct TetRaster {
    constant: [f64; 4],
    /// ∂λ/∂i, ∂λ/∂j, ∂λ/∂k of the four corners.
    gradient: [[f64; 4]; 3],
    /// The tolerance in units of each coordinate: tolerance · |∇λ|.
    slack: [f64; 4],
    /// 1/∂λ/∂i; a huge positive number where that is zero.
    inverse_x: [f64; 4],
    low: [f64; 3],
    high: [f64; 3],
}

/// How firmly a tet holds a voxel centre.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Hold {
    /// Outside by less than the tolerance.
    Near,
    /// Inside, or on a face, edge or corner.
    Inside,
    /// Inside by more than the tolerance.
    Strict,
}

impl TetRaster {
    /// `None` for a tet without volume.
    pub fn new(corners: &[Point3<f64>; 4], tolerance: f64) -> Option<Self> {
        let edge: [Vector3<f64>; 3] = std::array::from_fn(|i| corners[i + 1] - corners[0]);
        let normal = [edge[1].cross(&edge[2]), edge[2].cross(&edge[0]), edge[0].cross(&edge[1])];
        let scale = 1.0 / edge[0].dot(&normal[0]);
        let [g1, g2, g3] = normal.map(|n| n * scale);
        let g = [-(g1 + g2 + g3), g1, g2, g3];
        if !g.iter().all(|v| v.iter().all(|c| c.is_finite())) {
            return None;
        }
        let from = corners[0].coords;
        let offset = |i: usize| if i == 0 { 1.0 } else { 0.0 };
        let at = |bound: fn(f64, f64) -> f64| {
            let reduce = |axis: usize| corners.iter().map(|c| c[axis]).reduce(bound).unwrap_or(0.0);
            [reduce(0), reduce(1), reduce(2)]
        };
        Some(Self {
            constant: std::array::from_fn(|i| offset(i) - g[i].dot(&from)),
            gradient: std::array::from_fn(|axis| g.map(|v| v[axis])),
            slack: g.map(|v| tolerance * v.norm()),
            inverse_x: g.map(|v| if v.x == 0.0 { 1e300 } else { 1.0 / v.x }),
            low: at(f64::min).map(|v| v - tolerance),
            high: at(f64::max).map(|v| v + tolerance),
        })
    }

    /// Visits the rows of `region` that hold centres of this tet: `visit(j, k, i_range, λ at i = 0 of the row)`.
    #[inline]
    pub fn rows(
        &self,
        region: &[Range<usize>; 3],
        mut visit: impl FnMut(usize, usize, Range<usize>, [f64; 4]),
    ) {
        let [columns, rows, slices] =
            [0, 1, 2].map(|axis| covered(self.low[axis], self.high[axis], &region[axis]));
        for k in slices {
            for j in rows.clone() {
                let (y, z) = (j as f64, k as f64);
                let base: [f64; 4] = std::array::from_fn(|c| {
                    self.constant[c] + self.gradient[1][c] * y + self.gradient[2][c] * z
                });
                let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
                for c in 0..4 {
                    let crossing = (-self.slack[c] - base[c]) * self.inverse_x[c];
                    if self.inverse_x[c] > 0.0 {
                        low = if crossing > low { crossing } else { low };
                    } else {
                        high = if crossing < high { crossing } else { high };
                    }
                }
                let range = covered(low, high, &columns);
                if !range.is_empty() {
                    visit(j, k, range, base);
                }
            }
        }
    }

    /// How the tet holds column `i` of a row visited by [`TetRaster::rows`].
    #[inline]
    pub fn hold(&self, base: &[f64; 4], i: usize) -> Hold {
        let lambda = self.lambda(base, i);
        let (mut inside, mut strict) = (true, true);
        for c in 0..4 {
            inside &= lambda[c] >= 0.0;
            strict &= lambda[c] > self.slack[c];
        }
        match (inside, strict) {
            (_, true) => Hold::Strict,
            (true, _) => Hold::Inside,
            _ => Hold::Near,
        }
    }

    /// ∇λ of a corner.
    pub fn gradient_of(&self, corner: usize) -> Vector3<f64> {
        Vector3::new(self.gradient[0][corner], self.gradient[1][corner], self.gradient[2][corner])
    }

    /// λ of a corner at voxel index (0, 0, 0).
    pub fn constant_of(&self, corner: usize) -> f64 {
        self.constant[corner]
    }

    /// Barycentric coordinates of column `i` of a row.
    #[inline]
    pub fn lambda(&self, base: &[f64; 4], i: usize) -> [f64; 4] {
        let x = i as f64;
        std::array::from_fn(|c| base[c] + self.gradient[0][c] * x)
    }
}

/// The integers of `within` between `low` and `high`, both included.
#[inline]
fn covered(low: f64, high: f64, within: &Range<usize>) -> Range<usize> {
    let first = within.start as f64;
    let last = within.end as f64 - 1.0;
    let low = if low > first { low } else { first };
    let high = if high < last { high } else { last };
    // Both are non-negative where there is something to cover, so that the conversion's truncation is a floor.
    let floor = low as usize;
    let start = floor + usize::from((floor as f64) < low);
    if low <= high { start..high as usize + 1 } else { start..start }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covered_keeps_both_ends_and_stays_within() {
        assert_eq!(covered(1.0, 3.0, &(0..10)), 1..4);
        assert_eq!(covered(1.1, 2.9, &(0..10)), 2..3);
        assert_eq!(covered(-7.0, 99.0, &(2..5)), 2..5);
        assert!(covered(3.2, 3.8, &(0..10)).is_empty());
        assert!(covered(12.0, 14.0, &(0..10)).is_empty());
        assert!(covered(-3.0, -1.0, &(0..10)).is_empty());
        assert!(covered(f64::NAN, 1.0, &(0..0)).is_empty());
    }

    #[test]
    fn rows_list_exactly_the_centres_inside() {
        let corners = [[0.3, 0.2, 0.1], [7.7, 1.0, 2.0], [2.0, 8.3, 1.0], [3.0, 2.0, 6.6]].map(Point3::from);
        let mut flipped = corners;
        flipped.swap(1, 2);
        for corners in [corners, flipped] {
            let raster = TetRaster::new(&corners, 1e-9).unwrap();
            let mut found = 0;
            raster.rows(&[0..10, 0..10, 0..10], |_, _, range, base| {
                found += range.clone().filter(|&i| raster.hold(&base, i) == Hold::Strict).count();
                assert!(range.clone().all(|i| raster.hold(&base, i) != Hold::Near));
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
