//! Chebyshev smoothing.

use nalgebra::{Cholesky, SMatrix};
use rayon::prelude::*;

use crate::blocks::{Block, ROWS};
use crate::fronts::Fronts;
use crate::symmetric::Above;
use crate::vectors::{Vector, dot};

/// Matrix products of a smoother.
const PRODUCTS: usize = 3;
/// The smoother reduces errors in the upper part of the spectrum, down to this share of its end.
const SPECTRUM: f32 = 0.08;
/// Steps of the estimate of the largest eigenvalue, from noise and from an earlier estimate.
const POWER_STEPS: [usize; 2] = [12, 3];

/// A matrix with one row of blocks per node.
pub(crate) trait Operator<const B: usize, const L: usize>: Sync {
    /// The blocks above the diagonal.
    fn above(&self) -> &Above<B>;
    /// The block of a node on the diagonal.
    fn diagonal(&self, node: usize) -> Block<B, B>;
    /// Gives the columns and blocks of a row to `each`, the one on the diagonal last.
    fn for_each(&self, row: usize, each: impl FnMut(usize, Block<B, B>));
    /// The row of a node times a vector, which `x` has at each node.
    fn row_times(&self, node: usize, x: impl Fn(usize) -> [f32; L]) -> [f32; L];
    /// Number of nodes.
    fn nodes(&self) -> usize {
        self.above().neighbors.count()
    }
    /// Numbers of all blocks, on both sides of the diagonal.
    fn numbers(&self) -> usize {
        B * B * (self.nodes() + 2 * self.above().neighbors.blocks())
    }
    /// The matrix times a vector.
    fn times(&self, x: &[[f32; L]], to: &mut [[f32; L]]) {
        let row = |(node, to): (usize, &mut [f32; L])| *to = self.row_times(node, |node| x[node]);
        to.par_iter_mut().enumerate().with_min_len(ROWS).for_each(row);
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
    changes: [Vector<L>; 2],
    /// The rows that the products take together.
    fronts: Fronts<4>,
}

/// The factors of the changes after three products, for the change before and for the residual.
#[derive(Clone, Copy)]
struct Factors {
    first: [(f32, f32); 2],
    last: Option<(f32, f32)>,
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
            changes: [zero.clone(), zero],
            fronts: Fronts::of(&matrix.above().neighbors, B * B),
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
            let (vector, inverse, next) = (&self.vector, &self.inverse, &mut self.changes[0]);
            let row = |(node, to): (usize, &mut [f32; L])| {
                *to = times(&inverse[node], &matrix.row_times(node, |node| vector[node]));
            };
            next.par_iter_mut().enumerate().with_min_len(ROWS).for_each(row);
            let before = dot(&self.vector, &self.vector).sqrt();
            let after = dot(next, next).sqrt();
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
            self.vector.par_iter_mut().with_min_len(ROWS).zip(&*next).for_each(scaled);
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
        let [(_, first), second, third] = self.factors();
        let rows = x.par_iter_mut().zip(&*residual).zip(&self.inverse).with_min_len(ROWS);
        rows.for_each(|((x, r), inverse)| *x = times(inverse, r).map(|step| first * step));
        let factors = Factors { first: [second, third], last: None };
        self.steps(matrix, None, x, residual, factors, None);
    }

    /// Smooths an approximation `x`. `residual` is memory for the residual. Writes the matrix times
    /// the result to `product`, if there is one.
    pub fn smooth(
        &mut self,
        matrix: &impl Operator<B, L>,
        right: &[[f32; L]],
        x: &mut [[f32; L]],
        residual: &mut [[f32; L]],
        product: Option<&mut [[f32; L]]>,
    ) {
        let [first, second, third] = self.factors();
        let factors = Factors { first: [first, second], last: Some(third) };
        self.steps(matrix, Some(right), x, residual, factors, product);
    }

    /// Three products with the matrix, and a change of `x` after each of the first two, and also
    /// after the third one if there are factors for it. The first product is that with `x`, and the
    /// others are those with the changes. A change is a multiple of the change before, or of `x`,
    /// plus a multiple of the inverse blocks times the residual. `right` is the right-hand side.
    /// Without it, `residual` has it. The fourth product is that with the last `x`.
    ///
    /// All products move through the rows together, see [`Fronts`].
    fn steps(
        &mut self,
        matrix: &impl Operator<B, L>,
        right: Option<&[[f32; L]]>,
        x: &mut [[f32; L]],
        residual: &mut [[f32; L]],
        Factors { first: factors, last }: Factors,
        mut product: Option<&mut [[f32; L]]>,
    ) {
        let Self { inverse, changes: [first, second], fronts, .. } = self;
        let rows = fronts.rows;
        let step = |node: usize, from: &[f32; L], r: &[f32; L], (old, new): (f32, f32)| {
            let step = times(&inverse[node], r);
            std::array::from_fn::<f32, L, _>(|n| old * from[n] + new * step[n])
        };
        for [a, b, c, d] in &fronts.fronts {
            // The fourth product reads `x` where the third one has finished, and the first one
            // reads it where the third one has not begun.
            let (x_done, x_rest) = x.split_at_mut(c.start);
            let (x_c, x_ahead) = x_rest.split_at_mut(c.len());
            let (first_done, first_rest) = first.split_at_mut(a.start);
            let (second_done, second_rest) = second.split_at_mut(b.start);
            let (r_done, r_a) = residual.split_at_mut(a.start);
            let (r_done, r_b) = r_done.split_at_mut(b.start);
            let r_c = &mut r_done[c.clone()];
            let r_b = &mut r_b[..b.len()];
            let first_stage = || {
                let of_rows = first_rest[..a.len()].par_iter_mut().zip(&mut r_a[..a.len()]).enumerate();
                of_rows.with_min_len(rows).for_each(|(n, (change, r))| {
                    let node = a.start + n;
                    let product = matrix.row_times(node, |node| x_ahead[node - c.end]);
                    let before = right.map_or(*r, |right| right[node]);
                    *r = std::array::from_fn(|n| before[n] - product[n]);
                    *change = step(node, &x_ahead[node - c.end], r, factors[0]);
                });
            };
            let second_stage = || {
                let of_rows = second_rest[..b.len()].par_iter_mut().zip(r_b).enumerate();
                of_rows.with_min_len(rows).for_each(|(n, (change, r))| {
                    let node = b.start + n;
                    let product = matrix.row_times(node, |node| first_done[node]);
                    *r = std::array::from_fn(|n| r[n] - product[n]);
                    *change = step(node, &first_done[node], r, factors[1]);
                });
            };
            let third_stage = || {
                let of_rows = x_c.par_iter_mut().zip(r_c).enumerate();
                of_rows.with_min_len(rows).for_each(|(n, (x, r))| {
                    let node = c.start + n;
                    let product = matrix.row_times(node, |node| second_done[node]);
                    *r = std::array::from_fn(|n| r[n] - product[n]);
                    let last = last.map(|factors| step(node, &second_done[node], r, factors));
                    for n in 0..L {
                        x[n] = x[n] + first_done[node][n] + second_done[node][n];
                        x[n] += last.map_or(0.0, |last| last[n]);
                    }
                });
            };
            let fourth_stage = || {
                let Some(product) = &mut product else { return };
                let of_rows = product[d.clone()].par_iter_mut().enumerate().with_min_len(rows);
                of_rows.for_each(|(n, to)| *to = matrix.row_times(d.start + n, |node| x_done[node]));
            };
            rayon::join(|| rayon::join(first_stage, second_stage), || rayon::join(third_stage, fourth_stage));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symmetric::{Rows, Symmetric};

    /// A symmetric band, in which each node has some neighbors on both sides.
    fn band(count: usize) -> Symmetric<6, 8> {
        let rows = Rows::of(0..count, count, |sums, row| {
            for column in row..(row + 7).min(count) {
                let strength = if row == column { 20.0 } else { f64::from(noise(7 * row + column)) };
                for n in 0..6 {
                    sums.at(column)[n][n] += strength + n as f64 / 8.0;
                    sums.at(column)[n][5 - n] += strength / 4.0;
                }
            }
        });
        rows.into()
    }

    /// Products that go through the rows together give the bits of products one after the other.
    #[test]
    fn products_together_give_the_bits_of_single_ones() {
        let matrix = band(60_000);
        let vector = |seed: usize| -> Vector<8> {
            let number = |node: usize, n: usize| if n < 6 { noise(seed + 6 * node + n) } else { 0.0 };
            (0..60_000).map(|node| std::array::from_fn(|n| number(node, n))).collect()
        };
        let mut smoother = Smoother::<6, 8>::new(&matrix);
        assert!(smoother.fronts.fronts.len() > 5, "{}", smoother.fronts.fronts.len());
        let (right, start) = (vector(0), vector(1_000_000));
        let times = |x: &Vector<8>| {
            let mut product = start.clone();
            matrix.times(x, &mut product);
            product
        };
        let minus = |a: &Vector<8>, b: &Vector<8>| -> Vector<8> {
            a.iter().zip(b).map(|(a, b)| std::array::from_fn(|n| a[n] - b[n])).collect()
        };
        let (mut x, mut change, mut r) = (start.clone(), start.clone(), right.clone());
        for (old, new) in smoother.factors() {
            r = minus(&r, &times(&change));
            for (node, change) in change.iter_mut().enumerate() {
                let step = super::times(&smoother.inverse[node], &r[node]);
                *change = std::array::from_fn(|n| old * change[n] + new * step[n]);
                x[node] = std::array::from_fn(|n| x[node][n] + change[n]);
            }
        }
        let (mut found, mut residual, mut product) = (start.clone(), start.clone(), start.clone());
        smoother.smooth(&matrix, &right, &mut found, &mut residual, Some(&mut product));
        assert!(found == x && residual == r && product == times(&x));
        assert!(product != times(&start), "control");

        // From zero the residual comes out.
        let mut residual = right.clone();
        smoother.start(&matrix, &mut found, &mut residual);
        let exact = minus(&right, &times(&found));
        let largest = |x: &Vector<8>| x.as_flattened().iter().fold(0.0, |most: f32, x| most.max(x.abs()));
        assert!(largest(&minus(&exact, &residual)) < 1e-5 * largest(&right));
    }
}
