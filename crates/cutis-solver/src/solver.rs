//! What every backend offers.

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{
    Energy, MemoryPart, Momentum, Residual, Schedule, Settings, Simulation, SolverError, StepProfile, System,
};

/// A backend with a body in it. Object-safe; what is measured is computed when it is asked for.
///
/// A backend may keep the state on a device. Whatever looks at the state therefore takes `&mut self` and can fail: it reads
/// what it needs from there, and no more. On a CPU backend it costs nothing and never fails.
pub trait Solver<T: Scalar>: Send {
    /// Name in reports.
    fn name(&self) -> &'static str;

    /// Runs `frames` frames.
    ///
    /// # Errors
    /// [`SolverError::NotFinite`]: see [`Simulation::run`]; [`SolverError::Device`] if a device fails.
    fn step(&mut self, frames: usize) -> Result<(), SolverError>;

    /// As [`step`](Self::step), with the same bits, and enters into `profile` how long each part took: on a CPU backend at no
    /// cost to speak of; on a device each part is waited for, so that the parts take longer than a plain step. What ran
    /// before an error is entered too.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    fn step_timed(&mut self, frames: usize, profile: &mut StepProfile) -> Result<(), SolverError> {
        profile.time(StepProfile::STEP, || self.step(frames))
    }

    /// Goes on from a saved state: positions in the caller's coordinates (m), velocities (m/s), frames done so far.
    ///
    /// # Errors
    /// Wrong lengths or values that are not finite: see [`Simulation::restore`]; [`SolverError::Device`].
    fn restore(
        &mut self,
        positions: &[Point3<T>],
        velocities: &[Vector3<T>],
        frame: u64,
    ) -> Result<(), SolverError>;

    /// Settings, schedule and clock as of now, and the body as it was when the host last read it: on a CPU backend as of
    /// now, elsewhere at the last call of [`refresh`](Self::refresh).
    fn simulation(&self) -> &Simulation<T>;

    /// Brings the host's copy of the body up to date.
    ///
    /// # Errors
    /// [`SolverError::Device`].
    fn refresh(&mut self) -> Result<(), SolverError> {
        Ok(())
    }

    /// Positions of chosen vertices in the caller's coordinates (m), in the order asked for.
    ///
    /// # Errors
    /// [`SolverError::Vertex`] for a vertex that does not exist; [`SolverError::Device`].
    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<T>>, SolverError> {
        self.system()?.positions_of(vertices)
    }

    /// The body in its present state.
    ///
    /// # Errors
    /// As for [`refresh`](Self::refresh); the same for all that follow.
    fn system(&mut self) -> Result<&System<T>, SolverError> {
        self.refresh()?;
        Ok(self.simulation().system())
    }
    /// Positions in the caller's coordinates (m), in the caller's order.
    fn positions(&mut self) -> Result<Vec<Point3<T>>, SolverError> {
        Ok(self.system()?.positions())
    }
    /// Velocities in m/s.
    fn velocities(&mut self) -> Result<&[Vector3<T>], SolverError> {
        Ok(self.system()?.velocities())
    }
    /// `C` over rest size, per kind.
    fn residuals(&mut self) -> Result<Vec<Residual>, SolverError> {
        Ok(self.system()?.residuals())
    }
    /// Kinetic, elastic and gravitational energy.
    fn energy(&mut self) -> Result<Energy, SolverError> {
        let gravity = self.settings().gravity_m_s2;
        Ok(self.system()?.energy(gravity))
    }
    /// Linear and angular momentum.
    fn momentum(&mut self) -> Result<Momentum, SolverError> {
        Ok(self.system()?.momentum())
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
    /// Bytes stored, part by part.
    fn bytes(&self) -> Vec<MemoryPart> {
        let simulation = self.simulation();
        let mut parts = simulation.system().bytes();
        let bytes = simulation.multiplier_bytes();
        if bytes > 0 {
            parts.push(MemoryPart { name: "multipliers", bytes });
        }
        let bytes = simulation.incidence_bytes();
        if bytes > 0 {
            parts.push(MemoryPart { name: "incidences", bytes });
        }
        parts
    }
}
