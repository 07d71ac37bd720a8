//! Conjugate gradients with a preconditioner.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::blocks::ROWS;
use crate::matrix::Matrix;
use crate::multigrid::Multigrid;
use crate::vectors::{PART, Vector, dot, dot_of_part};

/// An approximate solution.
pub(crate) struct Solution {
    pub x: Vec<Vector3<f64>>,
    /// Number of cycles of the preconditioner.
    pub cycles: usize,
    /// Whether a direction was found along which the matrix is not positive.
    pub indefinite: bool,
}

/// Memory of [`solve`], which is used again in each step.
#[derive(Default)]
pub(crate) struct Vectors {
    x: Vector<4>,
    residual: Vector<4>,
    /// The preconditioned residual, and the matrix times it.
    z: Vector<4>,
    z_product: Vector<4>,
    direction: Vector<4>,
    /// The matrix times the direction.
    product: Vector<4>,
}

/// Solves `matrix · x = right` until the residual, in the norm of the preconditioner, is
/// `tolerance` of that at zero, and the way that is still to come, as the last steps suggest, is
/// `tolerance` of the length of `x`. The residual alone says little about the length where some
/// forces are much stiffer than others. Ends early where the matrix is not positive definite.
///
/// The vectors have single precision, which is enough for the tolerances of a Newton step. The
/// product of the matrix and a direction follows from those of the cycles, which have them at hand
/// (Chronopoulos and Gear, J. Comput. Appl. Math. 25, 1989).
pub(crate) fn solve(
    matrix: &Matrix,
    multigrid: &mut Multigrid,
    right: &[Vector3<f64>],
    tolerance: f64,
    most_cycles: usize,
    vectors: &mut Vectors,
) -> Solution {
    let largest = right.par_iter().with_min_len(ROWS).map(Vector3::amax).reduce(|| 0.0, f64::max);
    let Vectors { x, residual, z, z_product, direction, product } = vectors;
    x.clear();
    x.resize(right.len(), [0.0; 4]);
    z.resize(right.len(), [0.0; 4]);
    z_product.resize(right.len(), [0.0; 4]);
    // Single precision has a smaller range of exponents.
    let scaled = |v: &Vector3<f64>| [v.x, v.y, v.z, 0.0].map(|x| (x / largest) as f32);
    right.par_iter().with_min_len(ROWS).map(scaled).collect_into_vec(residual);
    multigrid.cycle(matrix, residual, z, z_product);
    direction.clone_from(z);
    product.clone_from(z_product);
    let mut energy = dot(residual, z);
    let first = energy;
    let mut curvature = dot(direction, product);
    // Of `x`.
    let mut square = 0.0;
    let (mut cycles, mut indefinite) = (1, false);
    let mut steps = Steps::default();
    while cycles < most_cycles
        && energy > 0.0
        && (energy > tolerance * tolerance * first || steps.to_come() > tolerance * f64::sqrt(square))
    {
        if curvature.is_nan() || curvature <= 0.0 {
            indefinite = true;
            break;
        }
        let length = energy / curvature;
        square = move_along(x, residual, length as f32, direction, product);
        multigrid.cycle(matrix, residual, z, z_product);
        cycles += 1;
        let next = dot(residual, z);
        if next.is_nan() || next <= 0.0 {
            break;
        }
        let ratio = (next / energy) as f32;
        energy = next;
        let turn = turn(direction, product, ratio, z, z_product);
        steps.push(length, turn.square, turn.along);
        curvature = turn.curvature;
    }
    let x = if x.par_iter().with_min_len(ROWS).all(|x| *x == [0.0; 4]) { z } else { x };
    let unscaled = |&[x, y, z, _]: &[f32; 4]| Vector3::new(x, y, z).map(|x| f64::from(x) * largest);
    Solution { x: x.par_iter().with_min_len(ROWS).map(unscaled).collect(), cycles, indefinite }
}

/// Adds `length · direction` to `x`, and takes `length · product` from the residual. Returns the
/// square of `x`.
fn move_along(
    x: &mut [[f32; 4]],
    residual: &mut [[f32; 4]],
    length: f32,
    direction: &[[f32; 4]],
    product: &[[f32; 4]],
) -> f64 {
    let parts = x.par_chunks_mut(PART).zip(residual.par_chunks_mut(PART));
    let parts = parts.zip(direction.par_chunks(PART).zip(product.par_chunks(PART)));
    let squares: Vec<f64> = parts
        .map(|((x, residual), (direction, product))| {
            for (to, from) in x.iter_mut().zip(direction) {
                (0..4).for_each(|n| to[n] += length * from[n]);
            }
            for (to, from) in residual.iter_mut().zip(product) {
                (0..4).for_each(|n| to[n] -= length * from[n]);
            }
            dot_of_part(x, x)
        })
        .collect();
    squares.iter().sum()
}

/// Inner products when the direction turns.
#[derive(Clone, Copy, Default)]
struct Turn {
    /// Square of the old direction, and its product with the new one.
    square: f64,
    along: f64,
    /// The new direction times its product with the matrix.
    curvature: f64,
}

/// Replaces a direction by `z + ratio · direction`, and its product with the matrix in the same
/// way.
fn turn(
    direction: &mut [[f32; 4]],
    product: &mut [[f32; 4]],
    ratio: f32,
    z: &[[f32; 4]],
    z_product: &[[f32; 4]],
) -> Turn {
    let parts = direction.par_chunks_mut(PART).zip(product.par_chunks_mut(PART));
    let parts = parts.zip(z.par_chunks(PART).zip(z_product.par_chunks(PART)));
    let turns: Vec<Turn> = parts
        .map(|((direction, product), (z, z_product))| {
            let (mut square, mut along) = ([0.0; 4], [0.0; 4]);
            for (direction, z) in direction.iter_mut().zip(z) {
                for n in 0..4 {
                    let old = direction[n];
                    direction[n] = z[n] + ratio * old;
                    square[n] += f64::from(old) * f64::from(old);
                    along[n] += f64::from(old) * f64::from(direction[n]);
                }
            }
            for (product, z) in product.iter_mut().zip(z_product) {
                (0..4).for_each(|n| product[n] = z[n] + ratio * product[n]);
            }
            let curvature = dot_of_part(direction, product);
            Turn { square: square.iter().sum(), along: along.iter().sum(), curvature }
        })
        .collect();
    turns.iter().fold(Turn::default(), |sum, part| Turn {
        square: sum.square + part.square,
        along: sum.along + part.along,
        curvature: sum.curvature + part.curvature,
    })
}

/// The last steps of an iteration. The length of a single one says little, so they count in pairs.
#[derive(Default)]
struct Steps {
    /// Square of the last step, and its length along the direction of the next one, over the factor
    /// of that one.
    last: Option<(f64, f64)>,
    /// Lengths of the last pairs, the latest at the end.
    pairs: Vec<f64>,
}

impl Steps {
    /// Adds the step `length · d`, with the square of `d` and its product with the next direction.
    fn push(&mut self, length: f64, square: f64, along: f64) {
        let step = length * length * square;
        if let Some((before, product)) = self.last {
            self.pairs.push((step + before + 2.0 * length * product).max(0.0).sqrt());
        }
        self.last = Some((step, length * along));
    }

    /// Estimate of the length of all steps after these: pairs shrink by a constant ratio.
    fn to_come(&self) -> f64 {
        let [.., before, _, last] = self.pairs[..] else { return f64::INFINITY };
        let ratio = (last / before).max(0.5);
        if ratio < 1.0 { last * ratio / (1.0 - ratio) } else { f64::INFINITY }
    }
}
