//! Deformation models, which move the body from frame to frame.
//!
//! Each model has its own folder with a type that implements [`Model`]. [`build`] makes the model
//! that the scene names. Later code does not need to know which model it is. A started model is a
//! [`Simulation`], which the stage `run` steps.

pub(crate) mod chainmail;
mod choice;
pub(crate) mod constraints;
mod costs;
mod scene_system;

use cutis_rest::{Rest, Step};
use cutis_solver::StepProfile;
use nalgebra::Point3;

use crate::backend::{Chosen, DeviceMeter, DevicePositions, Request};
use crate::body::Body;
use crate::output::report::{ChainmailReport, KindResidual};
use crate::run::checkpoint::Checkpoint;
use crate::run::clock::Clock;
use crate::scene::{Scene, SceneFile};
use crate::{CostReport, Error};

pub use choice::ModelChoice;
pub(crate) use choice::{build, fill_defaults, validate};
pub use constraints::kinds::ScanTension;
pub(crate) use costs::ModelCosts;
pub(crate) use scene_system::needs_system;
pub use scene_system::{SceneCt, SceneSystem, build_system, build_system_and_ct};

/// The inputs from which a model is built and run.
#[derive(Clone, Copy)]
pub(crate) struct ModelInput<'a> {
    pub(crate) file: SceneFile<'a>,
    pub(crate) scene: &'a Scene,
    pub(crate) body: &'a Body,
}

/// A deformation model of a body, ready to be started.
pub(crate) trait Model {
    /// Counts memory and work, chooses the backend, and says what the scene leaves out.
    ///
    /// # Errors
    /// [`Error`] if the scene names a backend or an adapter that does not exist.
    fn costs(&self, input: &ModelInput<'_>, request: Request) -> Result<ModelCosts, Error>;

    /// Measures the time of a frame on a CPU backend, and adds it to the cost report.
    ///
    /// # Errors
    /// The errors of the backend.
    fn measure(
        self: Box<Self>,
        input: &ModelInput<'_>,
        backend: &Chosen,
        costs: CostReport,
        clock: &mut Clock<'_>,
    ) -> Result<CostReport, Error>;

    /// Puts the body into the backend.
    ///
    /// # Errors
    /// The errors of the backend.
    fn start<'a>(
        self: Box<Self>,
        input: &ModelInput<'a>,
        backend: &Chosen,
        clock: &mut Clock<'_>,
    ) -> Result<Started<'a>, Error>;
}

/// A started model.
pub(crate) struct Started<'a> {
    pub(crate) simulation: Box<dyn Simulation + 'a>,
    /// The GPU that it runs on, if it runs on one. Later stages use the same GPU.
    pub(crate) device: Option<DeviceMeter>,
}

/// A running simulation of a body.
pub(crate) trait Simulation {
    /// Restores the state of a checkpoint.
    fn restore(&mut self, saved: &Checkpoint) -> Result<(), Error>;

    /// Computes a frame.
    fn step(&mut self) -> Result<(), Error>;

    /// Computes a frame with the same result as [`step`](Self::step), and adds the time of each
    /// part to the profile.
    fn step_timed(&mut self, profile: &mut StepProfile) -> Result<(), Error>;

    /// Whether each part of a frame ends before the next one begins, so that timing the parts does
    /// not slow the frame.
    fn parts_are_sequential(&self) -> bool;

    /// Time since the start of the first frame, s.
    fn time_s(&self) -> f64;

    /// Positions of chosen vertices, local meters.
    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<f32>>, Error>;

    /// Force in each thread in N, with the number of its suture; empty without threads, or if the
    /// formulation knows no forces.
    fn thread_forces(&mut self) -> Result<Vec<(usize, f64)>, Error> {
        Ok(Vec::new())
    }

    /// Size of the force in N with which each handle holds its vertices against the body; empty
    /// without handles, without a report, or if the formulation knows no forces.
    fn handle_forces(&mut self) -> Result<Vec<f64>, Error> {
        Ok(Vec::new())
    }

    /// Does what is done to the body until the first frame that begins at `time_s` or later, and
    /// puts it into the state of rest that it then reaches, to an estimated error. The clock goes
    /// on to that frame, or stays where it is. `progress` receives each step of the search.
    ///
    /// # Errors
    /// [`Error::Rest`] if there is none, [`Error::Request`] for a model without energies.
    fn settle(&mut self, _time_s: f64, _error: f64, _progress: &mut dyn FnMut(&Step)) -> Result<Rest, Error> {
        let why = "this model has no energy that ends in a state of rest";
        Err(Error::Request { what: "run.until = \"rest\"".into(), why: why.into() })
    }

    /// The state after `frame` frames. A checkpoint has at least three words per vertex.
    fn save(&mut self, frame: u32) -> Result<Checkpoint, Error>;

    /// The state and the measurements at the end of a run.
    fn end(&mut self) -> Result<SimulationEnd, Error>;

    /// A copy of the present positions that stays on the GPU; none if they are not on a GPU.
    fn positions_on_device(&self) -> Option<DevicePositions> {
        None
    }
}

/// The end of a simulation.
#[derive(Default)]
pub(crate) struct SimulationEnd {
    /// Positions of the vertices, local meters.
    pub(crate) positions: Vec<Point3<f32>>,
    /// Constraint errors; none for a model without constraints.
    pub(crate) residuals: Vec<KindResidual>,
    /// Measurements of ChainMail; none for other models.
    pub(crate) chainmail: Option<ChainmailReport>,
    pub(crate) warnings: Vec<String>,
}

/// The first frame of `dt_s` seconds that begins at `at_s` or later. Frames beyond the range of
/// `u32` never come.
fn first_frame(at_s: f64, dt_s: f64) -> u64 {
    let near = (at_s / dt_s).min(f64::from(u32::MAX)) as u64;
    (near.saturating_sub(1)..=near + 1).find(|&frame| frame as f64 * dt_s >= at_s).unwrap_or(near + 2)
}

#[cfg(test)]
mod tests {
    use super::first_frame;

    #[test]
    fn a_frame_begins_at_the_time_or_later() {
        for (at_s, frame) in [(0.0, 0), (1e-9, 1), (0.1, 1), (0.3, 3), (0.31, 4), (12.3, 123)] {
            assert_eq!(first_frame(at_s, 0.1), frame, "{at_s}");
        }
        assert!(first_frame(1e300, 0.1) > u64::from(u32::MAX));
    }
}
