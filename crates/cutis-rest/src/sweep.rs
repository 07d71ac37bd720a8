//! The products of a smoother, in one pass through the rows.

use std::ops::Range;

use rayon::prelude::*;

use crate::blocks::ROWS;
use crate::fronts::Fronts;
use crate::smoother::{Operator, times};

/// The factors of a change of `x`: for the change before, or for `x`, and for the inverse of the
/// diagonal times the residual.
pub(crate) type Factors = (f32, f32);

/// What happens at a row. A stage reads what the stage before has written at the neighbors.
#[derive(Clone, Copy)]
pub(crate) enum Stage {
    /// Writes a multiple of the inverse of the diagonal times the right-hand side to `x`.
    Start(f32),
    /// Writes the residual of `x`, and the first change.
    First(Factors),
    /// Subtracts the product with the first change from the residual, and writes the second change.
    Second(Factors),
    /// Subtracts the product with the second change from the residual. Adds both changes to `x`,
    /// and a third one if there are factors for it.
    Third(Option<Factors>),
    /// Writes the product with `x`, if it is wanted.
    Product,
}

/// Vectors at some rows, from the first one on.
pub(crate) struct Rows<'a, const L: usize> {
    pub first: usize,
    pub x: &'a mut [[f32; L]],
    pub residual: &'a mut [[f32; L]],
    pub changes: [&'a mut [[f32; L]]; 2],
    pub product: Option<&'a mut [[f32; L]]>,
}

impl<'a, const L: usize> Rows<'a, L> {
    /// The same rows for a shorter time.
    fn again(&mut self) -> Rows<'_, L> {
        let Self { first, x, residual, changes: [one, two], product } = self;
        Rows { first: *first, x, residual, changes: [one, two], product: product.as_deref_mut() }
    }

    /// The rows before one, and those from it on.
    fn split(self, row: usize) -> (Self, Self) {
        let at = row - self.first;
        let (x, x_after) = self.x.split_at_mut(at);
        let (residual, residual_after) = self.residual.split_at_mut(at);
        let [one, two] = self.changes;
        let ((one, one_after), (two, two_after)) = (one.split_at_mut(at), two.split_at_mut(at));
        let (product, product_after) = self.product.map(|product| product.split_at_mut(at)).unzip();
        let before = Self { first: self.first, x, residual, changes: [one, two], product };
        let changes = [one_after, two_after];
        (before, Self { first: row, x: x_after, residual: residual_after, changes, product: product_after })
    }
}

/// Four stages that go through the rows together.
pub(crate) struct Sweep<'a, M, const B: usize, const L: usize> {
    pub matrix: &'a M,
    /// Inverses of the blocks on the diagonal, column by column.
    pub inverse: &'a [[[f32; L]; B]],
    pub right: &'a [[f32; L]],
    pub stages: [Stage; 4],
}

impl<M: Operator<B, L>, const B: usize, const L: usize> Sweep<'_, M, B, L> {
    /// Runs all stages at all rows: together, or one after the other.
    pub fn run(&self, fronts: Option<&Fronts<4>>, mut vectors: Rows<'_, L>) {
        let Some(fronts) = fronts else {
            return self.stages.into_iter().for_each(|stage| self.everywhere(stage, &mut vectors));
        };
        for domains in fronts.passes() {
            let mut rest = vectors.again();
            let mut parts = Vec::with_capacity(domains.len());
            for domain in domains {
                let (own, after) = rest.split(domain.rows.start).1.split(domain.rows.end);
                parts.push((domain, own));
                rest = after;
            }
            parts.into_par_iter().for_each(|(domain, mut own)| {
                for (stage, rows) in &domain.steps {
                    self.at(self.stages[*stage], rows.clone(), &mut own);
                }
            });
        }
    }

    /// Runs a stage at all rows.
    fn everywhere(&self, stage: Stage, vectors: &mut Rows<'_, L>) {
        let Rows { x, residual, changes: [one, two], product, .. } = vectors;
        let rows = residual.par_iter_mut().enumerate().with_min_len(ROWS / 8);
        match stage {
            Stage::Start(factor) => {
                rows.zip(&mut **x).for_each(|((row, _), x)| *x = self.start(row, factor));
            }
            Stage::First(factors) => rows.zip(&mut **one).for_each(|((row, residual), one)| {
                *residual = self.right[row];
                *one = self.change(row, |row| x[row], residual, Some(factors));
            }),
            Stage::Second(factors) => rows.zip(&mut **two).for_each(|((row, residual), two)| {
                *two = self.change(row, |row| one[row], residual, Some(factors));
            }),
            Stage::Third(factors) => rows.zip(&mut **x).for_each(|((row, residual), x)| {
                let three = self.change(row, |row| two[row], residual, factors);
                *x = sum([x, &one[row], &two[row], &three]);
            }),
            Stage::Product => {
                let Some(product) = product else { return };
                rows.zip(&mut **product)
                    .for_each(|((row, _), product)| *product = self.matrix.row_times(row, |row| x[row]));
            }
        }
    }

    /// Runs a stage at some rows. `vectors` also have the rows that these read.
    fn at(&self, stage: Stage, rows: Range<usize>, vectors: &mut Rows<'_, L>) {
        let Rows { first, x, residual, changes: [one, two], product } = vectors;
        let first = *first;
        match stage {
            Stage::Start(factor) => {
                for row in rows {
                    x[row - first] = self.start(row, factor);
                }
            }
            Stage::First(factors) => {
                for row in rows {
                    let n = row - first;
                    residual[n] = self.right[row];
                    one[n] = self.change(row, |row| x[row - first], &mut residual[n], Some(factors));
                }
            }
            Stage::Second(factors) => {
                for row in rows {
                    let n = row - first;
                    two[n] = self.change(row, |row| one[row - first], &mut residual[n], Some(factors));
                }
            }
            Stage::Third(factors) => {
                for row in rows {
                    let n = row - first;
                    let three = self.change(row, |row| two[row - first], &mut residual[n], factors);
                    x[n] = sum([&x[n], &one[n], &two[n], &three]);
                }
            }
            Stage::Product => {
                let Some(product) = product else { return };
                for row in rows {
                    product[row - first] = self.matrix.row_times(row, |row| x[row - first]);
                }
            }
        }
    }

    #[inline(always)]
    fn start(&self, row: usize, factor: f32) -> [f32; L] {
        times(&self.inverse[row], &self.right[row]).map(|x| factor * x)
    }

    /// Subtracts the product with the change before from the residual. Returns the next change.
    #[inline(always)]
    fn change(
        &self,
        row: usize,
        before: impl Fn(usize) -> [f32; L],
        residual: &mut [f32; L],
        factors: Option<Factors>,
    ) -> [f32; L] {
        let product = self.matrix.row_times(row, &before);
        for n in 0..L {
            residual[n] -= product[n];
        }
        let Some((old, new)) = factors else { return [0.0; L] };
        let (before, step) = (before(row), times(&self.inverse[row], residual));
        std::array::from_fn(|n| old * before[n] + new * step[n])
    }
}

/// The sum of some numbers at a row, from the first one on.
#[inline(always)]
fn sum<const L: usize>([a, b, c, d]: [&[f32; L]; 4]) -> [f32; L] {
    std::array::from_fn(|n| a[n] + b[n] + c[n] + d[n])
}
