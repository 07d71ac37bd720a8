//! The interface of all backends.

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{
    Change, Energy, MemoryPart, Momentum, Residual, Schedule, Settings, Simulation, SolverError, StepProfile,
    System,
};

/// A backend with a body. The trait is object-safe, and measurements are computed on request.
///
/// A backend may keep the state on a device. Methods that access the state therefore take
/// `&mut self` and can fail. They read from the device only what they need. On a CPU backend they
/// read nothing and never fail.
pub trait Solver<T: Scalar>: Send {
    /// Returns the name of the backend in reports.
    fn name(&self) -> &'static str;

    /// Runs `frames` frames.
    ///
    /// # Errors
    /// Returns [`SolverError::NotFinite`] as described at [`Simulation::run`], and
    /// [`SolverError::Device`] if a device fails.
    fn step(&mut self, frames: usize) -> Result<(), SolverError>;

    /// Runs `frames` frames and adds the duration of each part to `profile`. The result has the
    /// same bits as that of [`step`](Self::step). On a CPU backend the overhead is negligible. On a
    /// device the host waits for each part, so that the parts take longer than a plain step. After
    /// an error, the profile contains the parts that ran before it.
    ///
    /// # Errors
    /// Returns the errors of [`step`](Self::step).
    fn step_timed(&mut self, frames: usize, profile: &mut StepProfile) -> Result<(), SolverError> {
        profile.time(StepProfile::STEP, || self.step(frames))
    }

    /// Continues from a saved state: positions in the caller's coordinates (m), velocities (m/s)
    /// and the number of completed frames.
    ///
    /// # Errors
    /// Returns the errors of [`Simulation::restore`], and [`SolverError::Device`] if a device
    /// fails.
    fn restore(
        &mut self,
        positions: &[Point3<T>],
        velocities: &[Vector3<T>],
        frame: u64,
    ) -> Result<(), SolverError>;

    /// Changes parts of the body between two frames.
    ///
    /// # Errors
    /// Returns the errors of [`Simulation::change`], and [`SolverError::Device`] if a device fails.
    fn change(&mut self, change: &Change<T>) -> Result<(), SolverError>;

    /// Returns the present settings, schedule and clock, and the host's copy of the body. On a CPU
    /// backend this is the present body. Elsewhere it is the body at the last call of
    /// [`refresh`](Self::refresh).
    fn simulation(&self) -> &Simulation<T>;

    /// Updates the host's copy of the body.
    ///
    /// # Errors
    /// Returns [`SolverError::Device`] if a device fails.
    fn refresh(&mut self) -> Result<(), SolverError> {
        Ok(())
    }

    /// Returns the positions of some vertices in the caller's coordinates (m), in the order of
    /// `vertices`.
    ///
    /// # Errors
    /// Returns [`SolverError::Vertex`] for a vertex that does not exist, and
    /// [`SolverError::Device`] if a device fails.
    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<T>>, SolverError> {
        self.system()?.positions_of(vertices)
    }

    /// Returns the body in its present state.
    ///
    /// # Errors
    /// This method and those below return the errors of [`refresh`](Self::refresh).
    fn system(&mut self) -> Result<&System<T>, SolverError> {
        self.refresh()?;
        Ok(self.simulation().system())
    }
    /// Returns all positions in the caller's coordinates (m), in the caller's order.
    fn positions(&mut self) -> Result<Vec<Point3<T>>, SolverError> {
        Ok(self.system()?.positions())
    }
    /// Returns all velocities in m/s.
    fn velocities(&mut self) -> Result<&[Vector3<T>], SolverError> {
        Ok(self.system()?.velocities())
    }
    /// Returns `C` over the rest size for each kind.
    fn residuals(&mut self) -> Result<Vec<Residual>, SolverError> {
        Ok(self.system()?.residuals())
    }
    /// Returns the kinetic, elastic and gravitational energy.
    fn energy(&mut self) -> Result<Energy, SolverError> {
        let gravity = self.settings().gravity_m_s2;
        Ok(self.system()?.energy(gravity))
    }
    /// Returns the linear and angular momentum.
    fn momentum(&mut self) -> Result<Momentum, SolverError> {
        Ok(self.system()?.momentum())
    }

    /// Returns the settings.
    fn settings(&self) -> &Settings {
        self.simulation().settings()
    }
    /// Returns the schedule of a frame.
    fn schedule(&self) -> &Schedule {
        self.simulation().schedule()
    }
    /// Returns the simulated time in seconds.
    fn time_s(&self) -> f64 {
        self.simulation().time_s()
    }
    /// Returns the memory on the host by part.
    fn bytes(&self) -> Vec<MemoryPart> {
        let simulation = self.simulation();
        let mut parts = simulation.system().bytes();
        let more = [
            ("multipliers", simulation.multiplier_bytes()),
            ("incidences", simulation.incidence_bytes()),
            ("teams", simulation.team_bytes()),
            ("columns", simulation.column_bytes()),
        ];
        let more = more.into_iter().filter(|(_, bytes)| *bytes > 0);
        parts.extend(more.map(|(name, bytes)| MemoryPart { name, bytes }));
        parts
    }
}
