//! The prolongation from the rigid motions of aggregates, and its smoothing.

use nalgebra::{Point3, SMatrix};
use rayon::prelude::*;

use crate::aggregates::Aggregates;
use crate::blocks::{Block, Blocks, ROWS, Sums, add_product, transposed};
use crate::multigrid::RIGID;
use crate::smoother::Operator;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Body;
    use crate::blocks::Columns;
    use crate::curvature::Curvature;
    use crate::galerkin::galerkin;
    use crate::smoother::Smoother;
    use crate::springs::block;

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
}
