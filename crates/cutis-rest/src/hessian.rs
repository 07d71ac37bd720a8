//! The matrix of a Newton step, row by row of vertices.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use crate::Body;
use crate::blocks::{Blocks, ROWS, Sums};
use crate::body::{Elements, FIXED};
use crate::energy::State;

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
    /// `Σ (∇C∇Cᵀ + C∇²C)/α`, with the second term of some constraints.
    pub(crate) fn matrix(&self, state: &State, curvature: Curvature) -> Blocks<f64, 3, 3> {
        let row = |work: &mut Work, &vertex: &u32| {
            for (n, elements) in self.kinds.iter().enumerate() {
                let arity = elements.kind.arity();
                for &at in elements.incidence.of(vertex) {
                    let (k, own) = (at as usize / arity, at as usize % arity);
                    let gradients = &state.gradients[n][k * arity..][..arity];
                    let (c, stiffness) = (state.values[n][k], elements.stiffness(k));
                    work.curvature.clear();
                    let counts = match curvature {
                        Curvature::All => c != 0.0,
                        Curvature::Stretched => elements.curved && c > 0.0,
                    };
                    if counts {
                        work.gather(elements, k, &state.x);
                        work.differentiate(elements, k, own);
                    }
                    let left = gradients[own] * stiffness;
                    for (b, &other) in elements.vertices(k).iter().enumerate() {
                        let column = self.place[other as usize];
                        if column == FIXED {
                            continue;
                        }
                        let mut block = left * gradients[b].transpose();
                        if let Some(curvature) = work.curvature.get(b) {
                            block += curvature * (c * stiffness);
                        }
                        work.sums.add(column as usize, block);
                    }
                }
            }
            work.sums.take()
        };
        let rows = self.free.par_iter().with_min_len(ROWS).map_init(|| Work::new(self.free.len()), row);
        Blocks::from_rows(rows.collect(), self.free.len())
    }
}

/// Memory for the rows of a thread.
struct Work {
    sums: Sums<f64, 3, 3>,
    places: Vec<Point3<f64>>,
    ahead: Vec<Vector3<f64>>,
    behind: Vec<Vector3<f64>>,
    /// `∂²C/∂x_own∂x_b` for each vertex `b`. Empty if it does not count.
    curvature: Vec<Matrix3<f64>>,
}

impl Work {
    fn new(width: usize) -> Self {
        let (sums, places) = (Sums::new(width), Vec::new());
        Self { sums, places, ahead: Vec::new(), behind: Vec::new(), curvature: Vec::new() }
    }

    fn gather(&mut self, elements: &Elements, k: usize, x: &[Point3<f64>]) {
        self.places.clear();
        self.places.extend(elements.vertices(k).iter().map(|&v| x[v as usize]));
        self.ahead.resize(self.places.len(), Vector3::zeros());
        self.behind.resize(self.places.len(), Vector3::zeros());
    }

    /// Central differences of the gradients over the position of one vertex.
    fn differentiate(&mut self, elements: &Elements, k: usize, own: usize) {
        let first = self.places[0];
        let extent = self.places.iter().map(|place| (place - first).norm()).fold(0.0, f64::max);
        let step = f64::EPSILON.cbrt() * extent;
        self.curvature.clear();
        if step.is_nan() || step <= 0.0 {
            return;
        }
        self.curvature.resize(self.places.len(), Matrix3::zeros());
        for axis in 0..3 {
            let place = self.places[own][axis];
            let (high, low) = (place + step, place - step);
            self.places[own][axis] = high;
            elements.kind.evaluate(k, &self.places, &mut self.ahead);
            self.places[own][axis] = low;
            elements.kind.evaluate(k, &self.places, &mut self.behind);
            self.places[own][axis] = place;
            for (curvature, (ahead, behind)) in
                self.curvature.iter_mut().zip(self.ahead.iter().zip(&self.behind))
            {
                let slope = (ahead - behind) / (high - low);
                curvature.row_mut(axis).copy_from(&slope.transpose());
            }
        }
    }
}

/// Whether the value of some constraint of a kind is curved as a function of a single vertex.
/// Lengths are, volumes are not.
pub(crate) fn is_curved(elements: &Elements, x: &[Point3<f64>]) -> bool {
    let mut work = Work::new(0);
    let count = elements.kind.len();
    (0..count).step_by(count.div_ceil(TRIED).max(1)).any(|k| {
        work.gather(elements, k, x);
        let mut gradients = work.ahead.clone();
        elements.kind.evaluate(k, &work.places, &mut gradients);
        let size = gradients.iter().map(Vector3::norm).fold(0.0, f64::max);
        let first = work.places[0];
        let extent = work.places.iter().map(|place| (place - first).norm()).fold(0.0, f64::max);
        (0..work.places.len()).any(|own| {
            work.differentiate(elements, k, own);
            work.curvature.get(own).is_some_and(|curvature| curvature.norm() * extent > 1e-3 * size)
        })
    })
}
