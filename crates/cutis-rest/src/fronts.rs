//! Several products with a matrix in one pass through it.
//!
//! The memory is too slow to read a large matrix for every product. So the products that follow on
//! each other move through the rows together: while the first one is at some rows, the next one is
//! a little behind, at rows whose neighbors the first one has left, and finds them in the cache
//! (wavefront blocking: Wellein and others, Proc. COMPSAC 2009). Every row has the same sums as
//! with products one after the other.

use std::ops::Range;

use crate::symmetric::Neighbors;

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
    /// The fronts for nodes with these neighbors, and blocks of this many numbers.
    pub fn of(neighbors: &Neighbors, numbers: usize) -> Self {
        let height = neighbors.count();
        let mean = (numbers * neighbors.blocks()).div_ceil(height.max(1));
        let piece = (PIECE / mean.max(1)).max(1);
        // The end of the neighbors of each piece.
        let reach = |start: usize| {
            let rows = start..(start + piece).min(height);
            let last = |row: usize| neighbors.later(row).last().map_or(row, |&last| last as usize);
            rows.map(last).max().map_or(0, |last| last + 1)
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

    /// The neighbors in a band of a width, and a row far away that the first one needs.
    fn neighbors(height: usize, width: usize, far: Option<usize>) -> Neighbors {
        let (mut starts, mut later) = (vec![0], Vec::new());
        for row in 0..height {
            later.extend((row + 1..(row + width + 1).min(height)).map(|neighbor| neighbor as u32));
            later.extend(far.filter(|_| row == 0).map(|far| far as u32));
            starts.push(later.len());
        }
        Neighbors::from_later(starts, &later)
    }

    /// Each stage takes each row once, and after the stage before has left the row's neighbors.
    /// Stages that are three apart never meet at neighbors.
    #[test]
    fn a_stage_takes_rows_whose_neighbors_are_done() {
        for (height, width, far) in [(1, 0, None), (40_000, 300, None), (40_000, 300, Some(39_000))] {
            let neighbors = neighbors(height, width, far);
            let fronts = Fronts::<3>::of(&neighbors, 9);
            let mut done = [0; 3];
            for front in &fronts.fronts {
                for (n, rows) in front.iter().enumerate() {
                    assert_eq!(rows.start, done[n]);
                    for row in rows.clone() {
                        let of_row = || neighbors.of(row).iter().map(|&node| node as usize).chain([row]);
                        let (low, high) = (of_row().min().unwrap(), of_row().max().unwrap());
                        assert!(n == 0 || high < done[n - 1], "stage {n}, row {row}");
                        assert!(n > 0 || low >= front[2].end || front[2].is_empty(), "row {row}");
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
            let fronts = Fronts::<3>::of(&neighbors(400_000, 300, far), 9);
            fronts.fronts.iter().map(|front| front[0].end - front[2].end).max().unwrap()
        };
        assert!(apart(None) < 5_000, "{}", apart(None));
        assert!(apart(Some(200_000)) > 150_000, "{}", apart(Some(200_000)));
    }
}
