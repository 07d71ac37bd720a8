//! Chebyshev smoothing.

use nalgebra::{Cholesky, Point3, SMatrix};
use rayon::prelude::*;

use crate::blocks::{Block, ROWS};
use crate::fronts::Fronts;
use crate::sweep::{Factors, Rows, Stage, Sweep};
use crate::symmetric::Above;
use crate::vectors::{Vector, dot};

/// Matrix products of a smoother.
const PRODUCTS: usize = 3;
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
    /// It reduces errors in the upper part of the spectrum, down to this share of its end.
    spectrum: f32,
    /// Upper bound of the eigenvalues of the matrix times these inverses.
    pub largest: f32,
    /// Approximate eigenvector of the largest eigenvalue.
    vector: Vector<L>,
    /// The change of each unknown, and the next change.
    changes: [Vector<L>; 2],
    /// The order in which the products take the rows.
    fronts: Fronts<4>,
}

impl<const B: usize, const L: usize> Smoother<B, L> {
    /// The nodes of the matrix are at these places, in m. Errors are reduced in the part of the
    /// spectrum from a share `spectrum` of its end on.
    pub fn new(matrix: &impl Operator<B, L>, places: &[Point3<f64>], spectrum: f32) -> Self {
        let nodes = matrix.nodes();
        let start = |node: usize| std::array::from_fn(|n| if n < B { noise(B * node + n) } else { 0.0 });
        let zero = vec![[0.0; L]; nodes];
        let row_bytes = size_of::<f32>() * matrix.numbers() / (2 * nodes.max(1));
        let mut smoother = Self {
            inverse: Vec::new(),
            spectrum,
            largest: 1.0,
            vector: (0..nodes).map(start).collect(),
            changes: [zero.clone(), zero],
            fronts: Fronts::of(&matrix.above().neighbors, places, row_bytes),
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
    pub fn factors(&self) -> [Factors; PRODUCTS] {
        let half = 0.5 * self.largest;
        let (middle, half) = (half * (1.0 + self.spectrum), half * (1.0 - self.spectrum));
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

    /// Smooths from zero. Writes the result to `x`, and its residual.
    pub fn start(
        &mut self,
        matrix: &impl Operator<B, L>,
        right: &[[f32; L]],
        x: &mut [[f32; L]],
        residual: &mut [[f32; L]],
    ) {
        let [(_, first), second, third] = self.factors();
        let stages = [Stage::Start(first), Stage::First(second), Stage::Second(third), Stage::Third(None)];
        self.run(matrix, stages, right, [x, residual], None);
    }

    /// Smooths an approximation `x`. `residual` is memory. Writes the matrix times the result to
    /// `product`, if there is one.
    pub fn smooth(
        &mut self,
        matrix: &impl Operator<B, L>,
        right: &[[f32; L]],
        x: &mut [[f32; L]],
        residual: &mut [[f32; L]],
        product: Option<&mut [[f32; L]]>,
    ) {
        let [first, second, third] = self.factors();
        let stages = [Stage::First(first), Stage::Second(second), Stage::Third(Some(third)), Stage::Product];
        self.run(matrix, stages, right, [x, residual], product);
    }

    /// Runs the stages at all rows.
    fn run(
        &mut self,
        matrix: &impl Operator<B, L>,
        stages: [Stage; 4],
        right: &[[f32; L]],
        [x, residual]: [&mut [[f32; L]]; 2],
        product: Option<&mut [[f32; L]]>,
    ) {
        let Self { inverse, changes: [one, two], fronts, .. } = self;
        let vectors = Rows { first: 0, x, residual, changes: [one, two], product };
        Sweep { matrix, inverse, right, stages }.run(fronts, vectors);
    }
}

/// A block times a vector.
#[inline(always)]
pub(crate) fn times<const B: usize, const L: usize>(block: &[[f32; L]; B], x: &[f32; L]) -> [f32; L] {
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
    use crate::symmetric::{Symmetric, UpperRows};

    /// A symmetric band, in which each node has some neighbors on both sides.
    fn band(count: usize) -> Symmetric<6, 8> {
        let rows = UpperRows::of(0..count, count, |sums, row| {
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
        let places: Vec<Point3<f64>> = (0..60_000).map(|n| Point3::new(f64::from(n), 0.0, 0.0)).collect();
        let mut smoother = Smoother::<6, 8>::new(&matrix, &places, 0.08);
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
        for together in [true, false] {
            if !together {
                // A small matrix has no domains.
                smoother.fronts = Fronts::of(&matrix.above().neighbors, &places, 1);
            }
            assert_ne!(smoother.fronts.domains().is_empty(), together);
            let (mut found, mut residual, mut product) = (start.clone(), start.clone(), start.clone());
            smoother.smooth(&matrix, &right, &mut found, &mut residual, Some(&mut product));
            assert!(found == x && residual == r && product == times(&x), "{together}");
            assert!(product != times(&start), "control");

            // From zero the residual comes out.
            smoother.start(&matrix, &right, &mut found, &mut residual);
            let exact = minus(&right, &times(&found));
            let largest = |x: &Vector<8>| x.as_flattened().iter().fold(0.0, |most: f32, x| most.max(x.abs()));
            assert!(largest(&minus(&exact, &residual)) < 1e-5 * largest(&right), "{together}");
        }
    }
}
