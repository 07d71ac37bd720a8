//! The reference solver: one constraint after the other, in safe scalar code on one thread.

use std::ops::Range;

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{
    Change, ConstraintColor, Execute, Settings, Simulation, Solver, SolverError, StepProfile, System, Timed,
    VertexBlock, VertexColor,
};

/// Runs every pass on the calling thread, in ascending order.
#[derive(Clone, Copy, Debug, Default)]
pub struct Serial;

impl<T: Scalar> Execute<T> for Serial {
    fn vertices(&self, block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync)) {
        pass(block);
    }

    fn project(&self, color: ConstraintColor<'_, T>) {
        color.project();
    }

    fn descend(&self, color: VertexColor<'_, T>) {
        color.descend();
    }

    fn find_first(
        &self,
        count: usize,
        find: &(dyn Fn(Range<usize>) -> Option<usize> + Sync),
    ) -> Option<usize> {
        find(0..count)
    }
}

/// The reference for the other backends. In `f64` it defines the accuracy of a result, and in the
/// number type of a backend it defines the bits.
pub struct SolverReference<T: Scalar> {
    simulation: Simulation<T>,
}

impl<T: Scalar> SolverReference<T> {
    /// Builds a solver for `system`.
    ///
    /// # Errors
    /// Returns the errors of [`Simulation::new`].
    pub fn new(system: System<T>, settings: Settings) -> Result<Self, SolverError> {
        Ok(Self { simulation: Simulation::new(system, settings)? })
    }
}

impl<T: Scalar> Solver<T> for SolverReference<T> {
    fn name(&self) -> &'static str {
        "reference"
    }

    fn step(&mut self, frames: usize) -> Result<(), SolverError> {
        self.simulation.run(frames, &Serial)
    }

    fn step_timed(&mut self, frames: usize, profile: &mut StepProfile) -> Result<(), SolverError> {
        self.simulation.run(frames, &Timed::new(Serial, profile))
    }

    fn restore(&mut self, x: &[Point3<T>], v: &[Vector3<T>], frame: u64) -> Result<(), SolverError> {
        self.simulation.restore(x, v, frame)
    }

    fn change(&mut self, change: &Change<T>) -> Result<(), SolverError> {
        self.simulation.change(change)
    }

    fn simulation(&self) -> &Simulation<T> {
        &self.simulation
    }
}
