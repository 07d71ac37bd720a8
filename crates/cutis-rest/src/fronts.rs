//! Several products with a matrix in one pass through it.
//!
//! The memory is too slow to read a large matrix for every product. So the products that follow on
//! each other move through the rows together: while the first one is at some rows, the next one is
//! a little behind, at rows whose neighbors the first one has left, and finds them in the cache
//! (wavefront blocking: Wellein and others, Proc. COMPSAC 2009). Every row has the same sums as
//! with products one after the other.

use std::ops::Range;

use crate::blocks::Pattern;

/// Numbers of the matrix in a piece.
const PIECE: usize = 1 << 20;
/// Pieces that a stage takes in a front, if it has fallen behind.
const MOST: usize = 2;

/// Which rows each of `N` stages takes at once. A stage takes rows whose neighbors the stage before
/// has left behind in earlier fronts. All stages move upwards, and later stages are behind earlier
/// ones.
pub(crate) struct Fronts<const N: usize> {
    pub fronts: Vec<[Range<usize>; N]>,
    /// Rows that a thread should take at once.
    pub rows: usize,
}

impl<const N: usize> Fronts<N> {
    /// The fronts for a symmetric pattern with this many numbers in a block.
    pub fn of(pattern: &Pattern, numbers: usize) -> Self {
        let height = pattern.height();
        let mean = (numbers * pattern.columns.len()).div_ceil(height.max(1));
        let piece = (PIECE / mean.max(1)).max(1);
        // The end of the neighbors of each piece.
        let reach = |start: usize| {
            let rows = start..(start + piece).min(height);
            rows.filter_map(|row| pattern.row(row).last()).max().map_or(0, |&last| last as usize + 1)
        };
        let reaches: Vec<usize> = (0..height).step_by(piece).map(reach).collect();
        let mut fronts = Vec::new();
        let mut done = [0; N];
        while done[N - 1] < height {
            let before = done;
            let stage = |n: usize| {
                let mut end = done[n];
                let most = if n == 0 { 1 } else { MOST };
                for _ in 0..most {
                    let ready =
                        n == 0 || reaches.get(end / piece).is_some_and(|&reach| reach <= before[n - 1]);
                    if end < height && ready {
                        end = (end + piece).min(height);
                    }
                }
                done[n]..end
            };
            let front: [Range<usize>; N] = std::array::from_fn(stage);
            for (done, rows) in done.iter_mut().zip(&front) {
                *done = rows.end;
            }
            fronts.push(front);
        }
        Self { fronts, rows: piece.div_ceil(32) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A band of a width, and a row far away that some rows need.
    fn pattern(height: usize, width: usize, far: Option<usize>) -> Pattern {
        let (mut starts, mut columns) = (vec![0], Vec::new());
        for row in 0..height {
            let mut own: Vec<usize> = (row.saturating_sub(width)..(row + width + 1).min(height)).collect();
            if let Some(far) = far {
                if row == far {
                    own.push(0);
                } else if row == 0 {
                    own.push(far);
                }
            }
            own.sort_unstable();
            own.dedup();
            columns.extend(own.into_iter().map(|column| column as u32));
            starts.push(columns.len());
        }
        Pattern { starts, columns }
    }

    /// Each stage takes each row once, and after the stage before has left the row's neighbors.
    /// Stages that are three apart never meet at neighbors.
    #[test]
    fn a_stage_takes_rows_whose_neighbors_are_done() {
        for (height, width, far) in [(1, 0, None), (40_000, 300, None), (40_000, 300, Some(39_000))] {
            let pattern = pattern(height, width, far);
            let fronts = Fronts::<3>::of(&pattern, 9);
            let mut done = [0; 3];
            for front in &fronts.fronts {
                for (n, rows) in front.iter().enumerate() {
                    assert_eq!(rows.start, done[n]);
                    for row in rows.clone() {
                        let (low, high) = (pattern.row(row)[0], pattern.row(row)[pattern.row(row).len() - 1]);
                        assert!(n == 0 || (high as usize) < done[n - 1], "stage {n}, row {row}");
                        assert!(n > 0 || low as usize >= front[2].end || front[2].is_empty(), "row {row}");
                    }
                }
                done = [0, 1, 2].map(|n| front[n].end);
            }
            assert_eq!(done, [height; 3]);
        }
    }

    /// With a narrow band, all stages are at work in nearly all fronts. A row far away delays the
    /// later ones.
    #[test]
    fn the_stages_are_near_each_other() {
        let apart = |far: Option<usize>| {
            let fronts = Fronts::<3>::of(&pattern(400_000, 300, far), 9);
            fronts.fronts.iter().map(|front| front[0].end - front[2].end).max().unwrap()
        };
        assert!(apart(None) < 5_000, "{}", apart(None));
        assert!(apart(Some(200_000)) > 150_000, "{}", apart(Some(200_000)));
    }
}
