//! Sparse matrices of small dense blocks, in single precision.

use std::ops::Range;

use cutis_constraints::prefetch;
use rayon::prelude::*;

/// Rows that a thread takes at once.
pub(crate) const ROWS: usize = 256;

/// Numbers after the present ones that are fetched into the cache.
pub(crate) const AHEAD: usize = 512;

/// Numbers after the last block, so that a register can be read at the last column of a block.
pub(crate) const PADDING: usize = 8;

/// The parts of rows that a thread takes at once.
pub(crate) fn row_parts(height: usize) -> Vec<Range<usize>> {
    (0..height).step_by(ROWS).map(|start| start..(start + ROWS).min(height)).collect()
}

/// Pieces of these lengths, one after the other.
pub(crate) fn divided<T>(mut rest: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let mut pieces = Vec::with_capacity(lengths.size_hint().0);
    for length in lengths {
        let (piece, after) = rest.split_at_mut(length);
        pieces.push(piece);
        rest = after;
    }
    pieces
}

/// A block with `R` rows and `C` columns, column by column.
pub(crate) type Block<const R: usize, const C: usize> = [[f64; R]; C];

/// Where the blocks of a sparse matrix are. The blocks of a row are in the order of their columns.
pub(crate) struct Pattern {
    /// Start of each row of blocks, and the end of the last one.
    pub starts: Vec<usize>,
    /// Column of each block.
    pub columns: Vec<u32>,
}

impl Pattern {
    /// Places of the blocks of a row.
    #[inline]
    pub fn places(&self, row: usize) -> Range<usize> {
        self.starts[row]..self.starts[row + 1]
    }
}

/// A sparse matrix of blocks with `R` rows and `C` columns each.
pub(crate) struct Blocks<const R: usize, const C: usize> {
    pub pattern: Pattern,
    /// Number of columns of blocks.
    pub width: usize,
    /// The blocks one after the other, each column by column, and some zeros.
    values: Vec<f32>,
}

impl<const R: usize, const C: usize> Blocks<R, C> {
    /// A matrix row by row: `columns` lists the columns of a row, in any order and also more than
    /// once, and `row` adds its blocks to the sums.
    pub fn by_rows(
        height: usize,
        width: usize,
        columns: impl Fn(usize, &mut Vec<u32>) + Sync,
        row: impl Fn(&mut Sums<R, C>, usize) + Sync,
    ) -> Self {
        let count = |list: &mut Vec<u32>, row: usize| {
            list.clear();
            columns(row, list);
            list.sort_unstable();
            list.dedup();
            list.len()
        };
        let counts: Vec<usize> =
            (0..height).into_par_iter().with_min_len(ROWS).map_init(Vec::new, count).collect();
        let mut starts = Vec::with_capacity(height + 1);
        starts.push(0);
        for (n, count) in counts.into_iter().enumerate() {
            starts.push(starts[n] + count);
        }
        let mut columns = vec![0; starts[height]];
        let mut values = vec![0.0; R * C * columns.len() + PADDING];
        let parts = row_parts(height);
        let count = |rows: &Range<usize>| starts[rows.end] - starts[rows.start];
        let of_columns = divided(&mut columns, parts.iter().map(count));
        let of_values = divided(&mut values, parts.iter().map(|rows| R * C * count(rows)));
        parts.into_par_iter().zip(of_columns).zip(of_values).for_each_init(
            || Sums::new(width),
            |sums, ((rows, columns), values)| {
                let before = starts[rows.start];
                for n in rows {
                    row(sums, n);
                    let own = starts[n] - before..starts[n + 1] - before;
                    sums.take(&mut columns[own.clone()], &mut values[R * C * own.start..R * C * own.end]);
                }
            },
        );
        Self { pattern: Pattern { starts, columns }, width, values }
    }

    /// A block in double precision.
    #[inline]
    pub fn block(&self, place: usize) -> Block<R, C> {
        let values = &self.values[R * C * place..][..R * C];
        let mut block = [[0.0; R]; C];
        for (to, &from) in block.as_flattened_mut().iter_mut().zip(values) {
            *to = f64::from(from);
        }
        block
    }

    /// Columns and blocks of a row.
    #[inline]
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, Block<R, C>)> {
        let pattern = &self.pattern;
        pattern.places(row).map(|place| (pattern.columns[place] as usize, self.block(place)))
    }

    /// Adds each block of a row times a vector to the vector of its column. `sums` are those from
    /// the column `first` on. The rest of each one, beyond `R`, has no meaning.
    #[inline(always)]
    pub fn add_row_times<const L: usize, const M: usize>(
        &self,
        row: usize,
        x: &[f32; M],
        first: usize,
        sums: &mut [[f32; L]],
    ) {
        for place in self.pattern.places(row) {
            prefetch(&self.values, R * C * place + AHEAD);
            let values = &self.values[R * C * place..][..R * (C - 1) + L];
            let sum = &mut sums[self.pattern.columns[place] as usize - first];
            for column in 0..C {
                for n in 0..L {
                    sum[n] += values[R * column + n] * x[column];
                }
            }
        }
    }

    /// One row of transposed blocks times a vector, whose numbers beyond `R` are zeros.
    #[inline(always)]
    pub fn row_transposed_times<const L: usize, const M: usize>(
        &self,
        row: usize,
        x: &[[f32; M]],
    ) -> [f32; L] {
        let mut products = [[0.0; M]; C];
        for place in self.pattern.places(row) {
            prefetch(&self.values, R * C * place + AHEAD);
            let values = &self.values[R * C * place..][..R * (C - 1) + M];
            let x = &x[self.pattern.columns[place] as usize];
            for (column, products) in products.iter_mut().enumerate() {
                for n in 0..M {
                    products[n] += values[R * column + n] * x[n];
                }
            }
        }
        let mut sum = [0.0; L];
        for (sum, products) in sum.iter_mut().zip(&products) {
            *sum = products.iter().sum();
        }
        sum
    }
}

/// The transposed block.
#[inline(always)]
pub(crate) fn transposed<const R: usize, const C: usize>(block: &Block<R, C>) -> Block<C, R> {
    std::array::from_fn(|column| std::array::from_fn(|row| block[row][column]))
}

/// Adds `left · rightᵀ`. The numbers of a column of `left` lie side by side, so that a processor
/// takes several at once.
#[inline(always)]
pub(crate) fn add_product<const R: usize, const M: usize, const C: usize>(
    to: &mut Block<R, C>,
    left: &Block<R, M>,
    right: &Block<C, M>,
) {
    for column in 0..C {
        for middle in 0..M {
            for row in 0..R {
                to[column][row] += left[middle][row] * right[middle][column];
            }
        }
    }
}

/// Sums of blocks by column, for one row at a time.
pub(crate) struct Sums<const R: usize, const C: usize> {
    /// For each column the place of its sum plus one. Zero if there is none.
    places: Vec<u32>,
    /// The columns with a sum, and the place of the sum.
    columns: Vec<(u32, u32)>,
    sums: Vec<Block<R, C>>,
}

impl<const R: usize, const C: usize> Sums<R, C> {
    pub fn new(width: usize) -> Self {
        Self { places: vec![0; width], columns: Vec::new(), sums: Vec::new() }
    }

    /// The sum of a column.
    #[inline(always)]
    pub fn at(&mut self, column: usize) -> &mut Block<R, C> {
        if self.places[column] == 0 {
            self.columns.push((column as u32, self.sums.len() as u32));
            self.sums.push([[0.0; R]; C]);
            self.places[column] = self.sums.len() as u32;
        }
        &mut self.sums[self.places[column] as usize - 1]
    }

    /// The sum of a column, if there is one.
    #[inline(always)]
    pub fn existing(&mut self, column: usize) -> Option<&mut Block<R, C>> {
        let place = self.places[column].checked_sub(1)?;
        Some(&mut self.sums[place as usize])
    }

    /// Changes each sum.
    pub fn for_each(&mut self, change: impl FnMut(&mut Block<R, C>)) {
        self.sums.iter_mut().for_each(change);
    }

    /// Writes the sums in the order of their columns, and clears them.
    fn take(&mut self, columns: &mut [u32], values: &mut [f32]) {
        let mut to = columns.iter_mut().zip(values.chunks_exact_mut(R * C));
        self.drain(|column, sum| {
            let Some((to_column, to_values)) = to.next() else { return };
            *to_column = column;
            to_values.iter_mut().zip(sum.as_flattened()).for_each(|(to, &x)| *to = x as f32);
        });
    }

    /// Clears the sums. `each` receives them in the order of their columns.
    fn drain(&mut self, mut each: impl FnMut(u32, &Block<R, C>)) {
        self.columns.sort_unstable();
        for (column, place) in self.columns.drain(..) {
            self.places[column as usize] = 0;
            each(column, &self.sums[place as usize]);
        }
        self.sums.clear();
    }
}

/// Some rows of a matrix of blocks with `R` rows and `C` columns each.
#[derive(Default)]
pub(crate) struct BlockRows<const R: usize, const C: usize> {
    /// The ends of the rows among the blocks.
    pub ends: Vec<usize>,
    /// Column of each block.
    pub columns: Vec<u32>,
    /// The blocks one after the other, each column by column.
    pub values: Vec<f32>,
}

impl<const R: usize, const C: usize> BlockRows<R, C> {
    /// Removes all rows, and keeps their memory.
    pub fn clear(&mut self) {
        self.ends.clear();
        self.columns.clear();
        self.values.clear();
    }

    /// Appends a row with the sums of the columns from one on, and clears all sums.
    pub fn push(&mut self, sums: &mut Sums<R, C>, first: usize) {
        sums.drain(|column, sum| {
            if column as usize >= first {
                self.columns.push(column);
                self.values.extend(sum.as_flattened().iter().map(|&x| x as f32));
            }
        });
        self.ends.push(self.columns.len());
    }

    /// Columns and blocks of a row.
    #[inline]
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, Block<R, C>)> {
        let start = row.checked_sub(1).map_or(0, |before| self.ends[before]);
        let own = start..self.ends[row];
        let blocks = self.values[R * C * own.start..].chunks_exact(R * C);
        self.columns[own].iter().zip(blocks).map(|(&column, values)| {
            let block = |n: usize, row: usize| f64::from(values[R * n + row]);
            (column as usize, std::array::from_fn(|n| std::array::from_fn(|row| block(n, row))))
        })
    }
}

/// The blocks of each column of a matrix, by row.
pub(crate) struct Columns {
    starts: Vec<usize>,
    /// Row and place of each block.
    blocks: Vec<(u32, u32)>,
}

impl Columns {
    pub fn of<const R: usize, const C: usize>(matrix: &Blocks<R, C>) -> Self {
        let mut starts = vec![0; matrix.width + 1];
        let Pattern { columns, .. } = &matrix.pattern;
        for &column in columns {
            starts[column as usize + 1] += 1;
        }
        for column in 0..matrix.width {
            starts[column + 1] += starts[column];
        }
        let mut next = starts.clone();
        let mut blocks = vec![(0, 0); columns.len()];
        for row in 0..matrix.pattern.starts.len() - 1 {
            for place in matrix.pattern.places(row) {
                let at = &mut next[columns[place] as usize];
                blocks[*at] = (row as u32, place as u32);
                *at += 1;
            }
        }
        Self { starts, blocks }
    }

    /// Rows and places of the blocks of a column.
    #[inline]
    pub fn of_column(&self, column: usize) -> &[(u32, u32)] {
        &self.blocks[self.starts[column]..self.starts[column + 1]]
    }
}
