//! The rows of blocks that go to a device.

use crate::blocks::{Block, Blocks, Columns};
use crate::matrix::Matrix;
use crate::multigrid::{LANES, RIGID};
use crate::smoother::{Operator, Smoother};
use crate::symmetric::Symmetric;

/// A sparse matrix, row by row. Blocks have `R` rows and `C` columns.
pub trait Rows<const R: usize, const C: usize>: Sync {
    /// Number of rows of blocks.
    fn count(&self) -> usize;
    /// Number of blocks of a row.
    fn blocks(&self, row: usize) -> usize;
    /// Gives the columns and blocks of a row to `each`.
    fn for_each(&self, row: usize, each: impl FnMut(usize, &Block<R, C>));
}

/// A matrix with a block that applies to the unknowns of a node itself. The others may apply to
/// differences.
pub trait Own<const B: usize> {
    /// The block of a node.
    fn own(&self, node: usize) -> Block<B, B>;
}

impl Own<3> for Matrix {
    /// The sum of the row, because the other blocks apply to differences.
    fn own(&self, node: usize) -> Block<3, 3> {
        self.sums[node].map(|column| std::array::from_fn(|n| f64::from(column[n])))
    }
}

impl Own<RIGID> for Symmetric<RIGID, LANES> {
    fn own(&self, node: usize) -> Block<RIGID, RIGID> {
        self.diagonal(node)
    }
}

/// The matrix of a level. A row begins with the own block and the inverse of the diagonal block,
/// and then has those of the neighbors.
pub struct OfMatrix<'a, M, const B: usize, const L: usize> {
    pub matrix: &'a M,
    /// None for a matrix that is only multiplied. Its inverses are zero.
    pub smoother: Option<&'a Smoother<B, L>>,
}

impl<M: Operator<B, L> + Own<B>, const B: usize, const L: usize> Rows<B, B> for OfMatrix<'_, M, B, L> {
    fn count(&self) -> usize {
        self.matrix.nodes()
    }

    fn blocks(&self, row: usize) -> usize {
        2 + self.matrix.above().neighbors.of(row).len()
    }

    fn for_each(&self, row: usize, mut each: impl FnMut(usize, &Block<B, B>)) {
        each(row, &self.matrix.own(row));
        each(row, &self.smoother.map_or([[0.0; B]; B], |smoother| smoother.inverse(row)));
        self.matrix.above().row(row).for_each(|(column, block)| each(column, &block));
    }
}

/// The rows of some nodes, with all columns.
pub struct OfNodes<'a> {
    pub matrix: OfMatrix<'a, Matrix, 3, 4>,
    pub nodes: &'a [u32],
}

impl Rows<3, 3> for OfNodes<'_> {
    fn count(&self) -> usize {
        self.nodes.len()
    }

    fn blocks(&self, row: usize) -> usize {
        self.matrix.blocks(self.nodes[row] as usize)
    }

    fn for_each(&self, row: usize, each: impl FnMut(usize, &Block<3, 3>)) {
        self.matrix.for_each(self.nodes[row] as usize, each);
    }
}

/// A prolongation, whose blocks are stored transposed.
pub struct Prolongation<'a, const B: usize>(pub &'a Blocks<RIGID, B>);

impl<const B: usize> Rows<B, RIGID> for Prolongation<'_, B> {
    fn count(&self) -> usize {
        self.0.pattern.starts.len() - 1
    }

    fn blocks(&self, row: usize) -> usize {
        self.0.pattern.places(row).len()
    }

    fn for_each(&self, row: usize, mut each: impl FnMut(usize, &Block<B, RIGID>)) {
        for (column, block) in self.0.row(row) {
            each(column, &std::array::from_fn(|n| std::array::from_fn(|own| block[own][n])));
        }
    }
}

/// The transposed matrix of a prolongation.
pub struct Restriction<'a, const B: usize> {
    prolongation: &'a Blocks<RIGID, B>,
    columns: Columns,
}

impl<'a, const B: usize> Restriction<'a, B> {
    /// The restriction for a prolongation with transposed blocks.
    pub fn of(prolongation: &'a Blocks<RIGID, B>) -> Self {
        Self { prolongation, columns: Columns::of(prolongation) }
    }
}

impl<const B: usize> Rows<RIGID, B> for Restriction<'_, B> {
    fn count(&self) -> usize {
        self.prolongation.width
    }

    fn blocks(&self, row: usize) -> usize {
        self.columns.of_column(row).len()
    }

    fn for_each(&self, row: usize, mut each: impl FnMut(usize, &Block<RIGID, B>)) {
        for &(node, place) in self.columns.of_column(row) {
            each(node as usize, &self.prolongation.block(place as usize));
        }
    }
}
