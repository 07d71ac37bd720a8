//! The rows of voxel centers that a small tet holds, in `f32`, unless a center is close to a face.
//!
//! [`TetRaster::rows`](crate::raster::TetRaster::rows) decides in `f64` which centers a tet holds.
//! Most centers are so far from all faces that `f32` decides the same, with half the work. Here
//! each column where a row crosses a face has a bound of its error, and a tet is left to `f64` if
//! the bound, or the tolerance of the tet, reaches a center. So the results are those of `f64`.

use crate::raster::{GROUP, Rasters};
use crate::spans::Spans;
use crate::tiling::TILE;

/// Most rows, slices and columns of a small tet.
const MOST_ROWS: usize = 8;
const MOST_COLUMNS: u32 = 31;
const MOST: usize = MOST_ROWS * MOST_ROWS;

/// Rows that are intersected with a tet at once.
const LANES: usize = 16;
/// Times that this happens for a tet with the most rows.
const CHUNKS: usize = MOST / LANES;

/// Largest relative error of a column, with four roundings of `f32` for each of its parts.
const ERROR: f32 = 8.0 * f32::EPSILON;

/// Largest tolerance, in voxels, with which the errors stay finite.
const LARGEST_TOLERANCE: f64 = 1.0 / 1024.0;

/// Size of a column from which on `f32` does not represent it. A face that is nearly parallel to
/// the rows is crossed that far away.
const FARTHEST: f64 = 1e30;

/// One number for each tet of a group.
type Each = [f32; GROUP];

/// The faces of a group of tets, relative to the first voxel of their boxes. Faces where rows enter
/// a tet come before those where rows leave it.
pub struct ClearFaces {
    /// Columns between which row `(0, 0)` crosses each face: the least and the most for a face
    /// where rows enter the tet, then the most and the least for one where they leave it. They are
    /// infinite for the other faces.
    at: [[Each; 4]; 4],
    /// Changes of these columns.
    by_j: [Each; 4],
    by_k: [Each; 4],
    /// Whether a tet is small.
    small: [bool; GROUP],
}

/// The voxels of a tet in its box: rows with voxels, and the voxels of each row.
pub struct ClearRows {
    masks: [[u32; LANES]; CHUNKS],
    /// One bit for each row with voxels.
    rows: u64,
}

impl ClearRows {
    pub fn new() -> Self {
        Self { masks: [[0; LANES]; CHUNKS], rows: 0 }
    }

    /// Takes the next row with voxels of a box with this number of rows: its number in the tile
    /// after the first row of the box, and its voxels, one bit per column after the first one of
    /// the box.
    #[inline(always)]
    pub fn next(&mut self, rows: usize) -> Option<(usize, u32)> {
        if self.rows == 0 {
            return None;
        }
        let n = self.rows.trailing_zeros() as usize % MOST;
        self.rows &= self.rows - 1;
        Some((TILE_ROW[rows % (MOST_ROWS + 1)][n] as usize, self.masks[n / LANES][n % LANES]))
    }
}

impl ClearFaces {
    /// A group without tets.
    pub fn empty() -> Self {
        let zero = [0.0; GROUP];
        Self { at: [[zero; 4]; 4], by_j: [zero; 4], by_k: [zero; 4], small: [false; GROUP] }
    }

    /// Prepares a group with these boxes.
    #[inline(always)]
    pub fn fill(&mut self, rasters: &Rasters, spans: &Spans, tolerance: f64) {
        let faces = self;
        let [i, j, k] = &spans.first;
        for f in 0..4 {
            for n in 0..GROUP {
                let (by_j, by_k, slack) = (rasters.by_j[f][n], rasters.by_k[f][n], rasters.slack[f][n]);
                let row = (rasters.at[f][n] + slack) + by_j * f64::from(j[n]) + by_k * f64::from(k[n]);
                let at = row - f64::from(i[n]);
                let farthest = at.abs().max(by_j.abs()).max(by_k.abs());
                let scale = if farthest > FARTHEST { FARTHEST / farthest } else { 1.0 };
                let (at, by_j, by_k) = ((at * scale) as f32, (by_j * scale) as f32, (by_k * scale) as f32);
                let most = at.abs() + 8.0 * (by_j.abs() + by_k.abs()) + 1.0;
                let margin = ERROR * most + 1.0625 * (slack * scale).abs() as f32;
                let (enters, none) = (slack.is_sign_positive(), f32::INFINITY);
                faces.at[f][0][n] = if enters { at - margin } else { -none };
                faces.at[f][1][n] = if enters { at + margin } else { -none };
                faces.at[f][2][n] = if enters { none } else { at + margin };
                faces.at[f][3][n] = if enters { none } else { at - margin };
                faces.by_j[f][n] = by_j;
                faces.by_k[f][n] = by_k;
            }
        }
        let [columns, rows, slices] = &spans.length;
        for n in 0..GROUP {
            let size = (columns[n] <= MOST_COLUMNS)
                & (rows[n] <= MOST_ROWS as u32)
                & (slices[n] <= MOST_ROWS as u32);
            faces.small[n] = size & (tolerance <= LARGEST_TOLERANCE);
        }
    }

    /// Finds the voxels of a tet with a box of this size. Returns false if the tet is not small or
    /// if a center is close to a face.
    #[inline(always)]
    pub fn find(&self, lane: usize, [columns, rows, slices]: [usize; 3], found: &mut ClearRows) -> bool {
        if !self.small[lane] {
            return false;
        }
        let end = columns as f32 - 0.5;
        let count = rows * slices;
        let table = rows % (MOST_ROWS + 1);
        let (mut close, mut held) = (0, 0);
        for (chunk, masks) in found.masks.iter_mut().enumerate().take(count.div_ceil(LANES)) {
            let (j, k) = (&ROW[table][chunk], &SLICE[table][chunk]);
            let mut found_rows = [0_u32; LANES];
            for n in 0..LANES {
                let (mut low, mut sure_low, mut high, mut sure_high) = (-0.5, -0.5, end, end);
                for f in 0..4 {
                    let column = self.by_k[f][lane] * k[n] + self.by_j[f][lane] * j[n];
                    low = more(self.at[f][0][lane] + column, low);
                    sure_low = more(self.at[f][1][lane] + column, sure_low);
                    high = less(self.at[f][2][lane] + column, high);
                    sure_high = less(self.at[f][3][lane] + column, sure_high);
                }
                let first = less(low, 30.5) + 0.5 + INTEGERS;
                let end = more(high, -0.5) + 0.5 + INTEGERS;
                let some = u32::from(first < end).wrapping_neg();
                let is_close = (sure_low > first - INTEGERS) | (sure_high < end - INTEGERS - 1.0);
                found_rows[n] = (BIT[n] | u32::from(is_close) << LANES) & some;
                let bits = |at: f32| 1_u32.wrapping_shl(at.to_bits());
                masks[n] = bits(end).wrapping_sub(bits(first)) & some;
            }
            let mut all = 0;
            for found in found_rows {
                all |= found;
            }
            close |= all >> LANES;
            held |= u64::from(all & ((1 << LANES) - 1)) << (LANES * chunk);
        }
        found.rows = held & (u64::MAX >> (MOST - count.clamp(1, MOST)));
        close == 0
    }
}

/// The bit of each lane.
const BIT: [u32; LANES] = {
    let mut bits = [0; LANES];
    let mut n = 0;
    while n < LANES {
        bits[n] = 1 << n;
        n += 1;
    }
    bits
};

/// 1.5 · 2²³. A sum with it is rounded to an integer, which is in its lowest bits.
const INTEGERS: f32 = (3_u32 << 22) as f32;

/// The smaller number, without handling NaN.
#[inline(always)]
fn less(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger number, without handling NaN.
#[inline(always)]
fn more(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// For each number of rows the row and the slice of the n-th row of a box.
const ROW: [[[f32; LANES]; CHUNKS]; MOST_ROWS + 1] = numbers(false);
const SLICE: [[[f32; LANES]; CHUNKS]; MOST_ROWS + 1] = numbers(true);

const fn numbers(of_slices: bool) -> [[[f32; LANES]; CHUNKS]; MOST_ROWS + 1] {
    let mut numbers = [[[0.0; LANES]; CHUNKS]; MOST_ROWS + 1];
    let mut rows = 1;
    while rows <= MOST_ROWS {
        let mut n = 0;
        while n < LANES * CHUNKS {
            numbers[rows][n / LANES][n % LANES] = if of_slices { n / rows } else { n % rows } as f32;
            n += 1;
        }
        rows += 1;
    }
    numbers
}

/// For each number of rows the number in the tile of the n-th row of a box.
const TILE_ROW: [[u16; MOST]; MOST_ROWS + 1] = {
    let mut numbers = [[0; MOST]; MOST_ROWS + 1];
    let mut rows = 1;
    while rows <= MOST_ROWS {
        let mut n = 0;
        while n < MOST {
            numbers[rows][n] = (n / rows * TILE[1] + n % rows) as u16;
            n += 1;
        }
        rows += 1;
    }
    numbers
};

#[cfg(test)]
mod tests {
    use cutis_constraints::{LaneTask, Lanes, Scalar, SimdLevel};
    use cutis_test_kit::Random;

    use super::*;
    use crate::raster::Corners;
    use crate::rows::{ROWS, Rows};

    const REGION: [std::ops::Range<usize>; 3] = [64..128, 32..64, 16..32];

    /// The voxels of a group of tets in `f64`, and in `f32` where it decides.
    struct Compare<'a> {
        corners: &'a Corners,
        tolerance: f64,
        found: &'a mut Vec<(Vec<u64>, Option<Vec<u64>>)>,
    }

    impl LaneTask<f32> for Compare<'_> {
        #[inline(always)]
        fn run<L: Lanes<f32>>(self) {
            let rasters = Rasters::new(self.corners, self.tolerance);
            let (mut spans, mut faces) = (Spans::empty(), ClearFaces::empty());
            spans.fill(&rasters, &REGION);
            faces.fill(&rasters, &spans, self.tolerance);
            let (mut rows, mut clear) = (Rows::new(), ClearRows::new());
            for lane in 0..GROUP {
                let (Some(raster), Some([i, j, k])) = (rasters.tet(lane), spans.of(lane)) else { continue };
                let number = |j: usize, k: usize| (k - REGION[2].start) * TILE[1] + j - REGION[1].start;
                let mut expected = vec![0; TILE[1] * TILE[2]];
                for first in (j.0..j.1).step_by(ROWS) {
                    raster.rows(first, k, i, REGION[0].start, &mut rows);
                    for m in k.0..k.1 {
                        for n in 0..ROWS.min(j.1 - first) {
                            expected[number(first + n, m)] = rows.near[ROWS * (m - k.0) + n];
                        }
                    }
                }
                let decided = faces.find(lane, [i.1 - i.0, j.1 - j.0, k.1 - k.0], &mut clear);
                let clear = decided.then(|| {
                    let mut bits = vec![0; TILE[1] * TILE[2]];
                    while let Some((n, mask)) = clear.next(j.1 - j.0) {
                        bits[number(j.0, k.0) + n] = u64::from(mask) << (i.0 - REGION[0].start);
                    }
                    bits
                });
                self.found.push((expected, clear));
            }
        }
    }

    fn compare(level: SimdLevel, corners: &Corners, tolerance: f64) -> Vec<(Vec<u64>, Option<Vec<u64>>)> {
        let mut found = Vec::new();
        f32::in_lanes(level, Compare { corners, tolerance, found: &mut found });
        found
    }

    /// Tets around random places of the region. Each of four kinds has its own size; every second
    /// tet has corners at centers, edges and faces of voxels, and faces parallel to the rows.
    fn tets(random: &mut Random, size: f64) -> Corners {
        let mut corners = [[[0.0; GROUP]; 3]; 4];
        for n in 0..GROUP {
            let round = n % 2 == 1;
            for axis in 0..3 {
                let (start, end) = (REGION[axis].start as f64 - size, REGION[axis].end as f64);
                let first = start + (end - start) * 0.5 * (random.vector()[axis] + 1.0);
                for corner in &mut corners {
                    let at = first + size * 0.5 * (random.vector()[axis] + 1.0);
                    corner[axis][n] = if round { (2.0 * at).round() / 2.0 } else { at };
                }
            }
        }
        corners
    }

    #[test]
    fn clear_rows_are_those_of_f64_on_each_simd_level() {
        for level in SimdLevel::available() {
            let mut random = Random::new(1);
            for (size, tolerance) in [(1.5, 1e-5), (4.0, 1e-4), (4.0, 0.0), (7.0, 1e-5), (30.0, 1e-5)] {
                let (mut decided, mut all, mut voxels) = (0, 0, 0);
                for _ in 0..200 {
                    for (expected, clear) in compare(level, &tets(&mut random, size), tolerance) {
                        all += 1;
                        if let Some(clear) = clear {
                            decided += 1;
                            voxels += clear.iter().map(|bits| bits.count_ones()).sum::<u32>();
                            assert!(clear == expected, "{level:?}, size {size}, tolerance {tolerance}");
                        }
                    }
                }
                // Half of the tets have centers on their faces.
                let most = if size > 7.0 { 0 } else { all / 2 };
                assert!(decided >= most * 9 / 10, "{decided} of {all} of size {size}");
                assert!(decided < all && (voxels > 100 || size > 7.0), "{decided} of {all}, {voxels} voxels");
            }
        }
    }

    #[test]
    fn a_center_within_the_tolerance_of_a_face_is_left_to_f64() {
        let level = SimdLevel::best();
        // Rows enter this tet at column 65, plus a shift.
        let decides = |shift: f64, tolerance: f64| {
            let at = [[65.0, 32.2, 16.2], [65.0, 36.2, 16.2], [65.0, 32.2, 20.2], [69.3, 32.2, 16.2]];
            let corners = at.map(|[x, y, z]| [[x + shift; GROUP], [y; GROUP], [z; GROUP]]);
            let found = compare(level, &corners, tolerance);
            assert_eq!(found.len(), GROUP);
            found.iter().all(|(_, clear)| clear.is_some())
        };
        for shift in [0.0, 9e-5, -9e-5, 1e-7, -1e-7] {
            assert!(!decides(shift, 1e-4), "{shift}");
        }
        assert!(!decides(0.0, 0.0) && !decides(-1e-8, 0.0), "the rounding of f32");
        assert!(decides(1e-3, 1e-4) && decides(-1e-3, 1e-4) && decides(-1e-4, 0.0), "the control");
    }
}
