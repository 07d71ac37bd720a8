//! The way between two levels, as maps of vectors.

use std::ops::Range;

use rayon::prelude::*;

use crate::blocks::{Blocks, ROWS};
use crate::multigrid::{LANES, RIGID};

/// Rows of a part in which a vector is restricted, and the most parts.
const PART: usize = 2048;
const MOST_PARTS: usize = 32;
/// Unknowns of a rigid body, and the zeros of a vector.
type Coarse = [f32; LANES];

/// A prolongation and its transposed matrix, as maps of vectors.
pub(crate) struct Transfer<const B: usize> {
    /// Each block is transposed.
    pub prolongation: Blocks<RIGID, B>,
    /// Parts of the rows, and the columns that each has blocks in.
    parts: Vec<[Range<usize>; 2]>,
}

impl<const B: usize> Transfer<B> {
    /// From a prolongation with transposed blocks.
    pub fn new(prolongation: Blocks<RIGID, B>) -> Self {
        let pattern = &prolongation.pattern;
        let height = pattern.starts.len() - 1;
        let count = (height / PART).clamp(1, MOST_PARTS);
        let part = |n: usize| {
            let rows = n * height / count..(n + 1) * height / count;
            let columns = &pattern.columns[pattern.starts[rows.start]..pattern.starts[rows.end]];
            let first = columns.iter().min().map_or(0, |&first| first as usize);
            let end = columns.iter().max().map_or(first, |&last| last as usize + 1);
            [rows, first..end]
        };
        let parts = (0..count).into_par_iter().map(part).collect();
        Self { prolongation, parts }
    }

    /// Nodes of the next level.
    pub fn width(&self) -> usize {
        self.prolongation.width
    }

    /// The transposed prolongation times a vector.
    pub fn restrict<const L: usize>(&self, x: &[[f32; L]]) -> Vec<Coarse> {
        let Self { prolongation, parts } = self;
        let of_part = |[rows, columns]: &[Range<usize>; 2]| {
            let mut sums = vec![[0.0; LANES]; columns.len()];
            for row in rows.clone() {
                prolongation.add_row_times(row, &x[row], columns.start, &mut sums);
            }
            sums
        };
        let sums: Vec<Vec<Coarse>> = parts.par_iter().map(of_part).collect();
        let mut whole = vec![[0.0; LANES]; self.width()];
        whole.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, whole)| {
            let start = chunk * ROWS;
            for ([_, columns], sums) in parts.iter().zip(&sums) {
                for column in columns.start.max(start)..columns.end.min(start + whole.len()) {
                    let (to, from) = (&mut whole[column - start], &sums[column - columns.start]);
                    (0..RIGID).for_each(|n| to[n] += from[n]);
                }
            }
        });
        whole
    }

    /// Adds the prolongation of a vector.
    pub fn add_prolonged<const L: usize>(&self, x: &[Coarse], to: &mut [[f32; L]]) {
        to.par_iter_mut().enumerate().with_min_len(ROWS).for_each(|(row, to)| {
            let step: [f32; L] = self.prolongation.row_transposed_times(row, x);
            (0..L).for_each(|n| to[n] += step[n]);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors::dot;

    /// Restriction is the transposed prolongation, also where the rows are in several parts whose
    /// columns overlap: `(P c) · r = c · (Pᵀ r)`.
    #[test]
    fn restriction_is_the_transposed_prolongation() {
        const HEIGHT: usize = 10_000;
        let width = HEIGHT / 25;
        let number = |n: usize| ((n as f64 + 1.0) * 12.9898).sin();
        let columns_of = |row: usize| [row / 25, (row / 25 + 1).min(width - 1), row * 7 % width];
        let prolongation = Blocks::<RIGID, 3>::by_rows(
            HEIGHT,
            width,
            |row, columns| columns.extend(columns_of(row).map(|column| column as u32)),
            |sums, row| {
                for column in columns_of(row) {
                    let block = sums.at(column).as_flattened_mut();
                    block.iter_mut().enumerate().for_each(|(n, x)| *x += number(18 * row + column + n));
                }
            },
        );
        let transfer = Transfer::new(prolongation);
        assert!(transfer.parts.len() > 3, "{}", transfer.parts.len());
        let coarse: Vec<Coarse> = (0..width)
            .map(|node| std::array::from_fn(|n| if n < RIGID { number(9 * node + n) as f32 } else { 0.0 }))
            .collect();
        let mut prolonged = vec![[0.0; 4]; HEIGHT];
        transfer.add_prolonged(&coarse, &mut prolonged);
        // Not orthogonal to the prolonged vector, and not along it.
        let fine: Vec<[f32; 4]> = prolonged.iter().map(|&[x, y, z, _]| [x, 0.5 * y, x + z, 0.0]).collect();
        let (left, right) = (dot(&prolonged, &fine), dot(&coarse, &transfer.restrict(&fine)));
        let size = (dot(&prolonged, &prolonged) * dot(&fine, &fine)).sqrt();
        assert!((left - right).abs() < 1e-6 * size, "{left} and {right} of {size}");
        assert!(left > 0.1 * size, "control: {left} of {size}");
    }
}
