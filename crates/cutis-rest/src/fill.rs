//! Adding up the matrix of a Newton step.

use std::ops::Range;

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use crate::Body;
use crate::blocks::{Block, divided};
use crate::body::FIXED;
use crate::constraints::{Evaluation, GROUP};
use crate::curvature::{Curvature, Second};
use crate::elements::Elements;
use crate::matrix::Matrix;
use crate::smoother::Operator;
use crate::symmetric::Neighbors;

/// Memory to add up constraints.
#[derive(Default)]
struct Scratch {
    at: Evaluation,
    second: Second,
    /// The scaled gradients of a constraint.
    scaled: Vec<Scaled>,
    /// For each pair of vertices of a constraint, the place of its block in the row where it was
    /// found last. In a lattice the next constraint has it at the same place.
    slots: Vec<usize>,
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
                let add = match elements.kind.arity() {
                    2 => Self::add::<2>,
                    3 => Self::add::<3>,
                    4 => Self::add::<4>,
                    _ => Self::add::<0>,
                };
                add(self, elements, part, x, curvature, scratch, &mut rows, &mut wholes);
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
    /// of the whole rows in double precision. The constraints have `N` vertices each, or any number
    /// if `N` is zero.
    #[expect(clippy::too_many_arguments, reason = "one loop, and what it reads and writes")]
    fn add<const N: usize>(
        &self,
        elements: &Elements,
        part: usize,
        x: &[Point3<f64>],
        curvature: Curvature,
        scratch: &mut Scratch,
        to: &mut Rows<'_>,
        wholes: &mut [Block<3, 3>],
    ) {
        let kind = &*elements.kind;
        let arity = if N > 0 { N } else { kind.arity() };
        let Scratch { at, second, scaled, slots } = scratch;
        scaled.resize(arity, Scaled::default());
        slots.clear();
        slots.resize(arity * arity, 0);
        let counts = |c: f64| match curvature {
            Curvature::All => c != 0.0,
            Curvature::Stretched => elements.curved && c > 0.0,
        };
        let start = to.neighbors.above_rows(to.rows.clone()).start;
        for constraints in elements.of_part(part).chunks(GROUP) {
            at.of::<N>(kind, constraints, x);
            second.of(kind, constraints, at, counts);
            let mut curvatures = second.blocks.chunks_exact(arity * arity);
            let values = at.c.iter().zip(&at.stiffness).zip(at.gradients.chunks_exact(arity));
            for (&k, ((&c, &stiffness), gradients)) in constraints.iter().zip(values) {
                let curvature = if counts(c) { curvatures.next() } else { None };
                let root = stiffness.sqrt();
                let mut all = Vector3::zeros();
                let vertices = &kind.indices()[k as usize * arity..][..arity];
                let scaled = &mut scaled[..arity];
                for (n, scaled) in scaled.iter_mut().enumerate() {
                    let place = self.place[vertices[n] as usize];
                    let gradient = gradients[n] * root;
                    if place != FIXED {
                        all += gradient;
                    }
                    *scaled = Scaled::new(place, gradient);
                }
                for (own, Scaled { place, gradient, rows: left, .. }) in scaled.iter().enumerate() {
                    let row = *place as usize;
                    let Some(whole) = wholes.get_mut(row.wrapping_sub(to.rows.start)) else { continue };
                    add_outer(whole, gradient, &all);
                    let columns = to.neighbors.later(row);
                    let first = to.neighbors.above(row).start - start;
                    for (b, Scaled { place: column, columns: right, .. }) in scaled.iter().enumerate() {
                        let curvature =
                            curvature.filter(|_| *column != FIXED).map(|blocks| &blocks[own * arity + b]);
                        if let Some(curvature) = curvature {
                            add(whole.as_flattened_mut(), c * stiffness, curvature);
                        }
                        if *column == FIXED || *column as usize <= row {
                            continue;
                        }
                        let hint = &mut slots[own * arity + b];
                        if columns.get(*hint) != Some(column) {
                            let smaller = columns.iter().map(|c| u32::from(c < column));
                            *hint = smaller.sum::<u32>() as usize;
                        }
                        let block = &mut to.values[9 * (first + *hint)..][..9];
                        for n in 0..9 {
                            block[n] += left[n] * right[n];
                        }
                        if let Some(curvature) = curvature {
                            add(block, (c * stiffness) as f32, &curvature.map(|x| x as f32));
                        }
                    }
                }
            }
        }
    }
}

/// A gradient times the root of the stiffness of its constraint. The block of two vertices is the
/// outer product of theirs.
#[derive(Clone, Default)]
struct Scaled {
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
