//! The products of a smoother, in one pass through the rows.

use std::ops::Range;

use rayon::prelude::*;

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

    /// What a stage reads and writes. None if it has nothing to write.
    fn parts(&mut self, stage: Stage) -> Option<Parts<'_, L>> {
        let Self { x, residual, changes: [one, two], product, .. } = self;
        let (before, one, to): (&[_], &[_], &mut [_]) = match stage {
            Stage::Start(_) => (one, two, &mut **x),
            Stage::First(_) => (x, two, &mut **one),
            Stage::Second(_) => (one, x, &mut **two),
            Stage::Third(_) => (two, one, &mut **x),
            Stage::Product => (x, one, product.as_deref_mut()?),
        };
        Some(Parts { before, one, residual, to })
    }
}

/// What a stage reads at its rows and their neighbors, the first change, and what it writes.
struct Parts<'a, const L: usize> {
    before: &'a [[f32; L]],
    one: &'a [[f32; L]],
    residual: &'a mut [[f32; L]],
    to: &'a mut [[f32; L]],
}

/// Some parts of a vector, whose rows are ascending.
fn chosen<'a, T>(mut rest: &'a mut [T], rows: &[Range<usize>]) -> Vec<&'a mut [T]> {
    let mut first = 0;
    let mut parts = Vec::with_capacity(rows.len());
    for rows in rows {
        let (part, after) = rest.split_at_mut(rows.start - first).1.split_at_mut(rows.len());
        parts.push(part);
        (rest, first) = (after, rows.end);
    }
    parts
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
    /// Runs all stages at all rows.
    pub fn run(&self, fronts: &Fronts<4>, mut vectors: Rows<'_, L>) {
        let mut rest = vectors.again();
        let mut parts = Vec::with_capacity(fronts.domains().len());
        for domain in fronts.domains() {
            let (own, after) = rest.split(domain.rows.start).1.split(domain.rows.end);
            parts.push((domain, own));
            rest = after;
        }
        parts.into_par_iter().for_each(|(domain, mut own)| {
            let first = own.first;
            for (stage, rows) in &domain.steps {
                let stage = self.stages[*stage];
                let Some(Parts { before, one, residual, to }) = own.parts(stage) else { continue };
                let own = rows.start - first..rows.end - first;
                let (residual, to) = (&mut residual[own.clone()], &mut to[own]);
                self.at(stage, rows.clone(), first, Parts { before, one, residual, to });
            }
        });
        for (number, &stage) in self.stages.iter().enumerate() {
            let Some(Parts { before, one, residual, to }) = vectors.parts(stage) else { continue };
            let rows = fronts.rest(number);
            let parts = chosen(residual, rows).into_par_iter().zip(chosen(to, rows)).zip(rows);
            parts.for_each(|((residual, to), rows)| {
                self.at(stage, rows.clone(), 0, Parts { before, one, residual, to });
            });
        }
    }

    /// Runs a stage at some rows. What it reads begins at the row `first`, and what it writes at
    /// the first one of `rows`.
    fn at(&self, stage: Stage, rows: Range<usize>, first: usize, parts: Parts<'_, L>) {
        let Parts { before, one, residual, to } = parts;
        let before = |row: usize| before[row - first];
        let rows = rows.zip(residual).zip(to);
        match stage {
            Stage::Start(factor) => rows.for_each(|((row, _), to)| *to = self.start(row, factor)),
            Stage::First(factors) => rows.for_each(|((row, residual), to)| {
                *residual = self.right[row];
                *to = self.change(row, before, residual, Some(factors));
            }),
            Stage::Second(factors) => rows.for_each(|((row, residual), to)| {
                *to = self.change(row, before, residual, Some(factors));
            }),
            Stage::Third(factors) => rows.for_each(|((row, residual), to)| {
                let three = self.change(row, before, residual, factors);
                *to = sum([to, &one[row - first], &before(row), &three]);
            }),
            Stage::Product => rows.for_each(|((row, _), to)| *to = self.matrix.row_times(row, before)),
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
