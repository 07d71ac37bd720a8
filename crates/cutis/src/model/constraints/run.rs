//! A body that a solver steps.

use cutis_solver::{Solver, StepProfile};
use nalgebra::{Point3, Vector3};

use crate::Error;
use crate::model::{End, Motion};
use crate::report::KindResidual;
use crate::run::checkpoint::Checkpoint;

/// The value over rest size from which on a constraint that cannot act is told of.
const VIOLATED: f64 = 0.01;

/// A solver with a body in it.
pub(crate) struct Stepped {
    pub(crate) solver: Box<dyn Solver<f32>>,
    /// Whether it runs on a device.
    pub(crate) on_device: bool,
}

impl Motion for Stepped {
    fn restore(&mut self, saved: &Checkpoint) -> Result<(), Error> {
        let velocities: Vec<Vector3<f32>> = saved
            .words
            .chunks_exact(3)
            .map(|v| Vector3::from_fn(|axis, _| f32::from_bits(v[axis])))
            .collect();
        Ok(self.solver.restore(&saved.positions, &velocities, u64::from(saved.frame))?)
    }

    fn step(&mut self) -> Result<(), Error> {
        Ok(self.solver.step(1)?)
    }

    fn step_timed(&mut self, profile: &mut StepProfile) -> Result<(), Error> {
        Ok(self.solver.step_timed(1, profile)?)
    }

    fn waits(&self) -> bool {
        !self.on_device
    }

    fn time_s(&self) -> f64 {
        self.solver.time_s()
    }

    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<f32>>, Error> {
        Ok(self.solver.positions_of(vertices)?)
    }

    fn save(&mut self, frame: u32) -> Result<Checkpoint, Error> {
        let positions = self.solver.positions()?;
        let words =
            self.solver.velocities()?.iter().flat_map(|v| [v.x, v.y, v.z].map(f32::to_bits)).collect();
        Ok(Checkpoint { frame, positions, words })
    }

    /// The whole body comes to the host for its positions: measured there, residuals cost a device nothing, and a lack of room on it
    /// cannot take a finished run.
    fn end(&mut self) -> Result<End, Error> {
        let system = self.solver.system()?;
        let collapsed = system.check_collapsed(VIOLATED).err().map(|error| error.to_string());
        Ok(End {
            positions: system.positions(),
            residuals: system.residuals().iter().map(KindResidual::from).collect(),
            warnings: collapsed.into_iter().collect(),
            chainmail: None,
        })
    }
}
