//! Chebyshev smoothing.

use nalgebra::{Cholesky, SMatrix};
use rayon::prelude::*;

use crate::blocks::{Block, Blocks, Pattern, ROWS};
use crate::vectors::{Vector, add, dot};

/// Matrix products of a smoother.
const PRODUCTS: usize = 3;
/// The smoother reduces errors in the upper part of the spectrum, down to this share of its end.
const SPECTRUM: f32 = 0.08;
/// Steps of the estimate of the largest eigenvalue, from noise and from an earlier estimate.
const POWER_STEPS: [usize; 2] = [12, 3];

/// A matrix with one row of blocks per node.
pub(crate) trait Operator<const B: usize, const L: usize>: Sync {
    /// Where the blocks are.
    fn pattern(&self) -> &Pattern;
    /// A block. On the diagonal it may be less exact than [`diagonal`](Self::diagonal).
    fn block(&self, place: usize) -> Block<B, B>;
    /// The block of a node on the diagonal.
    fn diagonal(&self, node: usize) -> Block<B, B>;
    /// The row of a node times a vector.
    fn row_times(&self, node: usize, x: &[[f32; L]]) -> [f32; L];
    /// Number of nodes.
    fn nodes(&self) -> usize {
        self.pattern().height()
    }
    /// Columns and blocks of a row.
    #[inline]
    fn row(&self, node: usize) -> impl Iterator<Item = (usize, Block<B, B>)> {
        let pattern = self.pattern();
        pattern.places(node).map(|place| (pattern.columns[place] as usize, self.block(place)))
    }
    /// The matrix times a vector.
    fn times(&self, x: &[[f32; L]], to: &mut [[f32; L]]) {
        let row = |(node, to): (usize, &mut [f32; L])| *to = self.row_times(node, x);
        to.par_iter_mut().enumerate().with_min_len(ROWS).for_each(row);
    }
}

impl<const B: usize, const L: usize> Operator<B, L> for Blocks<B, B> {
    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn block(&self, place: usize) -> Block<B, B> {
        Blocks::block(self, place)
    }

    fn diagonal(&self, node: usize) -> Block<B, B> {
        self.pattern.find(node, node).map_or([[0.0; B]; B], |place| Blocks::block(self, place))
    }

    #[inline(always)]
    fn row_times(&self, node: usize, x: &[[f32; L]]) -> [f32; L] {
        Blocks::row_times(self, node, x)
    }
}

/// Chebyshev iteration with the inverses of the diagonal blocks (Adams, Brezina, Hu and Tuminaro,
/// J. Comput. Phys. 188, 2003). It needs no order of the nodes, so that all of them move at once.
pub(crate) struct Smoother<const B: usize, const L: usize> {
    /// Inverse of each diagonal block, column by column.
    inverse: Vec<[[f32; L]; B]>,
    /// Upper bound of the eigenvalues of the matrix times these inverses.
    pub largest: f32,
    /// Approximate eigenvector of the largest eigenvalue.
    vector: Vector<L>,
    /// The change of each unknown, and the next change.
    change: Vector<L>,
    next: Vector<L>,
}

impl<const B: usize, const L: usize> Smoother<B, L> {
    pub fn new(matrix: &impl Operator<B, L>) -> Self {
        let nodes = matrix.nodes();
        let start = |node: usize| std::array::from_fn(|n| if n < B { noise(B * node + n) } else { 0.0 });
        let zero = vec![[0.0; L]; nodes];
        let mut smoother = Self {
            inverse: Vec::new(),
            largest: 1.0,
            vector: (0..nodes).map(start).collect(),
            change: zero.clone(),
            next: zero,
        };
        smoother.invert(matrix);
        smoother.find_largest(matrix, POWER_STEPS[0]);
        smoother
    }

    /// Adapts to another matrix with the same nodes.
    pub fn update(&mut self, matrix: &impl Operator<B, L>) {
        self.invert(matrix);
        self.find_largest(matrix, POWER_STEPS[1]);
    }

    fn invert(&mut self, matrix: &impl Operator<B, L>) {
        let one = |node: usize| {
            let mut single = [[0.0; L]; B];
            for (to, from) in single.iter_mut().zip(&inverse(&matrix.diagonal(node))) {
                for n in 0..B {
                    to[n] = from[n] as f32;
                }
            }
            single
        };
        (0..matrix.nodes()).into_par_iter().with_min_len(ROWS).map(one).collect_into_vec(&mut self.inverse);
    }

    /// Estimates the largest eigenvalue of the matrix times the inverses by the power method.
    fn find_largest(&mut self, matrix: &impl Operator<B, L>, steps: usize) {
        let mut largest: f64 = 1.0;
        for _ in 0..steps {
            let (vector, inverse) = (&self.vector, &self.inverse);
            let row = |(node, to): (usize, &mut [f32; L])| {
                *to = times(&inverse[node], &matrix.row_times(node, vector));
            };
            self.next.par_iter_mut().enumerate().with_min_len(ROWS).for_each(row);
            let before = dot(&self.vector, &self.vector).sqrt();
            let after = dot(&self.next, &self.next).sqrt();
            if !(after > 0.0 && after.is_finite() && before > 0.0) {
                break;
            }
            largest = largest.max(after / before);
            let scale = (1.0 / after) as f32;
            let scaled = |(to, x): (&mut [f32; L], &[f32; L])| {
                for n in 0..L {
                    to[n] = x[n] * scale;
                }
            };
            self.vector.par_iter_mut().with_min_len(ROWS).zip(&self.next).for_each(scaled);
        }
        self.largest = (1.1 * largest) as f32;
    }

    /// Inverse of the diagonal block of a node.
    pub fn inverse(&self, node: usize) -> Block<B, B> {
        let mut block = [[0.0; B]; B];
        for (to, from) in block.iter_mut().zip(&self.inverse[node]) {
            for n in 0..B {
                to[n] = f64::from(from[n]);
            }
        }
        block
    }

    /// The factors of a change, for the change before and for the residual, one pair per step.
    fn factors(&self) -> [(f32, f32); PRODUCTS] {
        let (middle, half) = (0.5 * self.largest * (1.0 + SPECTRUM), 0.5 * self.largest * (1.0 - SPECTRUM));
        let ratio = middle / half;
        let mut factors = [(0.0, 1.0 / middle); PRODUCTS];
        let mut factor = 1.0 / ratio;
        for step in &mut factors[1..] {
            let next = 1.0 / (2.0 * ratio - factor);
            *step = (next * factor, 2.0 * next / half);
            factor = next;
        }
        factors
    }

    /// Smooths from zero. `residual` is the right-hand side before, and the residual of `x` after.
    pub fn start(&mut self, matrix: &impl Operator<B, L>, x: &mut [[f32; L]], residual: &mut [[f32; L]]) {
        let factors = self.factors();
        let Self { inverse, change, next, .. } = self;
        let rows = x.par_iter_mut().zip(&mut *change).zip(&*residual).zip(&*inverse);
        rows.with_min_len(ROWS).for_each(|(((x, change), r), inverse)| {
            let step = times(inverse, r);
            for n in 0..L {
                change[n] = factors[0].1 * step[n];
            }
            *x = *change;
        });
        for n in 1..=PRODUCTS {
            let rows = x.par_iter_mut().zip(&mut *next).zip(&mut *residual).enumerate();
            rows.with_min_len(ROWS).for_each(|(node, ((x, next), r))| {
                let product = matrix.row_times(node, change);
                for n in 0..L {
                    r[n] -= product[n];
                }
                if let Some(&(old, new)) = factors.get(n) {
                    let step = times(&inverse[node], r);
                    for n in 0..L {
                        next[n] = old * change[node][n] + new * step[n];
                        x[n] += next[n];
                    }
                }
            });
            std::mem::swap(change, next);
        }
    }

    /// Smooths an approximation `x`. `residual` is memory for the residual.
    pub fn smooth(
        &mut self,
        matrix: &impl Operator<B, L>,
        right: &[[f32; L]],
        x: &mut [[f32; L]],
        residual: &mut [[f32; L]],
    ) {
        let factors = self.factors();
        let Self { inverse, change, next, .. } = self;
        for (n, (old, new)) in factors.into_iter().enumerate() {
            let from: &[[f32; L]] = if n == 0 { x } else { change };
            let rows = next.par_iter_mut().zip(&mut *residual).enumerate();
            rows.with_min_len(ROWS).for_each(|(node, (next, r))| {
                let product = matrix.row_times(node, from);
                let before = if n == 0 { right[node] } else { *r };
                for n in 0..L {
                    r[n] = before[n] - product[n];
                }
                let step = times(&inverse[node], r);
                for n in 0..L {
                    next[n] = old * from[node][n] + new * step[n];
                }
            });
            std::mem::swap(change, next);
            add(x, 1.0, change);
        }
    }
}

/// A block times a vector.
#[inline(always)]
fn times<const B: usize, const L: usize>(block: &[[f32; L]; B], x: &[f32; L]) -> [f32; L] {
    let mut sum = [0.0; L];
    for column in 0..B {
        for row in 0..L {
            sum[row] += block[column][row] * x[column];
        }
    }
    sum
}

/// The inverse of a symmetric block. Where it has none, that of its diagonal.
fn inverse<const B: usize>(block: &Block<B, B>) -> Block<B, B> {
    if let Some(factor) = Cholesky::new(SMatrix::<f64, B, B>::from(*block)) {
        let inverse = factor.inverse();
        if inverse.iter().all(|x| x.is_finite()) {
            return inverse.into();
        }
    }
    let diagonal = SMatrix::<f64, B, 1>::from_fn(|n, _| block[n][n]);
    let one = |n: usize| if diagonal[n] > 0.0 { 1.0 / diagonal[n] } else { 1.0 };
    std::array::from_fn(|column| std::array::from_fn(|row| if row == column { one(row) } else { 0.0 }))
}

/// A pseudo-random number from −1 to 1.
fn noise(n: usize) -> f32 {
    let mixed = (n as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (((mixed ^ (mixed >> 32)) >> 11) as f64 / 2f64.powi(52) - 1.0) as f32
}
