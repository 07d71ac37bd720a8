//! Multigrid by smoothed aggregation: a preconditioner for the equations of an elastic body.
//!
//! Each level groups the nodes of the level before. A group moves like a rigid body: it has six
//! unknowns. The prolongation from these is smoothed by a step of Jacobi's method (Vaněk, Mandel
//! and Brezina, Computing 56, 1996). Below the finest level, where that costs little, and in nearly
//! incompressible bodies a second step follows, which adds no blocks. The levels come from the
//! matrix alone, so they follow cuts and work for every mesh and every type of constraint.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Point3};
use rayon::prelude::*;

use crate::aggregates::Aggregates;
use crate::blocks::Columns;
use crate::compression::compression_over_shear;
use crate::galerkin::galerkin;
use crate::matrix::Matrix;
use crate::patch::Patch;
use crate::prolongation::{Jacobi, Modes, rigid_modes, smoothed, smoothed_again, tentative};
use crate::smoother::{Operator, Smoother};
use crate::symmetric::Symmetric;
use crate::transfer::Transfer;
use crate::vectors::Vector;

/// Unknowns of a rigid body.
pub(crate) const RIGID: usize = 6;
/// [`RIGID`] and the zeros of a vector.
pub(crate) const LANES: usize = 8;
/// The share of the spectrum that a smoother leaves to the next level.
const SPECTRUM: f32 = 0.08;
/// The finest prolongation is smoothed twice if the resistance to compression is this many times
/// that to shear: where the bulk modulus is some thirty times Young's modulus.
const NEARLY_INCOMPRESSIBLE: f64 = 80.0;
/// A level with at most this many nodes is solved directly.
const BOTTOM: usize = 150;

/// A level and the way to the next one.
pub(crate) struct Level<const B: usize, const L: usize> {
    pub smoother: Smoother<B, L>,
    /// From the unknowns of the next level, and back.
    pub transfer: Transfer<B>,
    /// Memory for vectors of this level and of the next one.
    residual: Vector<L>,
    coarse: Vector<LANES>,
}

/// A level below the finest one.
pub(crate) struct Coarse {
    pub matrix: Symmetric<RIGID, LANES>,
    pub level: Level<RIGID, LANES>,
}

/// What the next level is built from.
struct Next {
    matrix: Symmetric<RIGID, LANES>,
    modes: Vec<Modes<RIGID>>,
    /// Where the nodes are, in m.
    places: Vec<Point3<f64>>,
}

/// The levels of a matrix.
pub(crate) struct Multigrid {
    /// None if the matrix is small enough to be solved directly.
    pub fine: Option<Level<3, 4>>,
    /// The part of the finest level that is smoothed more.
    pub patch: Option<Patch>,
    pub coarse: Vec<Coarse>,
    pub bottom: Bottom,
}

/// A matrix that is solved directly.
pub(crate) struct Bottom {
    /// None if no shift makes the matrix positive. Its solution is then the right-hand side.
    pub factor: Option<Cholesky<f64, Dyn>>,
}

impl Multigrid {
    /// Builds the levels for a matrix with one node at each place, in m.
    pub fn new(matrix: &Matrix, places: &[Point3<f64>]) -> Self {
        if matrix.nodes() <= BOTTOM {
            return Self { fine: None, patch: None, coarse: Vec::new(), bottom: Bottom::new(matrix) };
        }
        let patch = Patch::of(matrix, places);
        let modes = places.par_iter().map(rigid_modes).collect();
        let twice = compression_over_shear(matrix, places) > NEARLY_INCOMPRESSIBLE;
        let (fine, mut next) = Level::new(matrix, modes, places, twice);
        let mut coarse = Vec::new();
        while next.matrix.nodes() > BOTTOM {
            let Next { matrix, modes, places } = next;
            let before = matrix.nodes();
            let level;
            (level, next) = Level::new(&matrix, modes, &places, true);
            coarse.push(Coarse { matrix, level });
            if next.matrix.nodes() * 10 > before * 9 {
                break;
            }
        }
        Self { fine: Some(fine), patch, coarse, bottom: Bottom::new(&next.matrix) }
    }

    /// Adapts the smoothers of the finest level to another matrix. The other levels stay.
    pub fn update(&mut self, matrix: &Matrix) {
        match &mut self.fine {
            Some(fine) => fine.smoother.update(matrix),
            None => self.bottom = Bottom::new(matrix),
        }
        if let Some(patch) = &mut self.patch {
            patch.update(matrix);
        }
    }

    /// One V-cycle: writes an approximate solution of the equations with this right-hand side, and
    /// the matrix times it.
    pub fn cycle(
        &mut self,
        matrix: &Matrix,
        right: &[[f32; 4]],
        to: &mut [[f32; 4]],
        product: &mut [[f32; 4]],
    ) {
        let Self { fine, patch, coarse, bottom } = self;
        match fine {
            Some(fine) => {
                fine.start(matrix, right, to);
                if let Some(patch) = patch {
                    patch.smooth(to, &fine.residual);
                    patch.find_residual(matrix, right, to, &mut fine.residual);
                }
                fine.correct(to, |right, to| below(coarse, bottom, right, to));
                if let Some(patch) = patch {
                    patch.find_residual(matrix, right, to, &mut fine.residual);
                    patch.smooth(to, &fine.residual);
                }
                fine.smooth(matrix, right, to, Some(product));
            }
            None => {
                bottom.solve::<3, 4>(right, to);
                matrix.times(to, product);
            }
        }
    }

    /// Numbers in the matrices of all levels over those of the first one.
    pub fn complexity(&self, matrix: &Matrix) -> f64 {
        let coarse: usize = self.coarse.iter().map(|coarse| coarse.matrix.numbers()).sum();
        1.0 + coarse as f64 / matrix.numbers() as f64
    }
}

/// The cycle from a coarse level on.
fn below(levels: &mut [Coarse], bottom: &Bottom, right: &[[f32; LANES]], to: &mut [[f32; LANES]]) {
    match levels {
        [Coarse { matrix, level }, rest @ ..] => {
            level.start(&*matrix, right, to);
            level.correct(to, |right, to| below(rest, bottom, right, to));
            level.smooth(&*matrix, right, to, None);
        }
        [] => bottom.solve::<RIGID, LANES>(right, to),
    }
}

impl<const B: usize, const L: usize> Level<B, L> {
    /// Builds a level for a matrix whose nodes are at some places, in m. `twice` smooths the
    /// prolongation a second time.
    fn new(
        matrix: &impl Operator<B, L>,
        modes: Vec<Modes<B>>,
        places: &[Point3<f64>],
        twice: bool,
    ) -> (Self, Next) {
        // One thread forms the aggregates.
        let (aggregates, smoother) =
            rayon::join(|| Aggregates::of(matrix), || Smoother::new(matrix, places, SPECTRUM));
        let (tentative, modes) = tentative(&aggregates, modes);
        let jacobi = Jacobi { inverse: |node: usize| smoother.inverse(node), largest: smoother.largest };
        let prolongation = smoothed(matrix, &jacobi, &aggregates, &tentative);
        drop(tentative);
        let again = || smoothed_again(matrix, &jacobi, &prolongation, &modes);
        // A second step leaves the blocks where they are.
        let (again, columns) = rayon::join(|| twice.then(again), || Columns::of(&prolongation));
        let prolongation = again.unwrap_or(prolongation);
        let next = galerkin(matrix, &prolongation, &columns);
        drop(columns);
        let transfer = Transfer::new(prolongation);
        let residual = vec![[0.0; L]; matrix.nodes()];
        let coarse = vec![[0.0; LANES]; aggregates.count];
        let next = Next { matrix: next, modes, places: aggregates.centers(places) };
        (Self { smoother, transfer, residual, coarse }, next)
    }

    /// Smooths from zero, and keeps the residual.
    fn start(&mut self, matrix: &impl Operator<B, L>, right: &[[f32; L]], to: &mut [[f32; L]]) {
        self.smoother.start(matrix, right, to, &mut self.residual);
    }

    /// Adds the solution of the next level for the residual.
    fn correct(&mut self, to: &mut [[f32; L]], below: impl FnOnce(&[[f32; LANES]], &mut [[f32; LANES]])) {
        below(&self.transfer.restrict(&self.residual), &mut self.coarse);
        self.transfer.add_prolonged(&self.coarse, to);
    }

    /// Smooths an approximation, and writes the matrix times the result.
    fn smooth(
        &mut self,
        matrix: &impl Operator<B, L>,
        right: &[[f32; L]],
        to: &mut [[f32; L]],
        product: Option<&mut [[f32; L]]>,
    ) {
        self.smoother.smooth(matrix, right, to, &mut self.residual, product);
    }
}

impl Bottom {
    fn new<const B: usize, const L: usize>(matrix: &impl Operator<B, L>) -> Self {
        let size = B * matrix.nodes();
        let mut dense = DMatrix::zeros(size, size);
        for row in 0..matrix.nodes() {
            matrix.for_each(row, |column, block| {
                for (j, of_column) in block.iter().enumerate() {
                    for (i, &value) in of_column.iter().enumerate() {
                        dense[(B * row + i, B * column + j)] = value;
                    }
                }
            });
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
            shift = if shift == 0.0 { 1e-9 } else { 100.0 * shift };
        };
        Self { factor }
    }

    fn solve<const B: usize, const L: usize>(&self, right: &[[f32; L]], to: &mut [[f32; L]]) {
        let Some(factor) = &self.factor else { return to.copy_from_slice(right) };
        let mut x = DVector::from_iterator(
            B * right.len(),
            right.iter().flat_map(|x| x[..B].iter().map(|&x| f64::from(x))),
        );
        factor.solve_mut(&mut x);
        for (to, x) in to.iter_mut().zip(x.as_slice().chunks_exact(B)) {
            *to = std::array::from_fn(|n| if n < B { x[n] as f32 } else { 0.0 });
        }
    }
}
