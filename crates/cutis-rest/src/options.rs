//! Options and results.

use nalgebra::Point3;

/// When a search for rest ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Largest error of the displacement relative to the displacement from the start, as the search
    /// estimates it. From 0 to 1.
    pub error: f64,
    /// Relative force at which a body counts as at rest at the start, and later where the steps
    /// give no estimate of the error. See [`Rest::force`]. From 0 to 1.
    pub force: f64,
    /// Largest number of Newton steps.
    pub most_steps: usize,
    /// Largest number of multigrid cycles in a step.
    pub most_cycles: usize,
}

impl Default for Options {
    /// An error of 0.1 %, a relative force of 1e-10, 100 steps, and 300 cycles per step.
    fn default() -> Self {
        Self { error: 1e-3, force: 1e-10, most_steps: 100, most_cycles: 300 }
    }
}

/// A step of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Relative force before the step, see [`Rest::force`].
    pub force: f64,
    /// Length of the displacement in this step, in m: the root of the mean square over all vertices
    /// that can move.
    pub moved_m: f64,
    /// Multigrid cycles.
    pub cycles: usize,
    /// Length of the step relative to the full Newton step. Zero if the step was taken back.
    pub length: f64,
    /// Estimate of the distance from rest after the step, see [`Rest::error`]. Infinite before it
    /// is known.
    pub error: f64,
}

/// A body at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Rest {
    /// Positions of all vertices in m, in the caller's coordinates.
    pub positions: Vec<Point3<f64>>,
    /// The norm of the forces at the vertices over the norm of the scale. The scale at a vertex is
    /// the sum of the sizes of all forces that act there. Zero in perfect equilibrium, one if no
    /// force is balanced.
    pub force: f64,
    /// Estimate of the distance from the equilibrium over the displacement from the start.
    pub error: f64,
    /// The steps of the search.
    pub steps: Vec<Step>,
    /// `Σ ½C²/α − Σ (m g + load)·x` at the end minus that at the start, in J.
    pub energy_change_j: f64,
    /// Numbers in the matrices of all levels over those of the finest one, in the last step.
    pub complexity: f64,
}
