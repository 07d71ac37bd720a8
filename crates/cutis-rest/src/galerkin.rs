//! The matrix of the next level.

use rayon::prelude::*;

use crate::blocks::{BlockRows, Blocks, Columns, ROWS, Sums, add_product};
use crate::multigrid::{LANES, RIGID};
use crate::smoother::Operator;
use crate::symmetric::{Symmetric, UpperRows};

/// Parts in which the matrix is made.
const CHUNKS: usize = 8;

/// The matrix of the next level, `Pᵀ A P` with the prolongation `P`, whose blocks are transposed.
/// `columns` are those of `P`.
///
/// `A P` has more numbers than `A`. So only the rows are stored at a time that some rows of the
/// result need.
pub(crate) fn galerkin<const B: usize, const L: usize>(
    matrix: &impl Operator<B, L>,
    prolongation: &Blocks<RIGID, B>,
    columns: &Columns,
) -> Symmetric<RIGID, LANES> {
    let count = prolongation.width;
    let chunk = count.div_ceil(CHUNKS).max(ROWS);
    let mut place = vec![u32::MAX; matrix.nodes()];
    let mut product: Vec<BlockRows<RIGID, B>> = Vec::new();
    let mut next = Vec::new();
    for start in (0..count).step_by(chunk) {
        let rows = start..(start + chunk).min(count);
        let mut fine: Vec<u32> = Vec::new();
        for &(node, _) in rows.clone().flat_map(|row| columns.of_column(row)) {
            if place[node as usize] == u32::MAX {
                place[node as usize] = 0;
                fine.push(node);
            }
        }
        fine.sort_unstable();
        fine.iter().enumerate().for_each(|(n, &node)| place[node as usize] = n as u32);
        product.resize_with(fine.len().div_ceil(ROWS).max(product.len()), BlockRows::default);
        product.par_iter_mut().zip(fine.par_chunks(ROWS)).for_each_init(
            || Sums::new(count),
            |sums, (part, nodes)| {
                part.clear();
                for &row in nodes {
                    matrix.for_each(row as usize, |column, block| {
                        for (to, own) in prolongation.row(column) {
                            add_product(sums.at(to), &own, &block);
                        }
                    });
                    part.push(sums, 0);
                }
            },
        );
        next.extend(UpperRows::of(rows, count, |sums, row| {
            for &(node, at) in columns.of_column(row) {
                let left = prolongation.block(at as usize);
                let node = place[node as usize] as usize;
                for (to, right) in product[node / ROWS].row(node % ROWS) {
                    if to >= row {
                        add_product(sums.at(to), &left, &right);
                    }
                }
            }
            hold_missing_modes(sums.at(row));
        }));
        fine.iter().for_each(|&node| place[node as usize] = u32::MAX);
    }
    next.into()
}

/// Gives the unknowns of missing modes, whose rows are zero, a diagonal.
fn hold_missing_modes(block: &mut [[f64; RIGID]; RIGID]) {
    let largest = (0..RIGID).map(|n| block[n][n]).fold(0.0, f64::max);
    for n in 0..RIGID {
        if block[n][n] <= 1e-14 * largest {
            block[n][n] = if largest > 0.0 { largest } else { 1.0 };
        }
    }
}
