//! The rows of voxel centers that a tet holds. All rows of a tet are intersected with it at once,
//! in loops that vectorize.

use crate::lanes::{ceil, floor, integer, less, more};
use crate::raster::{Rasters, TetRaster};
use crate::tiling::TILE;

/// Part of the tolerance that covers the rounding of `f64`, so that a center on a shared face is
/// inside both tets.
const ROUNDING: f64 = 1.0 / 1024.0;

/// Rows of a slice that are intersected with a tet at once.
pub const ROWS: usize = 8;

/// The voxels of [`ROWS`] rows in each of some slices that a tet holds or comes near.
pub struct Rows {
    /// One bit per column of the tile. Row `n` of the `m`-th slice has the number `8 m + n`.
    pub near: [u64; ROWS * TILE[2]],
    /// Whether the levels of strictness differ for a voxel: see [`TetRaster::levels`].
    pub is_close: bool,
}

impl Rows {
    pub fn new() -> Self {
        Self { near: [0; ROWS * TILE[2]], is_close: false }
    }
}

/// Where rows cross a face: the column of row `(0, 0)`, its changes, and the tolerance in columns.
type Face = [f64; 4];

/// The voxels of some rows that a tet holds, as bits.
pub struct HeldColumns {
    /// Inside, or outside by at most the tolerance.
    pub near: u64,
    /// Inside or on a face, edge or corner, within the rounding of `f64`.
    pub inside: u64,
    /// Inside by more than the tolerance.
    pub strict: u64,
}

impl TetRaster<'_> {
    /// Finds the voxels of the rows from `j` on that the tet holds or comes near, for some slices
    /// and columns. Bits count columns from `start` on.
    #[inline(always)]
    pub fn rows(
        &self,
        j: usize,
        slices: (usize, usize),
        columns: (usize, usize),
        start: usize,
        found: &mut Rows,
    ) {
        let Rasters { at, by_j, by_k, slack, .. } = self.all;
        // Faces that do not exist limit no row.
        let mut enter: [Face; 4] = [[f64::NEG_INFINITY, 0.0, 0.0, 0.0]; 4];
        let mut leave: [Face; 4] = [[f64::INFINITY, 0.0, 0.0, 0.0]; 4];
        let (mut enters, mut leaves) = (0, 0);
        for c in 0..4 {
            let face = [at, by_j, by_k, slack].map(|of| of[c][self.lane]);
            if face[3].is_sign_positive() {
                enter[enters] = face;
                enters += 1;
            } else {
                leave[leaves] = face;
                leaves += 1;
            }
        }
        let ends = [columns.0 as f64, columns.1 as f64 - 1.0, start as f64];
        let [e0, e1, e2, _] = enter;
        let [l0, l1, l2, _] = leave;
        match enters {
            1 => find([j, slices.0], slices.1, ends, &[e0], &[l0, l1, l2], found),
            2 => find([j, slices.0], slices.1, ends, &[e0, e1], &[l0, l1], found),
            3 => find([j, slices.0], slices.1, ends, &[e0, e1, e2], &[l0], found),
            _ => find([j, slices.0], slices.1, ends, &enter, &leave, found),
        }
    }

    /// The voxels of row `(j, k)` that the tet holds, for each level of strictness.
    #[cold]
    #[inline(never)]
    pub fn levels(&self, [j, k]: [usize; 2], columns: (usize, usize), start: usize) -> HeldColumns {
        let Rasters { at, by_j, by_k, slack, .. } = self.all;
        let level = |times: f64| {
            let (mut low, mut high) = (columns.0 as f64, columns.1 as f64 - 1.0);
            for c in 0..4 {
                let [at, by_j, by_k, slack] = [at, by_j, by_k, slack].map(|of| of[c][self.lane]);
                let at = ((at + by_k * k as f64) + by_j * j as f64) + times * slack;
                if slack.is_sign_positive() {
                    low = more(at, low);
                } else {
                    high = less(at, high);
                }
            }
            if low > high {
                return 0;
            }
            let (first, end) = (integer(ceil(low)), integer(floor(high)) + 1);
            if first >= end { 0 } else { (u64::MAX >> (64 - (end - first))) << (first - start as u64) }
        };
        HeldColumns { near: level(0.0), inside: level(1.0 - ROUNDING), strict: level(2.0) }
    }
}

/// Finds the voxels between the faces where rows enter a tet and those where they leave it, in the
/// rows from `j` and the slices from `k` on. `last` is the last column that counts.
#[inline(always)]
fn find<const E: usize, const L: usize>(
    [j, k]: [usize; 2],
    slices_end: usize,
    [first_column, last, start]: [f64; 3],
    enter: &[Face; E],
    leave: &[Face; L],
    found: &mut Rows,
) {
    let count = ROWS * (slices_end - k);
    let bits = &mut found.near[..count];
    let (rows, slices) = (&ROW_OF[..count], &SLICE_OF[..count]);
    let (first_row, first_slice) = (j as f64, k as f64);
    let mut close = 0;
    for n in 0..count {
        let (j, k) = (first_row + rows[n], first_slice + slices[n]);
        let (mut low, mut strict_low) = (first_column, first_column);
        for [at, by_j, by_k, slack] in enter {
            let column = (at + by_k * k) + by_j * j;
            low = more(column, low);
            strict_low = more(column + 2.0 * slack, strict_low);
        }
        let (mut high, mut strict_high) = (last, last);
        for [at, by_j, by_k, slack] in leave {
            let column = (at + by_k * k) + by_j * j;
            high = less(column, high);
            strict_high = less(column + 2.0 * slack, strict_high);
        }
        let (first, end) = (ceil(low), floor(high));
        let some = u64::from(first <= end).wrapping_neg();
        close |= u64::from((strict_low > first) | (strict_high < end)) & some;
        let all = u64::MAX.wrapping_shr(63_u64.wrapping_sub(integer(end - first)) as u32);
        bits[n] = all.wrapping_shl(integer(first - start) as u32) & some;
    }
    found.is_close = close != 0;
}

/// The rows and slices of [`TetRaster::rows`], from the first ones on.
const ROW_OF: [f64; ROWS * TILE[2]] = numbers(1, ROWS);
const SLICE_OF: [f64; ROWS * TILE[2]] = numbers(ROWS, usize::MAX);

/// The numbers `n / divisor % modulus`.
const fn numbers<const N: usize>(divisor: usize, modulus: usize) -> [f64; N] {
    let mut numbers = [0.0; N];
    let mut n = 0;
    while n < N {
        numbers[n] = (n / divisor % modulus) as f64;
        n += 1;
    }
    numbers
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::raster::GROUP;
    use crate::spans::Spans;

    #[test]
    fn rows_list_exactly_the_centers_inside() {
        let corners = [[0.3, 0.2, 0.1], [7.7, 1.0, 2.0], [2.0, 8.3, 1.0], [3.0, 2.0, 6.6]].map(Point3::from);
        let mut flipped = corners;
        flipped.swap(1, 2);
        let both = [corners, flipped];
        // The tets alternate over the lanes.
        let eight = [0, 1, 2, 3].map(|c| [0, 1, 2].map(|axis| std::array::from_fn(|n| both[n % 2][c][axis])));
        let rasters = Rasters::new(&eight, 1e-9);
        let mut spans = Spans::empty();
        spans.fill(&rasters, &[0..10, 0..10, 0..10]);
        for lane in 0..GROUP {
            let corners = both[lane % 2];
            let raster = rasters.tet(lane).unwrap();
            let mut found = 0;
            let [columns, rows, slices] = spans.of(lane).unwrap();
            for j in (rows.0..rows.1).step_by(ROWS) {
                let mut held = Rows::new();
                raster.rows(j, slices, columns, 0, &mut held);
                assert!(!held.is_close, "none lies near a face");
                for m in 0..slices.1 - slices.0 {
                    for n in 0..ROWS.min(rows.1 - j) {
                        let bits = held.near[ROWS * m + n];
                        found += bits.count_ones() as usize;
                        let levels = raster.levels([j + n, slices.0 + m], columns, 0);
                        assert_eq!([levels.near, levels.inside, levels.strict], [bits; 3]);
                    }
                }
            }
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
}
