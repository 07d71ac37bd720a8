//! What every backend offers.

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{Energy, MemoryPart, Momentum, Residual, Schedule, Settings, Simulation, SolverError, System};

/// A backend with a body in it. Object-safe; what is measured is computed when it is asked for.
pub trait Solver<T: Scalar>: Send {
    /// Name in reports.
    fn name(&self) -> &'static str;

    /// Runs `frames` frames.
    ///
    /// # Errors
    /// [`SolverError::NotFinite`]: see [`Simulation::run`].
    fn step(&mut self, frames: usize) -> Result<(), SolverError>;

    /// Goes on from a saved state: positions in the caller's coordinates (m), velocities (m/s), frames done so far.
    ///
    /// # Errors
    /// Wrong lengths or values that are not finite: see [`Simulation::restore`].
    fn restore(
        &mut self,
        positions: &[Point3<T>],
        velocities: &[Vector3<T>],
        frame: u64,
    ) -> Result<(), SolverError>;

    /// The simulation in its present state.
    fn simulation(&self) -> &Simulation<T>;

    /// The body in its present state.
    fn system(&self) -> &System<T> {
        self.simulation().system()
    }
    /// The settings in use.
    fn settings(&self) -> &Settings {
        self.simulation().settings()
    }
    /// What a frame executes.
    fn schedule(&self) -> &Schedule {
        self.simulation().schedule()
    }
    /// Simulated time in seconds.
    fn time_s(&self) -> f64 {
        self.simulation().time_s()
    }
    /// Positions in the caller's coordinates (m), in the caller's order.
    fn positions(&self) -> Vec<Point3<T>> {
        self.system().positions()
    }
    /// Velocities in m/s.
    fn velocities(&self) -> &[Vector3<T>] {
        self.system().velocities()
    }
    /// `C` over rest size, per kind.
    fn residuals(&self) -> Vec<Residual> {
        self.system().residuals()
    }
    /// Kinetic, elastic and gravitational energy.
    fn energy(&self) -> Energy {
        self.system().energy(self.settings().gravity_m_s2)
    }
    /// Linear and angular momentum.
    fn momentum(&self) -> Momentum {
        self.system().momentum()
    }
    /// Bytes stored on the host, part by part.
    fn bytes(&self) -> Vec<MemoryPart> {
        let mut parts = self.system().bytes();
        let bytes = self.simulation().multiplier_bytes();
        if bytes > 0 {
            parts.push(MemoryPart { name: "multipliers", bytes });
        }
        parts
    }
}
