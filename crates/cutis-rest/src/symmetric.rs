//! Sparse symmetric matrices of small dense blocks, in single precision.
//!
//! Only the blocks above the diagonal are stored. A product reads each of them twice: in its own
//! row, and transposed in the row of its column. In a mesh whose neighbors are near each other in
//! the list it is still in the cache the second time, so that half as much comes from the memory.

use std::ops::Range;
use std::sync::Arc;

use cutis_constraints::prefetch;
use rayon::prelude::*;
use simba::simd::{SimdValue, WideF32x4};

use crate::blocks::{AHEAD, Block, BlockRows, PADDING, ROWS, Sums, divided, transposed};
use crate::smoother::Operator;

/// Blocks below the diagonal after the present one that are fetched into the cache.
const BLOCKS_AHEAD: usize = 16;
/// Columns of transposed blocks that are added up together. They divide the columns of a block.
const COLUMNS: usize = 3;

/// The neighbors of each node: the nodes with which it has a block.
pub(crate) struct Neighbors {
    /// Start of the neighbors of each node, and the end of the last ones.
    starts: Vec<usize>,
    /// The neighbors of each node, ascending.
    nodes: Vec<u32>,
    /// Start of the blocks of each row above the diagonal, and the end of the last ones.
    above: Vec<usize>,
    /// For each block below the diagonal the place of its transposed one.
    below: Vec<u32>,
}

impl Neighbors {
    /// From the later neighbors of each node, ascending. `above` has the start of those of each
    /// node, and the end of the last ones.
    pub fn from_later(above: Vec<usize>, later: &[u32]) -> Self {
        let count = above.len() - 1;
        let mut earlier = vec![0; count];
        for &node in later {
            earlier[node as usize] += 1;
        }
        let mut starts = Vec::with_capacity(count + 1);
        starts.push(0);
        for (node, &earlier) in earlier.iter().enumerate() {
            starts.push(starts[node] + earlier + above[node + 1] - above[node]);
        }
        // The places of the next earlier neighbor of each node. They come in ascending order.
        let mut next: Vec<usize> = starts[..count].to_vec();
        let (mut nodes, mut below) = (vec![0; starts[count]], vec![0; later.len()]);
        for node in 0..count {
            let own = above[node]..above[node + 1];
            nodes[starts[node + 1] - own.len()..starts[node + 1]].copy_from_slice(&later[own.clone()]);
            for (place, &neighbor) in own.clone().zip(&later[own]) {
                let neighbor = neighbor as usize;
                nodes[next[neighbor]] = node as u32;
                below[next[neighbor] - above[neighbor]] = place as u32;
                next[neighbor] += 1;
            }
        }
        Self { starts, nodes, above, below }
    }

    /// Number of nodes.
    pub fn count(&self) -> usize {
        self.above.len() - 1
    }

    /// Number of blocks above the diagonal.
    pub fn blocks(&self) -> usize {
        self.below.len()
    }

    /// Neighbors of a node, ascending.
    #[inline]
    pub fn of(&self, node: usize) -> &[u32] {
        &self.nodes[self.starts[node]..self.starts[node + 1]]
    }

    /// Number of neighbors of all nodes before one.
    #[inline]
    pub fn start(&self, node: usize) -> usize {
        self.starts[node]
    }

    /// Later neighbors of a node, ascending.
    #[inline]
    pub fn later(&self, node: usize) -> &[u32] {
        let end = self.starts[node + 1];
        &self.nodes[end - self.above(node).len()..end]
    }

    /// Places of the blocks of a row above the diagonal.
    #[inline]
    pub fn above(&self, row: usize) -> Range<usize> {
        self.above[row]..self.above[row + 1]
    }

    /// Places of the blocks above the diagonal of some rows.
    pub fn above_rows(&self, rows: Range<usize>) -> Range<usize> {
        self.above[rows.start]..self.above[rows.end]
    }

    /// Places in `below` of the blocks of a row.
    #[inline]
    fn below(&self, row: usize) -> Range<usize> {
        self.starts[row] - self.above[row]..self.starts[row + 1] - self.above[row + 1]
    }
}

/// The blocks of a symmetric matrix above the diagonal.
pub(crate) struct Above<const B: usize> {
    pub neighbors: Arc<Neighbors>,
    /// The blocks one after the other, each column by column, and some zeros.
    values: Vec<f32>,
}

impl<const B: usize> Above<B> {
    /// Blocks of zeros.
    pub fn zeros(neighbors: Arc<Neighbors>) -> Self {
        let values = vec![0.0; B * B * neighbors.blocks() + PADDING];
        Self { neighbors, values }
    }

    /// The numbers of the blocks.
    pub fn values_mut(&mut self) -> &mut [f32] {
        let count = B * B * self.neighbors.blocks();
        &mut self.values[..count]
    }

    fn block(&self, place: usize) -> Block<B, B> {
        let values = &self.values[B * B * place..][..B * B];
        std::array::from_fn(|column| std::array::from_fn(|row| f64::from(values[B * column + row])))
    }

    /// Columns and blocks of a row, without the diagonal.
    #[inline]
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, Block<B, B>)> {
        let Neighbors { below, .. } = &*self.neighbors;
        let below =
            below[self.neighbors.below(row)].iter().map(|&place| transposed(&self.block(place as usize)));
        let blocks = below.chain(self.neighbors.above(row).map(|place| self.block(place)));
        self.neighbors.of(row).iter().map(|&column| column as usize).zip(blocks)
    }

    /// The blocks of a row times a vector in SIMD registers, which `x` has at each neighbor. The
    /// vector has zeros beyond `B`. Those of the result have no meaning.
    #[inline(always)]
    pub fn row_times<const N: usize>(
        &self,
        row: usize,
        x: impl Fn(usize) -> [WideF32x4; N],
    ) -> [WideF32x4; N] {
        let (neighbors, values) = (&*self.neighbors, &self.values[..]);
        let zero = WideF32x4::splat(0.0);
        let (below, above) = (neighbors.below(row), neighbors.above(row));
        let (earlier, later) = neighbors.of(row).split_at(below.len());
        // The sums of the columns of transposed blocks. A processor has registers for few of them.
        let mut sums = [[0.0; 4]; N];
        let places = &neighbors.below[below.start..];
        for group in 0..B / COLUMNS {
            let mut columns = [[zero; N]; COLUMNS];
            for (n, (&neighbor, &place)) in earlier.iter().zip(places).enumerate() {
                if let Some(&place) = places.get(n + BLOCKS_AHEAD).filter(|_| group == 0) {
                    let first = B * B * place as usize;
                    prefetch_lines(values, first, B * B);
                    prefetch(values, first + B * B - 1);
                }
                let from = values.get(B * B * place as usize + COLUMNS * B * group..);
                let Some(block) = from.and_then(|from| from.get(..B * (COLUMNS - 1) + 4 * N)) else { break };
                let x = x(neighbor as usize);
                for (column, sums) in columns.iter_mut().enumerate() {
                    for r in 0..N {
                        sums[r] += register(block, B * column + 4 * r) * x[r];
                    }
                }
            }
            for (column, of_column) in columns.iter().enumerate() {
                let column = COLUMNS * group + column;
                for &sum in of_column {
                    let [a, b, c, d]: [f32; 4] = sum.into();
                    sums[column / 4][column % 4] += (a + b) + (c + d);
                }
            }
        }
        let mut sums = sums.map(WideF32x4::from);
        let mut numbers = B * B * above.start;
        let mut of_row = &values[numbers..B * B * above.end + 4 * N - B];
        for &neighbor in later {
            let Some(block) = of_row.get(..B * (B - 1) + 4 * N) else { break };
            of_row = &of_row[B * B..];
            prefetch_lines(values, numbers + AHEAD, B * B);
            numbers += B * B;
            let x: [[f32; 4]; N] = x(neighbor as usize).map(Into::into);
            for column in 0..B {
                let x = WideF32x4::splat(x[column / 4][column % 4]);
                for (r, sum) in sums.iter_mut().enumerate() {
                    *sum += register(block, B * column + 4 * r) * x;
                }
            }
        }
        sums
    }
}

/// Four numbers from a place on.
#[inline(always)]
fn register(values: &[f32], place: usize) -> WideF32x4 {
    let numbers: Option<&[f32; 4]> = values[place..].first_chunk();
    numbers.copied().unwrap_or_default().into()
}

/// Fetches some numbers into the cache, one line of it after the other.
#[inline(always)]
fn prefetch_lines(values: &[f32], first: usize, count: usize) {
    let mut number = 0;
    while number < count {
        prefetch(values, first + number);
        number += 16;
    }
}

/// A symmetric matrix with `B` unknowns per node, in vectors of `L` numbers.
pub(crate) struct Symmetric<const B: usize, const L: usize> {
    pub above: Above<B>,
    /// The blocks on the diagonal, with zeros after each column.
    diagonal: Vec<[[f32; L]; B]>,
}

/// Some rows of a symmetric matrix.
#[derive(Default)]
pub(crate) struct UpperRows<const B: usize> {
    /// The blocks above the diagonal.
    above: BlockRows<B, B>,
    /// The blocks on the diagonal.
    diagonal: Vec<f32>,
}

impl<const B: usize> UpperRows<B> {
    /// Rows of a matrix with this many columns, in parts. `row` adds the blocks of a row to the
    /// sums, on the diagonal and above.
    pub fn of(rows: Range<usize>, width: usize, row: impl Fn(&mut Sums<B, B>, usize) + Sync) -> Vec<Self> {
        let part = |sums: &mut Sums<B, B>, part: usize| {
            let mut to = Self::default();
            let start = rows.start + part * ROWS;
            for n in start..(start + ROWS).min(rows.end) {
                row(sums, n);
                to.diagonal.extend(sums.at(n).as_flattened().iter().map(|&x| x as f32));
                to.above.push(sums, n + 1);
            }
            to
        };
        let parts = 0..rows.len().div_ceil(ROWS);
        parts.into_par_iter().map_init(|| Sums::new(width), part).collect()
    }
}

impl<const B: usize, const L: usize> From<Vec<UpperRows<B>>> for Symmetric<B, L> {
    /// The matrix with all rows.
    fn from(rows: Vec<UpperRows<B>>) -> Self {
        let mut starts = vec![0];
        for part in &rows {
            let before = starts[starts.len() - 1];
            starts.extend(part.above.ends.iter().map(|end| before + end));
        }
        let count = starts[starts.len() - 1];
        let mut later = Vec::with_capacity(count);
        rows.iter().for_each(|part| later.extend_from_slice(&part.above.columns));
        let mut values = vec![0.0; B * B * count + PADDING];
        let pieces = divided(&mut values, rows.iter().map(|part| part.above.values.len()));
        pieces.into_par_iter().zip(&rows).for_each(|(to, part)| to.copy_from_slice(&part.above.values));
        let padded = |block: &[f32]| -> [[f32; L]; B] {
            std::array::from_fn(|column| {
                std::array::from_fn(|row| if row < B { block[B * column + row] } else { 0.0 })
            })
        };
        let diagonal = rows.iter().flat_map(|part| part.diagonal.chunks_exact(B * B)).map(padded).collect();
        let neighbors = Arc::new(Neighbors::from_later(starts, &later));
        Self { above: Above { neighbors, values }, diagonal }
    }
}

impl Operator<6, 8> for Symmetric<6, 8> {
    fn above(&self) -> &Above<6> {
        &self.above
    }

    fn diagonal(&self, node: usize) -> Block<6, 6> {
        self.diagonal[node].map(|column| std::array::from_fn(|row| f64::from(column[row])))
    }

    #[inline]
    fn for_each(&self, row: usize, mut each: impl FnMut(usize, Block<6, 6>)) {
        self.above.row(row).for_each(|(column, block)| each(column, block));
        each(row, self.diagonal(row));
    }

    #[inline(always)]
    fn row_times(&self, node: usize, x: impl Fn(usize) -> [f32; 8]) -> [f32; 8] {
        let registers = |x: [f32; 8]| [0, 4].map(|n| register(&x, n));
        let mut sums = self.above.row_times(node, |neighbor| registers(x(neighbor)));
        let own = x(node);
        for (column, own) in self.diagonal[node].iter().zip(own) {
            for (sum, column) in sums.iter_mut().zip(registers(*column)) {
                *sum += column * WideF32x4::splat(own);
            }
        }
        let [[a, b, c, d], [e, f, ..]] = sums.map(Into::into);
        [a, b, c, d, e, f, 0.0, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows, products and neighbors of a matrix with few blocks are those of a dense matrix, whose
    /// blocks on both sides of the diagonal are transposed ones of each other.
    #[test]
    fn a_matrix_is_that_of_its_blocks_and_their_transposed_ones() {
        const COUNT: usize = 700;
        let has = |row: usize, column: usize| row == column || (row * 31 + column * 17).is_multiple_of(23);
        let number = |n: usize| ((n as f64 + 1.0) * 12.9898).sin();
        let entry = |row: usize, column: usize, i: usize, j: usize| {
            let [(row, i), (column, j)] =
                if (row, i) <= (column, j) { [(row, i), (column, j)] } else { [(column, j), (row, i)] };
            f64::from(number(((row * COUNT + column) * 6 + i) * 6 + j) as f32)
        };
        let rows = UpperRows::of(0..COUNT, COUNT, |sums, row| {
            for column in (row..COUNT).filter(|&column| has(row, column)) {
                let block = sums.at(column);
                for (j, of_column) in block.iter_mut().enumerate() {
                    of_column.iter_mut().enumerate().for_each(|(i, to)| *to += entry(row, column, i, j));
                }
            }
        });
        let matrix = Symmetric::<6, 8>::from(rows);
        let neighbors = &matrix.above.neighbors;
        let x: Vec<[f32; 8]> = (0..COUNT)
            .map(|node| std::array::from_fn(|n| if n < 6 { number(6 * node + n) as f32 } else { 0.0 }))
            .collect();
        let mut product = vec![[0.0; 8]; COUNT];
        matrix.times(&x, &mut product);
        for row in 0..COUNT {
            let there = |column: &usize| has(row.min(*column), row.max(*column));
            let expected: Vec<usize> = (0..COUNT).filter(|column| *column != row && there(column)).collect();
            let own: Vec<usize> = neighbors.of(row).iter().map(|&node| node as usize).collect();
            assert_eq!(own, expected, "{row}");
            assert_eq!(neighbors.later(row).len(), expected.iter().filter(|&&column| column > row).count());
            let mut sums = [0.0; 6];
            let mut seen = Vec::new();
            matrix.for_each(row, |column, block| {
                seen.push(column);
                for (i, sum) in sums.iter_mut().enumerate() {
                    for j in 0..6 {
                        assert_eq!(block[j][i], entry(row, column, i, j), "{row}, {column}");
                        *sum += block[j][i] * f64::from(x[column][j]);
                    }
                }
            });
            assert_eq!(seen, [expected, vec![row]].concat());
            for (sum, &found) in sums.iter().zip(&product[row]) {
                assert!((sum - f64::from(found)).abs() < 1e-4, "{row}: {sum} and {found}");
            }
            assert_eq!(product[row][6..], [0.0; 2]);
        }
    }
}
