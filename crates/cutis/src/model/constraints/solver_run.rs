//! A simulation by a solver of constraints.

use cutis_solver::StepProfile;
use nalgebra::{Point3, Vector3};

use super::start::StartedSolver;
use crate::Error;
use crate::backend::DevicePositions;
use crate::model::{Simulation, SimulationEnd};
use crate::output::report::KindResidual;
use crate::run::checkpoint::Checkpoint;

/// Relative error above which a degenerate constraint is reported.
const COLLAPSED: f64 = 0.01;

/// A solver with a body in it.
pub(crate) struct SolverRun {
    pub(crate) solver: StartedSolver,
}

impl Simulation for SolverRun {
    fn restore(&mut self, saved: &Checkpoint) -> Result<(), Error> {
        let velocities: Vec<Vector3<f32>> = saved
            .words
            .chunks_exact(3)
            .map(|v| Vector3::from_fn(|axis, _| f32::from_bits(v[axis])))
            .collect();
        Ok(self.solver.solver().restore(&saved.positions, &velocities, u64::from(saved.frame))?)
    }

    fn step(&mut self) -> Result<(), Error> {
        Ok(self.solver.solver().step(1)?)
    }

    fn step_timed(&mut self, profile: &mut StepProfile) -> Result<(), Error> {
        Ok(self.solver.solver().step_timed(1, profile)?)
    }

    fn parts_are_sequential(&self) -> bool {
        !self.solver.on_gpu()
    }

    fn time_s(&self) -> f64 {
        self.solver.reader().time_s()
    }

    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<f32>>, Error> {
        Ok(self.solver.solver().positions_of(vertices)?)
    }

    fn save(&mut self, frame: u32) -> Result<Checkpoint, Error> {
        let solver = self.solver.solver();
        let positions = solver.positions()?;
        let words = solver.velocities()?.iter().flat_map(|v| [v.x, v.y, v.z].map(f32::to_bits)).collect();
        Ok(Checkpoint { frame, positions, words })
    }

    /// Reads the whole body once. Residuals are measured on the host, so that they need no GPU
    /// memory, and a full GPU cannot make a finished run fail.
    fn end(&mut self) -> Result<SimulationEnd, Error> {
        let system = self.solver.solver().system()?;
        let collapsed = system.check_collapsed(COLLAPSED).err().map(|error| error.to_string());
        Ok(SimulationEnd {
            positions: system.positions(),
            residuals: system.residuals().iter().map(KindResidual::from).collect(),
            warnings: collapsed.into_iter().collect(),
            chainmail: None,
        })
    }

    fn positions_on_device(&self) -> Option<DevicePositions> {
        self.solver.positions_on_device()
    }
}
