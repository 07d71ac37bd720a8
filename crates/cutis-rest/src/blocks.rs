//! Sparse matrices of small dense blocks.

use nalgebra::{RealField, SMatrix, SVector};
use rayon::prelude::*;

/// Rows that a thread takes at once.
pub(crate) const ROWS: usize = 256;

/// A sparse matrix of blocks with `R` rows and `C` columns each. The blocks of a row of blocks are
/// in the order of their columns.
#[derive(Clone, Debug)]
pub(crate) struct Blocks<T, const R: usize, const C: usize> {
    /// Start of each row of blocks, and the end of the last one.
    pub starts: Vec<usize>,
    /// Column of each block.
    pub columns: Vec<u32>,
    pub values: Vec<SMatrix<T, R, C>>,
    /// Number of columns of blocks.
    pub width: usize,
}

/// One row of blocks: columns and values.
type Row<T, const R: usize, const C: usize> = Vec<(u32, SMatrix<T, R, C>)>;

impl<T: RealField + Copy, const R: usize, const C: usize> Blocks<T, R, C> {
    /// A matrix from its rows. Each row is sorted by columns.
    pub fn from_rows(rows: Vec<Row<T, R, C>>, width: usize) -> Self {
        let count = rows.iter().map(Vec::len).sum();
        let mut starts = Vec::with_capacity(rows.len() + 1);
        let (mut columns, mut values) = (Vec::with_capacity(count), Vec::with_capacity(count));
        starts.push(0);
        for row in rows {
            for (column, value) in row {
                columns.push(column);
                values.push(value);
            }
            starts.push(columns.len());
        }
        Self { starts, columns, values, width }
    }

    /// Number of rows of blocks.
    pub fn height(&self) -> usize {
        self.starts.len() - 1
    }

    /// Columns and values of a row of blocks.
    #[inline]
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, &SMatrix<T, R, C>)> {
        let range = self.starts[row]..self.starts[row + 1];
        self.columns[range.clone()].iter().map(|&column| column as usize).zip(&self.values[range])
    }

    /// The block in a row and a column, if it is stored.
    pub fn get(&self, row: usize, column: usize) -> Option<&SMatrix<T, R, C>> {
        let range = self.starts[row]..self.starts[row + 1];
        let found = self.columns[range.clone()].binary_search(&(column as u32)).ok()?;
        Some(&self.values[range.start + found])
    }

    /// One row of blocks times a vector.
    #[inline]
    pub fn row_times(&self, row: usize, x: &[SVector<T, C>]) -> SVector<T, R> {
        self.row(row).fold(SVector::zeros(), |sum, (column, block)| sum + block * x[column])
    }

    /// The matrix times a vector.
    pub fn times(&self, x: &[SVector<T, C>]) -> Vec<SVector<T, R>> {
        (0..self.height()).into_par_iter().with_min_len(ROWS).map(|row| self.row_times(row, x)).collect()
    }

    /// The matrix times another one.
    pub fn product<const D: usize>(&self, other: &Blocks<T, C, D>) -> Blocks<T, R, D> {
        let scratch = || Sums::new(other.width);
        let row = |sums: &mut Sums<T, R, D>, row: usize| {
            for (middle, left) in self.row(row) {
                for (column, right) in other.row(middle) {
                    sums.add(column, left * right);
                }
            }
            sums.take()
        };
        let rows = (0..self.height()).into_par_iter().with_min_len(ROWS).map_init(scratch, row).collect();
        Blocks::from_rows(rows, other.width)
    }

    /// The transposed matrix.
    pub fn transposed(&self) -> Blocks<T, C, R> {
        let mut starts = vec![0; self.width + 1];
        for &column in &self.columns {
            starts[column as usize + 1] += 1;
        }
        for column in 0..self.width {
            starts[column + 1] += starts[column];
        }
        let mut next = starts.clone();
        let mut columns = vec![0; self.columns.len()];
        let mut values = vec![SMatrix::zeros(); self.values.len()];
        for row in 0..self.height() {
            for (column, value) in self.row(row) {
                let place = &mut next[column];
                columns[*place] = row as u32;
                values[*place] = value.transpose();
                *place += 1;
            }
        }
        Blocks { starts, columns, values, width: self.height() }
    }
}

impl<const R: usize, const C: usize> Blocks<f64, R, C> {
    /// The same matrix in single precision.
    pub fn single(&self) -> Blocks<f32, R, C> {
        let values = self.values.par_iter().with_min_len(ROWS).map(|value| value.map(|x| x as f32));
        let (starts, columns, width) = (self.starts.clone(), self.columns.clone(), self.width);
        Blocks { starts, columns, values: values.collect(), width }
    }
}

/// Sums of blocks by column, for one row at a time.
pub(crate) struct Sums<T, const R: usize, const C: usize> {
    /// For each column the place of its sum plus one. Zero if there is none.
    places: Vec<u32>,
    sums: Row<T, R, C>,
}

impl<T: RealField + Copy, const R: usize, const C: usize> Sums<T, R, C> {
    pub fn new(width: usize) -> Self {
        Self { places: vec![0; width], sums: Vec::new() }
    }

    /// Adds a block to the sum of a column.
    #[inline]
    pub fn add(&mut self, column: usize, block: SMatrix<T, R, C>) {
        match self.places[column] {
            0 => {
                self.sums.push((column as u32, block));
                self.places[column] = self.sums.len() as u32;
            }
            place => self.sums[place as usize - 1].1 += block,
        }
    }

    /// The sums in the order of their columns. Clears them.
    pub fn take(&mut self) -> Row<T, R, C> {
        for (column, _) in &self.sums {
            self.places[*column as usize] = 0;
        }
        let mut row = std::mem::take(&mut self.sums);
        row.sort_unstable_by_key(|(column, _)| *column);
        row
    }
}

/// Entries that are summed in order before the sums of all parts are.
const PART: usize = 4096;

/// The inner product of two vectors. The order of the sum does not depend on the number of threads.
pub(crate) fn dot<const N: usize>(a: &[SVector<f64, N>], b: &[SVector<f64, N>]) -> f64 {
    let part = |(a, b): (&[SVector<f64, N>], &[SVector<f64, N>])| -> f64 {
        a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
    };
    let parts: Vec<f64> = a.par_chunks(PART).zip(b.par_chunks(PART)).map(part).collect();
    parts.iter().sum()
}

/// Adds a multiple of a vector to another one.
pub(crate) fn add<T: RealField + Copy, const N: usize>(
    to: &mut [SVector<T, N>],
    factor: T,
    x: &[SVector<T, N>],
) {
    to.par_iter_mut().with_min_len(PART).zip(x).for_each(|(to, x)| *to += x * factor);
}
