//! The way between two levels: prolongation from the rigid motions of the aggregates.

use std::ops::Range;

use nalgebra::{Point3, SMatrix};
use rayon::prelude::*;

use crate::aggregates::Aggregates;
use crate::blocks::{Block, Blocks, Columns, ROWS, Sums, add_product, transposed};
use crate::multigrid::{LANES, RIGID};
use crate::smoother::Operator;
use crate::symmetric::{Rows, Symmetric};

/// Parts in which the matrix of the next level is made.
const CHUNKS: usize = 8;
/// Rows of a part in which a vector is restricted, and the most parts.
const PART: usize = 2048;
const MOST_PARTS: usize = 32;
/// Unknowns of a rigid body, and the zeros of a vector.
type Coarse = [f32; LANES];

/// Displacements of a node in each rigid motion of the body.
pub(crate) type Modes<const B: usize> = Block<B, RIGID>;

/// Displacements of a node when the body moves along and turns around each axis.
pub(crate) fn rigid_modes(place: &Point3<f64>) -> Modes<3> {
    let [x, y, z] = place.coords.into();
    let (i, o) = (1.0, 0.0);
    [[i, o, o], [o, i, o], [o, o, i], [o, -z, y], [z, o, -x], [-y, x, o]]
}

/// The prolongation that moves each aggregate as a rigid body, as one block per node, and the modes
/// of the next level. The columns of an aggregate are orthonormal. Those of modes that it does not
/// have, because it has few nodes, are zero.
pub(crate) fn tentative<const B: usize>(
    aggregates: &Aggregates,
    modes: Vec<Modes<B>>,
) -> (Vec<Modes<B>>, Vec<Modes<RIGID>>) {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); aggregates.count];
    for (node, &aggregate) in aggregates.of.iter().enumerate() {
        members[aggregate as usize].push(node as u32);
    }
    let found: Vec<_> =
        members.par_iter().with_min_len(ROWS / 8).map(|nodes| orthonormal(nodes, &modes)).collect();
    let mut of_nodes = modes;
    let of_node = |(node, to): (usize, &mut Modes<B>)| {
        let aggregate = aggregates.of[node] as usize;
        let Ok(member) = members[aggregate].binary_search(&(node as u32)) else { return };
        *to = std::array::from_fn(|n| found[aggregate].0[member].column(n).into_owned().into());
    };
    of_nodes.par_iter_mut().enumerate().with_min_len(ROWS).for_each(of_node);
    (of_nodes, found.into_iter().map(|(_, factor)| factor.into()).collect())
}

/// Orthonormal columns for the modes of some nodes, and the factors of the modes in them.
fn orthonormal<const B: usize>(
    nodes: &[u32],
    modes: &[Modes<B>],
) -> (Vec<SMatrix<f64, B, RIGID>>, SMatrix<f64, RIGID, RIGID>) {
    let mut blocks: Vec<SMatrix<f64, B, RIGID>> =
        nodes.iter().map(|&n| SMatrix::from(modes[n as usize])).collect();
    let mut factor = SMatrix::<f64, RIGID, RIGID>::zeros();
    for column in 0..RIGID {
        let norm = |blocks: &[SMatrix<f64, B, RIGID>]| {
            blocks.iter().map(|block| block.column(column).norm_squared()).sum::<f64>().sqrt()
        };
        let whole = norm(&blocks);
        // Twice, because rounding leaves a part of the other columns.
        for _ in 0..2 {
            for before in 0..column {
                let along: f64 =
                    blocks.iter().map(|block| block.column(before).dot(&block.column(column))).sum();
                factor[(before, column)] += along;
                for block in &mut blocks {
                    let part = block.column(before) * along;
                    let mut own = block.column_mut(column);
                    own -= part;
                }
            }
        }
        let left = norm(&blocks);
        let exists = left > 1e-6 * whole;
        factor[(column, column)] = if exists { left } else { 0.0 };
        let scale = if exists { 1.0 / left } else { 0.0 };
        blocks.iter_mut().for_each(|block| block.column_mut(column).scale_mut(scale));
    }
    (blocks, factor)
}

/// A smoothing step of a prolongation: damped Jacobi (Vaněk, Mandel and Brezina, Computing 56,
/// 1996).
pub(crate) struct Jacobi<F> {
    /// The inverse of the diagonal block of a node.
    pub inverse: F,
    /// The largest eigenvalue of the matrix times these inverses.
    pub largest: f32,
}

impl<F> Jacobi<F> {
    /// Replaces the products of a row of the matrix with a prolongation by its change.
    fn step<const B: usize>(&self, row: usize, products: &mut Sums<RIGID, B>)
    where
        F: Fn(usize) -> Block<B, B>,
    {
        let mut factor = (self.inverse)(row);
        let damping = -4.0 / 3.0 / f64::from(self.largest);
        factor.as_flattened_mut().iter_mut().for_each(|x| *x *= damping);
        products.for_each(|product| {
            let mut step = [[0.0; RIGID]; B];
            add_product(&mut step, product, &factor);
            *product = step;
        });
    }
}

/// The prolongation after a smoothing step, with transposed blocks.
pub(crate) fn smoothed<const B: usize, const L: usize>(
    matrix: &impl Operator<B, L>,
    jacobi: &Jacobi<impl Fn(usize) -> Block<B, B> + Sync>,
    aggregates: &Aggregates,
    tentative: &[Modes<B>],
) -> Blocks<RIGID, B> {
    let columns = |row: usize, list: &mut Vec<u32>| {
        let neighbors = matrix.above().neighbors.of(row).iter().map(|&node| node as usize);
        list.extend(neighbors.chain([row]).map(|node| aggregates.of[node]));
    };
    Blocks::by_rows(tentative.len(), aggregates.count, columns, |sums, row| {
        matrix.for_each(row, |column, block| {
            let own = transposed(&tentative[column]);
            add_product(sums.at(aggregates.of[column] as usize), &own, &block);
        });
        jacobi.step(row, sums);
        add(sums.at(aggregates.of[row] as usize), &transposed(&tentative[row]));
    })
}

/// The prolongation after another smoothing step, with the same blocks: those that would be new are
/// left out, and the others still move the body as a whole (Olson, Schroder and Tuminaro, SIAM J.
/// Sci. Comput. 33, 2011). `modes` are those of the next level.
pub(crate) fn smoothed_again<const B: usize, const L: usize>(
    matrix: &impl Operator<B, L>,
    jacobi: &Jacobi<impl Fn(usize) -> Block<B, B> + Sync>,
    prolongation: &Blocks<RIGID, B>,
    modes: &[Modes<RIGID>],
) -> Blocks<RIGID, B> {
    let Blocks { pattern, width, .. } = prolongation;
    let own = |row: usize| &pattern.columns[pattern.places(row)];
    let columns = |row: usize, list: &mut Vec<u32>| list.extend_from_slice(own(row));
    Blocks::by_rows(matrix.nodes(), *width, columns, |sums, row| {
        for &column in own(row) {
            sums.at(column as usize);
        }
        let mut is_whole = true;
        matrix.for_each(row, |column, block| {
            for place in pattern.places(column) {
                match sums.existing(pattern.columns[place] as usize) {
                    Some(sum) => add_product(sum, &prolongation.block(place), &block),
                    None => is_whole = false,
                }
            }
        });
        jacobi.step(row, sums);
        if !is_whole {
            keep_modes(sums, own(row), modes);
        }
        prolongation.row(row).for_each(|(column, block)| add(sums.at(column), &block));
    })
}

/// Takes the part from the changes of a row that would change the modes: the least one, so that the
/// sum of changes times modes is zero.
fn keep_modes<const B: usize>(changes: &mut Sums<RIGID, B>, columns: &[u32], modes: &[Modes<RIGID>]) {
    let of = |column: u32| SMatrix::<f64, RIGID, RIGID>::from(modes[column as usize]);
    let mut moved = SMatrix::<f64, RIGID, B>::zeros();
    let mut squares = SMatrix::<f64, RIGID, RIGID>::zeros();
    for &column in columns {
        moved += of(column).transpose() * SMatrix::<f64, RIGID, B>::from(*changes.at(column as usize));
        squares += of(column).transpose() * of(column);
    }
    let factors = squares.cholesky().map(|squares| squares.inverse() * moved);
    for &column in columns {
        let change = changes.at(column as usize);
        // Modes that depend on each other have no such part.
        let kept = factors.map_or(SMatrix::zeros(), |factors| {
            SMatrix::<f64, RIGID, B>::from(*change) - of(column) * factors
        });
        *change = kept.into();
    }
}

fn add<const B: usize>(to: &mut Block<RIGID, B>, block: &Block<RIGID, B>) {
    for (to, from) in to.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
        *to += from;
    }
}

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
    let mut product: Vec<Part<B>> = Vec::new();
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
        product.resize_with(fine.len().div_ceil(ROWS).max(product.len()), Part::default);
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
                    part.push(sums);
                }
            },
        );
        next.extend(Rows::of(rows, count, |sums, row| {
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

/// Some rows of `A P`, with transposed blocks.
#[derive(Default)]
struct Part<const B: usize> {
    ends: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f32>,
}

impl<const B: usize> Part<B> {
    fn clear(&mut self) {
        self.ends.clear();
        self.columns.clear();
        self.values.clear();
    }

    /// Appends the row with these sums, and clears them.
    fn push(&mut self, sums: &mut Sums<RIGID, B>) {
        sums.append_from(0, &mut self.columns, &mut self.values);
        self.ends.push(self.columns.len());
    }

    /// Columns and blocks of a row.
    #[inline]
    fn row(&self, row: usize) -> impl Iterator<Item = (usize, Block<RIGID, B>)> {
        let start = row.checked_sub(1).map_or(0, |before| self.ends[before]);
        let own = start..self.ends[row];
        let blocks = self.values[B * RIGID * own.start..].chunks_exact(B * RIGID);
        self.columns[own].iter().zip(blocks).map(|(&column, values)| {
            let block = |n: usize, row: usize| f64::from(values[RIGID * n + row]);
            (column as usize, std::array::from_fn(|n| std::array::from_fn(|row| block(n, row))))
        })
    }
}

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

/// Gives the unknowns of missing modes, whose rows are zero, a diagonal.
fn hold_missing_modes(block: &mut [[f64; RIGID]; RIGID]) {
    let largest = (0..RIGID).map(|n| block[n][n]).fold(0.0, f64::max);
    for n in 0..RIGID {
        if block[n][n] <= 1e-14 * largest {
            block[n][n] = if largest > 0.0 { largest } else { 1.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Body;
    use crate::curvature::Curvature;
    use crate::smoother::Smoother;
    use crate::springs::block;
    use crate::vectors::dot;

    /// Each smoothing step of the prolongation lowers the energy of its columns, and both move the
    /// body as a whole where no fixed vertex is near.
    #[test]
    fn both_smoothing_steps_lower_the_energy_and_keep_rigid_motions() {
        let body = Body::of(&block(), [0.0; 3]).unwrap();
        let mut matrix = body.empty_matrix();
        body.fill(&mut matrix, &body.start, Curvature::Stretched, 0.0);
        let places: Vec<_> = body.free.iter().map(|&v| body.start[v as usize]).collect();
        let aggregates = Aggregates::of(&matrix);
        let (first, modes) = tentative(&aggregates, places.iter().map(rigid_modes).collect());
        let smoother = Smoother::<3, 4>::new(&matrix, &places, 0.08);
        let jacobi = Jacobi { inverse: |node: usize| smoother.inverse(node), largest: smoother.largest };
        let once = smoothed(&matrix, &jacobi, &aggregates, &first);
        let twice = smoothed_again(&matrix, &jacobi, &once, &modes);
        assert!(once.pattern.columns == twice.pattern.columns);
        let [energy, of_twice] = [&once, &twice].map(|prolongation| {
            let next = galerkin(&matrix, prolongation, &Columns::of(prolongation));
            let trace = |node: usize| (0..RIGID).map(|n| next.diagonal(node)[n][n]).sum::<f64>();
            (0..next.nodes()).map(trace).sum::<f64>()
        });
        assert!(of_twice < 0.97 * energy, "{of_twice} and {energy}");
        let error = |prolongation: &Blocks<RIGID, 3>| {
            let of_row = |row: usize| {
                let mut sum = [[0.0; 3]; RIGID];
                for (column, block) in prolongation.row(row) {
                    add_product(&mut sum, &transposed(&block), &transposed(&modes[column]));
                }
                let apart = |(a, b): (&f64, &f64)| (a - b).abs();
                let rigid = rigid_modes(&places[row]);
                let pairs = sum.as_flattened().iter().zip(rigid.as_flattened());
                pairs.map(apart).fold(0.0, f64::max)
            };
            let inside = (0..places.len()).filter(|&row| places[row].z > 0.05);
            inside.map(of_row).fold(0.0, f64::max)
        };
        assert!(error(&once) < 1e-5 && error(&twice) < 1e-5, "{:e} {:e}", error(&once), error(&twice));
        // Control: without the part that keeps them, the second step changes the rigid motions.
        let own = |row: usize, list: &mut Vec<u32>| {
            list.extend_from_slice(&once.pattern.columns[once.pattern.places(row)]);
        };
        let careless = Blocks::by_rows(places.len(), once.width, own, |sums, row| {
            once.row(row).for_each(|(column, _)| *sums.at(column) = [[0.0; RIGID]; 3]);
            matrix.for_each(row, |node, block| {
                for (column, right) in once.row(node) {
                    if let Some(sum) = sums.existing(column) {
                        add_product(sum, &right, &block);
                    }
                }
            });
            jacobi.step(row, sums);
            once.row(row).for_each(|(column, block)| add(sums.at(column), &block));
        });
        assert!(error(&careless) > 1e-2, "control: {:e}", error(&careless));
    }

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
