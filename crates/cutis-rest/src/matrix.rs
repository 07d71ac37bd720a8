//! The matrix of a Newton step.

use std::ops::Range;
use std::sync::Arc;

use cutis_constraints::prefetch;
use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use simba::simd::{SimdValue, WideF32x4};

use crate::Body;
use crate::blocks::{AHEAD, Block, Pattern};
use crate::body::FIXED;
use crate::constraints::{Constraints, Evaluation};
use crate::energy::{PART, Scratch};
use crate::smoother::Operator;

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

/// The matrix of a step in single precision, applied to differences between neighbors.
///
/// The blocks `A_ij` of a row nearly cancel, because a body that moves as a whole has no new
/// forces. Rounding them would act like springs to fixed points. With `S_i = Σ_j A_ij` in double
/// precision, `A x` at a node is `S_i x_i + Σ_j A_ij (x_j − x_i)`. Then rounding is relative to the
/// strain and not to the displacement.
pub(crate) struct Matrix {
    pattern: Arc<Pattern>,
    /// The blocks one after the other, each column by column, and a zero, so that four numbers can
    /// be read at the last column.
    values: Vec<f32>,
    /// `S_i`, with a zero after each column.
    sums: Vec<[[f32; 4]; 3]>,
}

impl Operator<3, 4> for Matrix {
    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn block(&self, place: usize) -> Block<3, 3> {
        let values = &self.values[9 * place..][..9];
        std::array::from_fn(|column| std::array::from_fn(|row| f64::from(values[3 * column + row])))
    }

    fn diagonal(&self, node: usize) -> Block<3, 3> {
        let mut sum = [[0.0; 3]; 3];
        for (to, from) in sum.iter_mut().zip(&self.sums[node]) {
            for n in 0..3 {
                to[n] = f64::from(from[n]);
            }
        }
        for (column, block) in self.row(node) {
            if column != node {
                for (to, from) in sum.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
                    *to -= from;
                }
            }
        }
        sum
    }

    #[inline(always)]
    fn row_times(&self, node: usize, x: impl Fn(usize) -> [f32; 4]) -> [f32; 4] {
        let own = WideF32x4::from(x(node));
        let mut sum = WideF32x4::splat(0.0);
        let places = self.pattern.places(node);
        let neighbors = &self.pattern.columns[places.clone()];
        let mut values = &self.values[9 * places.start..9 * places.end + 1];
        let mut ahead = 9 * places.start + AHEAD;
        for &neighbor in neighbors {
            // The block, and the number after it.
            let Some(block) = values.first_chunk::<10>() else { break };
            values = &values[9..];
            prefetch(&self.values, ahead);
            ahead += 9;
            let difference = columns(WideF32x4::from(x(neighbor as usize)) - own);
            for (column, difference) in difference.into_iter().enumerate() {
                let block: [f32; 4] = std::array::from_fn(|row| block[3 * column + row]);
                sum += WideF32x4::from(block) * difference;
            }
        }
        // Last, because it may be much larger. Coming first, it would round off all others.
        for (column, own) in self.sums[node].iter().zip(columns(own)) {
            sum += WideF32x4::from(*column) * own;
        }
        let [x, y, z, _] = sum.into();
        [x, y, z, 0.0]
    }
}

/// The first three numbers, each in all lanes.
#[inline(always)]
fn columns(x: WideF32x4) -> [WideF32x4; 3] {
    let x: [f32; 4] = x.into();
    std::array::from_fn(|n| WideF32x4::splat(x[n]))
}

impl Body {
    /// A matrix of zeros with a block for each pair of vertices that share a constraint.
    pub(crate) fn empty_matrix(&self) -> Matrix {
        let count = self.free.len();
        Matrix {
            pattern: self.pattern.clone(),
            values: vec![0.0; 9 * self.pattern.columns.len() + 1],
            sums: vec![[[0.0; 4]; 3]; count],
        }
    }

    /// Writes `Σ (∇C∇Cᵀ + C∇²C)/α`, with the second term of some constraints, at positions `x` of
    /// all vertices. Adds `shift` times the blocks on the diagonal (Levenberg and Marquardt): it
    /// shortens steps, and holds a body that nothing else holds.
    pub(crate) fn fill(&self, matrix: &mut Matrix, x: &[Point3<f64>], curvature: Curvature, shift: f64) {
        let Matrix { pattern, values, sums } = matrix;
        let mut rest = &mut values[..];
        let mut parts = Vec::new();
        for (part, sums) in sums.chunks_mut(PART).enumerate() {
            let rows = part * PART..part * PART + sums.len();
            let count = pattern.starts[rows.end] - pattern.starts[rows.start];
            let (values, after) = rest.split_at_mut(9 * count);
            parts.push((rows, values, sums));
            rest = after;
        }
        let scratch = || (Scratch::default(), Vec::new());
        parts.into_par_iter().for_each_init(scratch, |(scratch, work), (rows, values, sums)| {
            self.rows(rows.clone(), x, curvature, scratch, work);
            for (to, from) in values.iter_mut().zip(work.as_flattened().as_flattened()) {
                *to = *from as f32;
            }
            let start = pattern.starts[rows.start];
            for (row, sum) in rows.zip(sums) {
                let mut whole = [[0.0; 3]; 3];
                let places = pattern.places(row);
                let blocks = &work[places.start - start..places.end - start];
                for (&column, block) in pattern.row(row).iter().zip(blocks) {
                    let factor = if column as usize == row { 1.0 + shift } else { 1.0 };
                    let whole = whole.as_flattened_mut().iter_mut();
                    whole.zip(block.as_flattened()).for_each(|(to, x)| *to += factor * x);
                }
                *sum = whole.map(|[x, y, z]: [f64; 3]| [x as f32, y as f32, z as f32, 0.0]);
            }
        });
    }

    /// The blocks of some rows in double precision, which start a part.
    fn rows(
        &self,
        rows: Range<usize>,
        x: &[Point3<f64>],
        curvature: Curvature,
        scratch: &mut Scratch,
        to: &mut Vec<Block<3, 3>>,
    ) {
        let starts = &self.pattern.starts;
        let start = starts[rows.start];
        to.clear();
        to.resize(starts[rows.end] - start, [[0.0; 3]; 3]);
        for elements in &self.kinds {
            let arity = elements.kind.arity();
            scratch.slots.clear();
            scratch.slots.resize(arity * arity, 0);
            for &k in elements.of_part(rows.start / PART) {
                let k = k as usize;
                let vertices = elements.vertices(k);
                elements.kind.evaluate(k, x, &mut scratch.own);
                let Evaluation { c, stiffness, .. } = scratch.own;
                let counts = match curvature {
                    Curvature::All => c != 0.0,
                    Curvature::Stretched => elements.curved && c > 0.0,
                };
                for (own, &vertex) in vertices.iter().enumerate() {
                    let row = self.place[vertex as usize] as usize;
                    if !rows.contains(&row) {
                        continue;
                    }
                    if counts {
                        scratch.differentiate(&*elements.kind, k, own);
                    }
                    let columns = self.pattern.row(row);
                    let to = &mut to[starts[row] - start..starts[row + 1] - start];
                    let left = scratch.own.gradients[own] * stiffness;
                    for (b, &other) in vertices.iter().enumerate() {
                        let column = self.place[other as usize];
                        if column == FIXED {
                            continue;
                        }
                        let hint = &mut scratch.slots[own * vertices.len() + b];
                        if columns.get(*hint) != Some(&column) {
                            let smaller = columns.iter().map(|&c| u32::from(c < column));
                            *hint = smaller.sum::<u32>() as usize;
                        }
                        let block = &mut to[*hint];
                        add_outer(block, &left, &scratch.own.gradients[b]);
                        if counts {
                            add(block, c * stiffness, &scratch.curvature[b]);
                        }
                    }
                }
            }
        }
    }
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

/// Adds a multiple of a matrix.
#[inline(always)]
fn add(to: &mut Block<3, 3>, factor: f64, matrix: &Matrix3<f64>) {
    for column in 0..3 {
        for row in 0..3 {
            to[column][row] += factor * matrix[(row, column)];
        }
    }
}

impl Scratch {
    /// Forward differences of the gradients over the position of one vertex, after
    /// [`evaluate`](Self::evaluate): `∂²C/∂x_own∂x_b` for each vertex `b`.
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
