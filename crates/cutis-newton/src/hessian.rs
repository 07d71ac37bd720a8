//! The Hessian of the objective: `(∇C∇Cᵀ + C∇²C)/α` of each constraint, plus the inertia on the
//! diagonal.
//!
//! `∇²C` comes from central differences of the exact gradients, with a step in proportion to the
//! element. Far from a minimum the Hessian may not be positive definite, for example in compressed
//! springs. A fraction of the negative eigenvalues of each element's block is then flipped to
//! positive. Flipping all of them gives their absolute values (Chen et al., *Stabler Neo-Hookean
//! Simulation: Absolute Eigenvalue Filtering for Projected Newton*, SIGGRAPH 2024), and a positive
//! semidefinite sum.

use nalgebra::{DMatrix, Matrix3, Point3, SymmetricEigen, Vector3};
use rayon::prelude::*;

use crate::elements::Elements;
use crate::objective::{Objective, State};
use crate::pattern::Factors;

/// Number of elements whose blocks are computed in parallel before they are summed in order.
const CHUNK: usize = 8192;

/// Writes the Hessian of the objective at `state` to `factors`. `flipped` is the fraction of each
/// element's negative curvature that is flipped: 0 for the plain second derivatives, 1 for the
/// absolute values of the eigenvalues.
pub(crate) fn assemble(
    objective: &Objective<'_>,
    state: &State,
    places: &[u32],
    flipped: f64,
    factors: &mut Factors<'_>,
) {
    factors.values.fill(0.0);
    for elements in &objective.problem.elastic.kinds {
        let n = 3 * elements.arity();
        let mut blocks = vec![0.0; CHUNK.min(elements.len()) * n * n];
        for first in (0..elements.len()).step_by(CHUNK) {
            let count = CHUNK.min(elements.len() - first);
            let blocks = &mut blocks[..count * n * n];
            blocks.par_chunks_mut((n * n).max(1)).enumerate().for_each_init(
                || Workspace::new(elements.arity()),
                |workspace, (k, block)| workspace.hessian(elements, first + k, &state.x, flipped, block),
            );
            for (k, block) in blocks.chunks_exact((n * n).max(1)).enumerate() {
                scatter(elements.vertices(first + k), places, block, factors);
            }
        }
    }
    for &v in &objective.problem.free {
        let inertia = objective.inertia(objective.problem.masses()[v as usize]);
        let place = places[v as usize];
        factors.add(place, place, &(Matrix3::identity() * inertia));
    }
}

/// Adds the blocks of an element for its free vertices.
fn scatter(vertices: &[u32], places: &[u32], block: &[f64], factors: &mut Factors<'_>) {
    let n = 3 * vertices.len();
    for (i, &row) in vertices.iter().enumerate() {
        for (j, &column) in vertices.iter().enumerate() {
            let (row, column) = (places[row as usize], places[column as usize]);
            if row != u32::MAX && column != u32::MAX {
                let part = Matrix3::from_fn(|a, b| block[(3 * j + b) * n + 3 * i + a]);
                factors.add(row, column, &part);
            }
        }
    }
}

/// Buffers for one element.
struct Workspace {
    places: Vec<Point3<f64>>,
    gradient: Vec<Vector3<f64>>,
    ahead: Vec<Vector3<f64>>,
    behind: Vec<Vector3<f64>>,
}

impl Workspace {
    fn new(arity: usize) -> Self {
        let zeros = vec![Vector3::zeros(); arity];
        Self {
            places: vec![Point3::origin(); arity],
            gradient: zeros.clone(),
            ahead: zeros.clone(),
            behind: zeros,
        }
    }

    /// Writes `(∇C∇Cᵀ + C∇²C)/α` of element `k` to `block`, column by column.
    fn hessian(&mut self, elements: &Elements, k: usize, x: &[Point3<f64>], flipped: f64, block: &mut [f64]) {
        elements.gather(k, x, &mut self.places);
        let c = elements.evaluate_one(k, &self.places, &mut self.gradient);
        let n = 3 * self.places.len();
        let compliance = elements.compliance(k);
        let step = f64::EPSILON.cbrt() * extent(&self.places, c, &self.gradient);
        for column in 0..n {
            let own = self.gradient[column / 3][column % 3];
            for row in 0..n {
                block[column * n + row] = own * self.gradient[row / 3][row % 3] / compliance;
            }
            if step > 0.0 && c != 0.0 {
                let place = self.places[column / 3][column % 3];
                let (high, low) = (place + step, place - step);
                self.places[column / 3][column % 3] = high;
                elements.evaluate_one(k, &self.places, &mut self.ahead);
                self.places[column / 3][column % 3] = low;
                elements.evaluate_one(k, &self.places, &mut self.behind);
                self.places[column / 3][column % 3] = place;
                let factor = c / compliance / (high - low);
                for row in 0..n {
                    block[column * n + row] +=
                        (self.ahead[row / 3][row % 3] - self.behind[row / 3][row % 3]) * factor;
                }
            }
        }
        for column in 0..n {
            for row in 0..column {
                let mean = 0.5 * (block[column * n + row] + block[row * n + column]);
                block[column * n + row] = mean;
                block[row * n + column] = mean;
            }
        }
        if flipped > 0.0 {
            let eigen = SymmetricEigen::new(DMatrix::from_column_slice(n, n, block));
            let values = eigen.eigenvalues.map(|value| value + flipped * (value.abs() - value));
            let scaled = &eigen.eigenvectors * DMatrix::from_diagonal(&values);
            block.copy_from_slice((scaled * eigen.eigenvectors.transpose()).as_slice());
        }
    }
}

/// Returns the size of an element in m: the largest distance of a vertex from the first one. For a
/// constraint on one vertex, it is the distance at which the constraint is met. Zero if there is no
/// size.
pub(crate) fn extent(points: &[Point3<f64>], c: f64, gradients: &[Vector3<f64>]) -> f64 {
    match (points, gradients) {
        ([_], [gradient]) if gradient.norm() > 0.0 => c.abs() / gradient.norm(),
        ([first, rest @ ..], _) => rest.iter().map(|point| (point - first).norm()).fold(0.0, f64::max),
        ([], _) => 0.0,
    }
}
