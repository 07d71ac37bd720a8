//! Second derivatives of constraints.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::constraints::{Constraints, Evaluation};

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

/// Second derivatives of some constraints of one kind.
#[derive(Default)]
pub(crate) struct Second {
    /// `∂²C/∂x_a∂x_b` for each vertex `a` and each vertex `b`, one constraint after the other.
    pub blocks: Vec<Matrix3<f64>>,
    /// The constraints, each one once for every coordinate, and what they are there.
    constraints: Vec<u32>,
    moved: Evaluation,
    /// One over the step along each coordinate. Zero where there is none.
    scales: Vec<f64>,
}

impl Second {
    /// Differentiates those constraints for which `counts` holds for `C`, after they were
    /// evaluated: forward differences of the gradients over each coordinate of each vertex.
    pub fn of(
        &mut self,
        kind: &dyn Constraints,
        constraints: &[u32],
        at: &Evaluation,
        counts: impl Fn(f64) -> bool,
    ) {
        let arity = kind.arity();
        self.blocks.clear();
        self.constraints.clear();
        self.moved.places.clear();
        self.scales.clear();
        for ((&k, &c), places) in constraints.iter().zip(&at.c).zip(at.places.chunks_exact(arity)) {
            if counts(c) {
                self.move_each(k, places);
            }
        }
        if self.constraints.is_empty() {
            return;
        }
        self.moved.of_places(kind, &self.constraints);
        let mut moved = self.moved.gradients.chunks_exact(arity).zip(&self.scales);
        for (&c, gradients) in at.c.iter().zip(at.gradients.chunks_exact(arity)) {
            if !counts(c) {
                continue;
            }
            for _ in 0..arity {
                let first = self.blocks.len();
                self.blocks.resize(first + arity, Matrix3::zeros());
                for (axis, (ahead, &scale)) in moved.by_ref().take(3).enumerate() {
                    let pairs = ahead.iter().zip(gradients);
                    for (block, (ahead, at)) in self.blocks[first..].iter_mut().zip(pairs) {
                        for column in 0..3 {
                            block[(axis, column)] = (ahead[column] - at[column]) * scale;
                        }
                    }
                }
            }
        }
    }

    /// Appends a constraint with its vertices at these places, moved along each coordinate.
    fn move_each(&mut self, k: u32, places: &[Point3<f64>]) {
        let first = places[0];
        let extent = places.iter().map(|place| (place - first).norm_squared()).fold(0.0, f64::max).sqrt();
        let step = f64::EPSILON.sqrt() * extent;
        for own in 0..places.len() {
            for axis in 0..3 {
                let start = self.moved.places.len();
                self.moved.places.extend_from_slice(places);
                let place = &mut self.moved.places[start + own][axis];
                let before = *place;
                *place += step;
                let moved = *place - before;
                self.constraints.push(k);
                self.scales.push(if moved > 0.0 { 1.0 / moved } else { 0.0 });
            }
        }
    }
}

/// Whether the value of some constraint of a kind is curved as a function of a single vertex.
/// Lengths are, volumes are not.
pub(crate) fn is_curved(kind: &dyn Constraints, x: &[Point3<f64>]) -> bool {
    let (arity, count) = (kind.arity(), kind.len() as u32);
    let tried: Vec<u32> = (0..count).step_by(kind.len().div_ceil(TRIED).max(1)).collect();
    let (mut at, mut second) = (Evaluation::default(), Second::default());
    at.of::<0>(kind, &tried, x);
    second.of(kind, &tried, &at, |_| true);
    let corners = at.places.chunks_exact(arity).zip(at.gradients.chunks_exact(arity));
    corners.zip(second.blocks.chunks_exact(arity * arity)).any(|((places, gradients), blocks)| {
        let size = gradients.iter().map(Vector3::norm).fold(0.0, f64::max);
        let extent = places.iter().map(|place| (place - places[0]).norm()).fold(0.0, f64::max);
        (0..arity).any(|own| blocks[own * arity + own].norm() * extent > 1e-3 * size)
    })
}
