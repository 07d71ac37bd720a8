//! Adding up the matrix of a Newton step.

use std::ops::Range;

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use crate::Body;
use crate::blocks::{Block, divided};
use crate::body::FIXED;
use crate::constraints::{Constraints, Evaluation};
use crate::elements::Elements;
use crate::energy::Scratch;
use crate::matrix::Matrix;
use crate::smoother::Operator;
use crate::symmetric::Neighbors;

/// Constraints of a kind that are tried for curvature.
const TRIED: usize = 16;

/// The constraints whose second derivatives count.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Curvature {
    /// All of them: the exact second derivatives of the energy.
    All,
    /// Stretched constraints of kinds that are curved in a single vertex, such as lengths. The
    /// matrix is then semidefinite for all kinds of this project.
    Stretched,
}

impl Body {
    /// Writes `Σ (∇C∇Cᵀ + C∇²C)/α`, with the second term of some constraints, at positions `x` of
    /// all vertices. Adds `shift` times the blocks on the diagonal (Levenberg and Marquardt): it
    /// shortens steps, and holds a body that nothing else holds.
    pub(crate) fn fill(&self, matrix: &mut Matrix, x: &[Point3<f64>], curvature: Curvature, shift: f64) {
        let neighbors = &*self.neighbors;
        let Matrix { above, sums } = &mut *matrix;
        let (size, count) = (self.parts.size, sums.len());
        let parts: Vec<Range<usize>> =
            (0..count).step_by(size).map(|start| start..(start + size).min(count)).collect();
        let numbers = |rows: &Range<usize>| 9 * neighbors.above_rows(rows.clone()).len();
        let values = divided(above.values_mut(), parts.iter().map(numbers));
        let parts = parts.into_par_iter().zip(values).zip(sums.par_chunks_mut(size)).enumerate();
        parts.for_each_init(Scratch::default, |scratch, (part, ((rows, values), sums))| {
            let mut rows = Rows { neighbors, rows, values };
            let mut wholes = vec![[[0.0; 3]; 3]; sums.len()];
            rows.values.fill(0.0);
            for elements in &self.kinds {
                self.add(elements, part, x, curvature, scratch, &mut rows, &mut wholes);
            }
            for (sum, whole) in sums.iter_mut().zip(&wholes) {
                *sum = whole.map(|[x, y, z]: [f64; 3]| [x as f32, y as f32, z as f32, 0.0]);
            }
        });
        if shift > 0.0 {
            let shifts: Vec<Block<3, 3>> =
                (0..matrix.sums.len()).into_par_iter().map(|node| matrix.diagonal(node)).collect();
            for (sum, diagonal) in matrix.sums.iter_mut().zip(&shifts) {
                for (sum, diagonal) in sum.iter_mut().zip(diagonal) {
                    for n in 0..3 {
                        sum[n] = (f64::from(sum[n]) + shift * diagonal[n]) as f32;
                    }
                }
            }
        }
    }

    /// Adds the constraints of one kind to the rows of a part above the diagonal, and to the sums
    /// of the whole rows in double precision.
    #[expect(clippy::too_many_arguments, reason = "one loop, and what it reads and writes")]
    fn add(
        &self,
        elements: &Elements,
        part: usize,
        x: &[Point3<f64>],
        curvature: Curvature,
        scratch: &mut Scratch,
        to: &mut Rows<'_>,
        wholes: &mut [Block<3, 3>],
    ) {
        let arity = elements.kind.arity();
        scratch.slots.clear();
        scratch.slots.resize(arity * arity, 0);
        for &k in elements.of_part(part) {
            let k = k as usize;
            elements.kind.evaluate(k, x, &mut scratch.own);
            let Evaluation { c, stiffness, .. } = scratch.own;
            let counts = match curvature {
                Curvature::All => c != 0.0,
                Curvature::Stretched => elements.curved && c > 0.0,
            };
            let root = stiffness.sqrt();
            let mut all = Vector3::zeros();
            scratch.scaled.clear();
            for (gradient, &vertex) in scratch.own.gradients.iter().zip(elements.vertices(k)) {
                let place = self.place[vertex as usize];
                let gradient = gradient * root;
                if place != FIXED {
                    all += gradient;
                }
                scratch.scaled.push(Scaled::new(place, gradient));
            }
            for own in 0..arity {
                let Scaled { place, gradient, rows: left, .. } = scratch.scaled[own];
                let row = place as usize;
                if !to.rows.contains(&row) {
                    continue;
                }
                if counts {
                    scratch.differentiate(&*elements.kind, k, own);
                }
                let whole = &mut wholes[row - to.rows.start];
                add_outer(whole, &gradient, &all);
                let columns = to.neighbors.later(row);
                let start = to.neighbors.above_rows(to.rows.start..row).len();
                for (b, Scaled { place: column, columns: right, .. }) in scratch.scaled.iter().enumerate() {
                    let curved = counts && *column != FIXED;
                    if curved {
                        add(whole.as_flattened_mut(), c * stiffness, &scratch.curvature[b]);
                    }
                    if *column == FIXED || *column as usize <= row {
                        continue;
                    }
                    let hint = &mut scratch.slots[own * arity + b];
                    if columns.get(*hint) != Some(column) {
                        let smaller = columns.iter().map(|c| u32::from(c < column));
                        *hint = smaller.sum::<u32>() as usize;
                    }
                    let block = &mut to.values[9 * (start + *hint)..][..9];
                    for n in 0..9 {
                        block[n] += left[n] * right[n];
                    }
                    if curved {
                        add(block, (c * stiffness) as f32, &scratch.curvature[b].map(|x| x as f32));
                    }
                }
            }
        }
    }
}

/// A gradient times the root of the stiffness of its constraint. The block of two vertices is the
/// outer product of theirs.
pub(crate) struct Scaled {
    /// Place of the vertex, or [`FIXED`].
    place: u32,
    gradient: Vector3<f64>,
    /// The coordinates at the rows and at the columns of a block.
    rows: [f32; 9],
    columns: [f32; 9],
}

impl Scaled {
    fn new(place: u32, gradient: Vector3<f64>) -> Self {
        let [x, y, z] = gradient.map(|x| x as f32).into();
        let (rows, columns) = ([x, y, z, x, y, z, x, y, z], [x, x, x, y, y, y, z, z, z]);
        Self { place, gradient, rows, columns }
    }
}

/// Some rows of a matrix, above the diagonal.
struct Rows<'a> {
    neighbors: &'a Neighbors,
    rows: Range<usize>,
    values: &'a mut [f32],
}

/// Adds `left · rightᵀ`.
#[inline(always)]
fn add_outer(to: &mut Block<3, 3>, left: &Vector3<f64>, right: &Vector3<f64>) {
    for column in 0..3 {
        for row in 0..3 {
            to[column][row] += left[row] * right[column];
        }
    }
}

/// Adds a multiple of a matrix, column by column.
#[inline(always)]
fn add<T: nalgebra::RealField + Copy>(to: &mut [T], factor: T, matrix: &Matrix3<T>) {
    to.iter_mut().zip(matrix.as_slice()).for_each(|(to, &x)| *to += factor * x);
}

impl Scratch {
    /// Forward differences of the gradients over the position of one vertex, after the constraint
    /// was evaluated: `∂²C/∂x_own∂x_b` for each vertex `b`.
    fn differentiate(&mut self, kind: &dyn Constraints, k: usize, own: usize) {
        let Self { own: Evaluation { places, gradients, .. }, ahead, curvature, .. } = self;
        curvature.clear();
        curvature.resize(places.len(), Matrix3::zeros());
        let first = places[0];
        let extent = places.iter().map(|place| (place - first).norm_squared()).fold(0.0, f64::max).sqrt();
        let step = f64::EPSILON.sqrt() * extent;
        if step.is_nan() || step <= 0.0 {
            return;
        }
        ahead.resize(places.len(), Vector3::zeros());
        for axis in 0..3 {
            let place = places[own][axis];
            let moved = place + step;
            places[own][axis] = moved;
            kind.gradients(k, places, ahead);
            places[own][axis] = place;
            let scale = 1.0 / (moved - place);
            for (curvature, (ahead, at)) in curvature.iter_mut().zip(ahead.iter().zip(&*gradients)) {
                for column in 0..3 {
                    curvature[(axis, column)] = (ahead[column] - at[column]) * scale;
                }
            }
        }
    }
}

/// Whether the value of some constraint of a kind is curved as a function of a single vertex.
/// Lengths are, volumes are not.
pub(crate) fn is_curved(kind: &dyn Constraints, x: &[Point3<f64>]) -> bool {
    let mut scratch = Scratch::default();
    let count = kind.len();
    (0..count).step_by(count.div_ceil(TRIED).max(1)).any(|k| {
        kind.evaluate(k, x, &mut scratch.own);
        let Evaluation { places, gradients, .. } = &scratch.own;
        let size = gradients.iter().map(Vector3::norm).fold(0.0, f64::max);
        let extent = places.iter().map(|place| (place - places[0]).norm()).fold(0.0, f64::max);
        (0..kind.arity()).any(|own| {
            scratch.differentiate(kind, k, own);
            scratch.curvature[own].norm() * extent > 1e-3 * size
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::State;
    use crate::springs::block;

    /// The matrix times small displacements is the change of the forces, in all parts of a body. A
    /// shift counts on the diagonal only.
    #[test]
    fn the_matrix_is_the_change_of_the_forces() {
        let body = Body::of(&block(), [0.0; 3]).unwrap();
        assert!(body.parts.count > 3, "{}", body.parts.count);
        let noise = |n: usize| ((n as f64 + 1.0) * 12.9898).sin() * 43758.5453 % 1.0;
        let noises = |n: usize| Vector3::new(noise(3 * n), noise(3 * n + 1), noise(3 * n + 2));
        let mut x = body.start.clone();
        body.free.iter().for_each(|&v| x[v as usize] += noises(v as usize) * 1e-3);
        let steps: Vec<Vector3<f64>> = (0..body.free.len()).map(|n| noises(n + x.len())).collect();
        let at = |factor: f64| body.moved(&body.at(x.clone()), &steps, factor, State::default()).forces;
        let (ahead, behind) = (at(1e-7), at(-1e-7));
        let expected: Vec<Vector3<f64>> = ahead.iter().zip(&behind).map(|(a, b)| (b - a) / 2e-7).collect();
        let mut matrix = body.empty_matrix();
        let single: Vec<[f32; 4]> =
            steps.iter().map(|step| [step.x as f32, step.y as f32, step.z as f32, 0.0]).collect();
        let mut products = [0.0, 0.5].map(|shift| {
            body.fill(&mut matrix, &x, Curvature::All, shift);
            let mut product = single.clone();
            matrix.times(&single, &mut product);
            product
        });
        let error = |product: &[[f32; 4]]| {
            let pairs = product.iter().zip(&expected);
            let square: f64 = pairs
                .map(|(&[x, y, z, _], e)| (Vector3::new(x, y, z).map(f64::from) - e).norm_squared())
                .sum();
            (square / expected.iter().map(Vector3::norm_squared).sum::<f64>()).sqrt()
        };
        assert!(error(&products[0]) < 1e-5, "{:e}", error(&products[0]));
        assert!(error(&products[1]) > 0.1, "{:e}", error(&products[1]));
        for (node, (product, step)) in products[1].iter_mut().zip(&steps).enumerate() {
            // The diagonal has the shift.
            let block = matrix.diagonal(node);
            let own = Matrix3::from(block) * step * (0.5 / 1.5);
            (0..3).for_each(|n| product[n] -= own[n] as f32);
        }
        assert!(error(&products[1]) < 1e-5, "{:e}", error(&products[1]));
    }
}
