//! A body that is only searched for its state of rest.

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{Change, Settings, Simulation, Solver, SolverError, System};

/// Holds a body that takes no steps. It needs neither color groups nor multipliers, so that none
/// are made. Its state, its clock and its parts change as those of a backend do.
pub struct Resting<T: Scalar> {
    simulation: Simulation<T>,
}

impl<T: Scalar> Resting<T> {
    /// Takes a body.
    ///
    /// # Errors
    /// Returns the errors of [`Simulation::new`], except those of color groups.
    pub fn new(system: System<T>, settings: Settings) -> Result<Self, SolverError> {
        Ok(Self { simulation: Simulation::resting(system, settings)? })
    }
}

impl<T: Scalar> Solver<T> for Resting<T> {
    fn name(&self) -> &'static str {
        "resting"
    }

    /// Returns [`SolverError::Resting`], except for 0 frames.
    fn step(&mut self, frames: usize) -> Result<(), SolverError> {
        if frames > 0 { Err(SolverError::Resting) } else { Ok(()) }
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
