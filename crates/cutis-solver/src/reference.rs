//! The reference solver: one constraint after the other, safe scalar code, no thread.

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{
    ColoredVertices, ConstraintSet, Execute, Settings, Simulation, Solver, SolverError, Step, StepProfile,
    Sweep, System, Timed, Vertex, VertexBlock,
};

/// Runs every pass on the calling thread, in ascending order.
#[derive(Clone, Copy, Debug, Default)]
pub struct Serial;

impl<T: Scalar> Execute<T> for Serial {
    fn vertices(&self, block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync)) {
        pass(block);
    }

    fn sweep(
        &self,
        sweep: Sweep,
        set: &dyn ConstraintSet<T>,
        vertices: &mut [Vertex<T>],
        step: Step<T>,
        multipliers: &mut [T],
    ) {
        let range = sweep.start..sweep.end;
        let multipliers = multipliers.get_mut(range.clone()).unwrap_or_default();
        set.project(range, vertices, step, multipliers);
    }

    fn color_pass(&self, color: ColoredVertices<'_, T>) {
        color.move_one_by_one();
    }

    fn first_not_finite(&self, vertices: &[Vertex<T>]) -> Option<usize> {
        vertices.iter().position(|vertex| !vertex.is_finite())
    }
}

/// The yardstick of the other backends, in `f64`, and their bit-for-bit twin in their own precision.
pub struct SolverReference<T: Scalar> {
    simulation: Simulation<T>,
}

impl<T: Scalar> SolverReference<T> {
    /// A solver for `system`.
    ///
    /// # Errors
    /// Settings that cannot be used, or a kind with a stiffness of the other formulation.
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

    fn restore(
        &mut self,
        positions: &[Point3<T>],
        velocities: &[Vector3<T>],
        frame: u64,
    ) -> Result<(), SolverError> {
        self.simulation.restore(positions, velocities, frame)
    }

    fn simulation(&self) -> &Simulation<T> {
        &self.simulation
    }
}
