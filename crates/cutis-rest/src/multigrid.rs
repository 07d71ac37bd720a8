//! Multigrid by smoothed aggregation: a preconditioner for the equations of an elastic body.
//!
//! Each level groups the nodes of the level before. A group moves like a rigid body: it has six
//! unknowns. The prolongation from these is smoothed by one step of Jacobi's method (Vaněk, Mandel
//! and Brezina, Computing 56, 1996). The levels come from the matrix alone, so they follow cuts and
//! work for every mesh and every type of constraint.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Point3, SMatrix, SVector};
use rayon::prelude::*;

use crate::aggregates::Aggregates;
use crate::blocks::{Blocks, ROWS, Sums, add, dot};

/// Unknowns of a rigid body.
pub(crate) const RIGID: usize = 6;
/// A level with at most this many nodes is solved directly.
const BOTTOM: usize = 150;
/// Matrix products of a smoother.
const SMOOTHING: usize = 3;
/// The smoother reduces errors in the upper part of the spectrum, down to this share of its end.
const SPECTRUM: f32 = 0.08;
/// Steps of the estimate of the largest eigenvalue.
const POWER_STEPS: usize = 12;

/// A level and the way to the next one. A preconditioner needs no more than single precision.
struct Level<const B: usize> {
    matrix: Blocks<f32, B, B>,
    /// Inverse of each diagonal block.
    inverse: Vec<SMatrix<f32, B, B>>,
    /// Upper bound of the eigenvalues of the matrix times these inverses.
    largest: f32,
    /// From the unknowns of the next level.
    prolongation: Blocks<f32, B, RIGID>,
    restriction: Blocks<f32, RIGID, B>,
}

/// The levels of a matrix.
pub(crate) struct Multigrid {
    /// None if the matrix is small enough to be solved directly.
    fine: Option<Level<3>>,
    coarse: Vec<Level<RIGID>>,
    bottom: Bottom,
}

/// A matrix that is solved directly.
struct Bottom {
    factor: Option<Cholesky<f64, Dyn>>,
}

impl Multigrid {
    /// Builds the levels for a matrix with one node at each place, in m.
    pub fn new(matrix: &Blocks<f64, 3, 3>, places: &[Point3<f64>]) -> Self {
        if matrix.height() <= BOTTOM {
            return Self { fine: None, coarse: Vec::new(), bottom: Bottom::new(matrix) };
        }
        let modes: Vec<SMatrix<f64, 3, RIGID>> = places.iter().map(rigid_modes).collect();
        let (fine, mut matrix, mut modes) = Level::new(matrix, &modes);
        let mut coarse = Vec::new();
        while matrix.height() > BOTTOM {
            let before = matrix.height();
            let (level, next, next_modes) = Level::new(&matrix, &modes);
            coarse.push(level);
            (matrix, modes) = (next, next_modes);
            if matrix.height() * 10 > before * 9 {
                break;
            }
        }
        Self { fine: Some(fine), coarse, bottom: Bottom::new(&matrix) }
    }

    /// One V-cycle: an approximate solution of the equations with this right-hand side.
    pub fn cycle(&self, right: &[SVector<f64, 3>]) -> Vec<SVector<f64, 3>> {
        let largest = right.iter().map(SVector::amax).fold(0.0, f64::max);
        let Some(fine) = self.fine.as_ref().filter(|_| largest > 0.0) else {
            return self.bottom.solve(right);
        };
        // Single precision has a smaller range of exponents.
        let scaled: Vec<_> =
            right.par_iter().with_min_len(ROWS).map(|x| x.map(|x| (x / largest) as f32)).collect();
        let solved = fine.cycle(&scaled, |right| self.below(0, right));
        let unscaled = |x: &SVector<f32, 3>| x.map(|x| f64::from(x) * largest);
        solved.par_iter().with_min_len(ROWS).map(unscaled).collect()
    }

    /// The cycle from a coarse level on.
    fn below(&self, level: usize, right: &[SVector<f32, RIGID>]) -> Vec<SVector<f32, RIGID>> {
        match self.coarse.get(level) {
            Some(level_of) => level_of.cycle(right, |right| self.below(level + 1, right)),
            None => {
                let right: Vec<SVector<f64, RIGID>> = right.iter().map(|x| x.map(f64::from)).collect();
                self.bottom.solve(&right).iter().map(|x| x.map(|x| x as f32)).collect()
            }
        }
    }

    /// Numbers in the matrices of all levels over those of the first one.
    pub fn complexity(&self) -> f64 {
        let first = self.fine.as_ref().map_or(0, |fine| 9 * fine.matrix.values.len());
        let coarse = self.coarse.iter().map(|level| RIGID * RIGID * level.matrix.values.len());
        if first == 0 { 1.0 } else { (first + coarse.sum::<usize>()) as f64 / first as f64 }
    }
}

/// Displacements of a node when the body moves along and turns around each axis.
fn rigid_modes(place: &Point3<f64>) -> SMatrix<f64, 3, RIGID> {
    let [x, y, z] = place.coords.into();
    SMatrix::<f64, 3, RIGID>::from_rows(&[
        [1.0, 0.0, 0.0, 0.0, z, -y].into(),
        [0.0, 1.0, 0.0, -z, 0.0, x].into(),
        [0.0, 0.0, 1.0, y, -x, 0.0].into(),
    ])
}

/// The prolongation that moves each aggregate as a rigid body, as one block per node, and the modes
/// of the next level. The columns of an aggregate are orthonormal. Those of modes that it does not
/// have, because it has few nodes, are zero.
fn tentative<const B: usize>(
    aggregates: &Aggregates,
    modes: &[SMatrix<f64, B, RIGID>],
) -> (Vec<SMatrix<f64, B, RIGID>>, Vec<SMatrix<f64, RIGID, RIGID>>) {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); aggregates.count];
    for (node, &aggregate) in aggregates.of.iter().enumerate() {
        members[aggregate as usize].push(node as u32);
    }
    let orthonormal = |nodes: &Vec<u32>| {
        let mut blocks: Vec<SMatrix<f64, B, RIGID>> = nodes.iter().map(|&n| modes[n as usize]).collect();
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
    };
    let found: Vec<_> = members.par_iter().with_min_len(ROWS / 8).map(orthonormal).collect();
    let mut of_nodes = vec![SMatrix::zeros(); modes.len()];
    for (nodes, (blocks, _)) in members.iter().zip(&found) {
        for (&node, block) in nodes.iter().zip(blocks) {
            of_nodes[node as usize] = *block;
        }
    }
    (of_nodes, found.into_iter().map(|(_, factor)| factor).collect())
}

/// Gives the unknowns of missing modes, whose rows are zero, a diagonal.
fn hold_missing_modes(matrix: &mut Blocks<f64, RIGID, RIGID>) {
    for row in 0..matrix.height() {
        let range = matrix.starts[row]..matrix.starts[row + 1];
        let Ok(found) = matrix.columns[range.clone()].binary_search(&(row as u32)) else { continue };
        let block = &mut matrix.values[range.start + found];
        let largest = block.diagonal().max();
        for n in 0..RIGID {
            if block[(n, n)] <= 1e-14 * largest {
                block[(n, n)] = if largest > 0.0 { largest } else { 1.0 };
            }
        }
    }
}

/// A level with its smoother, before it is stored.
struct Setup<'a, const B: usize> {
    matrix: &'a Blocks<f64, B, B>,
    inverse: Vec<SMatrix<f64, B, B>>,
    largest: f64,
}

impl<'a, const B: usize> Setup<'a, B> {
    fn new(matrix: &'a Blocks<f64, B, B>) -> Self {
        let invert = |row: usize| {
            let block = matrix.get(row, row).copied().unwrap_or_else(SMatrix::identity);
            inverse(&block)
        };
        let inverse: Vec<_> = (0..matrix.height()).into_par_iter().map(invert).collect();
        let mut setup = Self { matrix, inverse, largest: 1.0 };
        setup.largest = 1.1 * setup.largest_eigenvalue();
        setup
    }

    /// An estimate of the largest eigenvalue of the matrix times the inverses, by the power method.
    fn largest_eigenvalue(&self) -> f64 {
        let start = |n: usize| SVector::from_fn(|row, _| noise(B * n + row));
        let mut x: Vec<SVector<f64, B>> = (0..self.inverse.len()).map(start).collect();
        let mut largest = 1.0;
        for _ in 0..POWER_STEPS {
            let before = dot(&x, &x).sqrt();
            let mut next = self.matrix.times(&x);
            next.par_iter_mut()
                .with_min_len(ROWS)
                .zip(&self.inverse)
                .for_each(|(x, inverse)| *x = inverse * *x);
            let after = dot(&next, &next).sqrt();
            if !(after > 0.0 && after.is_finite()) {
                break;
            }
            largest = after / before;
            next.iter_mut().for_each(|x| *x /= after);
            x = next;
        }
        largest
    }

    /// The prolongation after one step of damped Jacobi.
    fn smoothed(
        &self,
        aggregates: &Aggregates,
        tentative: &[SMatrix<f64, B, RIGID>],
    ) -> Blocks<f64, B, RIGID> {
        let damping = 4.0 / 3.0 / self.largest;
        let row = |sums: &mut Sums<f64, B, RIGID>, row: usize| {
            sums.add(aggregates.of[row] as usize, tentative[row]);
            for (column, block) in self.matrix.row(row) {
                let step = self.inverse[row] * (block * tentative[column]) * -damping;
                sums.add(aggregates.of[column] as usize, step);
            }
            sums.take()
        };
        let scratch = || Sums::new(aggregates.count);
        let rows = (0..tentative.len()).into_par_iter().with_min_len(ROWS).map_init(scratch, row);
        Blocks::from_rows(rows.collect(), aggregates.count)
    }
}

impl<const B: usize> Level<B> {
    /// Builds a level for a matrix, and the matrix and modes of the next one.
    fn new(
        matrix: &Blocks<f64, B, B>,
        modes: &[SMatrix<f64, B, RIGID>],
    ) -> (Self, Blocks<f64, RIGID, RIGID>, Vec<SMatrix<f64, RIGID, RIGID>>) {
        let aggregates = Aggregates::of(matrix);
        let (tentative, next_modes) = tentative(&aggregates, modes);
        let setup = Setup::new(matrix);
        let prolongation = setup.smoothed(&aggregates, &tentative);
        let restriction = prolongation.transposed();
        let mut next = restriction.product(&matrix.product(&prolongation));
        hold_missing_modes(&mut next);
        let level = Self {
            matrix: matrix.single(),
            inverse: setup.inverse.iter().map(|block| block.map(|x| x as f32)).collect(),
            largest: setup.largest as f32,
            prolongation: prolongation.single(),
            restriction: restriction.single(),
        };
        (level, next, next_modes)
    }

    fn cycle(
        &self,
        right: &[SVector<f32, B>],
        below: impl FnOnce(&[SVector<f32, RIGID>]) -> Vec<SVector<f32, RIGID>>,
    ) -> Vec<SVector<f32, B>> {
        let (mut x, residual) = self.smooth_from_zero(right);
        let correction = below(&self.restriction.times(&residual));
        add(&mut x, 1.0, &self.prolongation.times(&correction));
        self.smooth(right, &mut x);
        x
    }

    /// Smooths from zero. Returns the result and its residual.
    fn smooth_from_zero(&self, right: &[SVector<f32, B>]) -> (Vec<SVector<f32, B>>, Vec<SVector<f32, B>>) {
        let mut x = vec![SVector::zeros(); right.len()];
        let mut residual = right.to_vec();
        self.chebyshev(&mut x, &mut residual);
        (x, residual)
    }

    /// Smooths an approximation.
    fn smooth(&self, right: &[SVector<f32, B>], x: &mut [SVector<f32, B>]) {
        let mut residual = self.matrix.times(x);
        residual.par_iter_mut().with_min_len(ROWS).zip(right).for_each(|(r, b)| *r = b - *r);
        self.chebyshev(x, &mut residual);
    }

    /// Chebyshev iteration with the inverses of the diagonal blocks (Adams, Brezina, Hu and
    /// Tuminaro, J. Comput. Phys. 188, 2003). It needs no order of the nodes, so that all of them
    /// move at once. `residual` is that of `x`, at the start and at the end.
    fn chebyshev(&self, x: &mut [SVector<f32, B>], residual: &mut [SVector<f32, B>]) {
        let (middle, half) = (0.5 * self.largest * (1.0 + SPECTRUM), 0.5 * self.largest * (1.0 - SPECTRUM));
        let ratio = middle / half;
        let mut factor = 1.0 / ratio;
        let mut step: Vec<SVector<f32, B>> = residual
            .par_iter()
            .with_min_len(ROWS)
            .zip(&self.inverse)
            .map(|(r, inverse)| inverse * r / middle)
            .collect();
        for n in 0..SMOOTHING {
            add(x, 1.0, &step);
            let update = |(row, r): (usize, &mut SVector<f32, B>)| *r -= self.matrix.row_times(row, &step);
            residual.par_iter_mut().enumerate().with_min_len(ROWS).for_each(update);
            if n + 1 < SMOOTHING {
                let next = 1.0 / (2.0 * ratio - factor);
                let (old, new) = (next * factor, 2.0 * next / half);
                step.par_iter_mut()
                    .with_min_len(ROWS)
                    .zip(residual.par_iter().zip(&self.inverse))
                    .for_each(|(step, (r, inverse))| *step = *step * old + inverse * r * new);
                factor = next;
            }
        }
    }
}

/// The inverse of a symmetric block. Where it has none, that of its diagonal.
fn inverse<const B: usize>(block: &SMatrix<f64, B, B>) -> SMatrix<f64, B, B> {
    if let Some(factor) = Cholesky::new(DMatrix::from_iterator(B, B, block.iter().copied())) {
        let inverse = factor.inverse();
        if inverse.iter().all(|x| x.is_finite()) {
            return SMatrix::from_fn(|row, column| inverse[(row, column)]);
        }
    }
    SMatrix::from_diagonal(&block.diagonal().map(|x| if x > 0.0 { 1.0 / x } else { 1.0 }))
}

impl Bottom {
    fn new<const B: usize>(matrix: &Blocks<f64, B, B>) -> Self {
        let size = B * matrix.height();
        let mut dense = DMatrix::zeros(size, size);
        for row in 0..matrix.height() {
            for (column, block) in matrix.row(row) {
                dense.view_mut((B * row, B * column), (B, B)).copy_from(block);
            }
        }
        let mut shift = 0.0;
        let mean = if size > 0 { dense.diagonal().sum() / size as f64 } else { 1.0 };
        // A body that nothing holds has a singular matrix.
        let factor = loop {
            let mut shifted = dense.clone();
            (0..size).for_each(|n| shifted[(n, n)] += shift * mean);
            let factor = Cholesky::new(shifted);
            if factor.is_some() || shift > 1.0 {
                break factor;
            }
            shift = if shift == 0.0 { 1e-12 } else { 100.0 * shift };
        };
        Self { factor }
    }

    fn solve<const B: usize>(&self, right: &[SVector<f64, B>]) -> Vec<SVector<f64, B>> {
        let Some(factor) = &self.factor else { return right.to_vec() };
        let flat = DVector::from_iterator(B * right.len(), right.iter().flat_map(|x| x.iter().copied()));
        let solved = factor.solve(&flat);
        solved.as_slice().chunks_exact(B).map(SVector::from_column_slice).collect()
    }
}

/// A pseudo-random number from −1 to 1.
fn noise(n: usize) -> f64 {
    let mixed = (n as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((mixed ^ (mixed >> 32)) >> 11) as f64 / 2f64.powi(52) - 1.0
}
