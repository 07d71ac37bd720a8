//! Equations on the host.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::RestError;
use crate::blocks::ROWS;
use crate::conjugate::{Advance, Begin, Equations, Turn};
use crate::matrix::Matrix;
use crate::multigrid::Multigrid;
use crate::vectors::{PART, Vector, dot, dot_of_part};

/// Memory of the vectors, which is used again in each step of a search.
#[derive(Default)]
pub(crate) struct Vectors {
    x: Vector<4>,
    residual: Vector<4>,
    /// The preconditioned residual, and the matrix times it.
    pub z: Vector<4>,
    z_product: Vector<4>,
    direction: Vector<4>,
    /// The matrix times the direction.
    product: Vector<4>,
}

/// A matrix with a multigrid cycle as preconditioner.
pub(crate) struct HostEquations<'a> {
    pub matrix: &'a Matrix,
    pub multigrid: &'a mut Multigrid,
    pub vectors: &'a mut Vectors,
}

impl Equations for HostEquations<'_> {
    fn begin(&mut self, right: &[Vector3<f64>], largest: f64) -> Result<Begin, RestError> {
        let Vectors { x, residual, z, z_product, direction, product } = self.vectors;
        x.clear();
        x.resize(right.len(), [0.0; 4]);
        z.resize(right.len(), [0.0; 4]);
        z_product.resize(right.len(), [0.0; 4]);
        let scaled = |v: &Vector3<f64>| scaled(v, largest);
        right.par_iter().with_min_len(ROWS).map(scaled).collect_into_vec(residual);
        self.multigrid.cycle(self.matrix, residual, z, z_product);
        direction.clone_from(z);
        product.clone_from(z_product);
        Ok(Begin { energy: dot(residual, z), curvature: dot(direction, product) })
    }

    fn advance(&mut self, length: f32) -> Result<Advance, RestError> {
        let Vectors { x, residual, z, z_product, direction, product } = self.vectors;
        let square = move_along(x, residual, length, direction, product);
        self.multigrid.cycle(self.matrix, residual, z, z_product);
        Ok(Advance { square, energy: dot(residual, z) })
    }

    fn turn(&mut self, ratio: f32) -> Result<Turn, RestError> {
        let Vectors { z, z_product, direction, product, .. } = self.vectors;
        Ok(turn(direction, product, ratio, z, z_product))
    }

    fn end(&mut self, length: f32, largest: f64) -> Result<Vec<Vector3<f64>>, RestError> {
        let Vectors { x, direction, .. } = &*self.vectors;
        let moved = |(x, direction): (&[f32; 4], &[f32; 4])| {
            unscaled(&std::array::from_fn(|n| x[n] + length * direction[n]), largest)
        };
        Ok(x.par_iter().zip(direction).with_min_len(ROWS).map(moved).collect())
    }
}

/// The numbers of a node for a vector over `largest`.
pub(crate) fn scaled(v: &Vector3<f64>, largest: f64) -> [f32; 4] {
    [v.x, v.y, v.z, 0.0].map(|x| (x / largest) as f32)
}

/// The numbers of a node times `largest`.
pub(crate) fn unscaled(&[x, y, z, _]: &[f32; 4], largest: f64) -> Vector3<f64> {
    Vector3::new(x, y, z).map(|x| f64::from(x) * largest)
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
