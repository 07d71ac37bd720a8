//! What moves the body from frame to frame: one trait for all models.

pub(crate) mod chainmail;
pub(crate) mod constraints;
mod scene_system;

use cutis_solver::StepProfile;
use nalgebra::Point3;

use crate::Error;
use crate::report::{ChainmailReport, KindResidual};
use crate::run::checkpoint::Checkpoint;

pub(crate) use chainmail::Chained;
pub(crate) use constraints::Stepped;
pub(crate) use scene_system::needs_system;
pub use scene_system::{SceneSystem, build_system};

/// A body in motion.
pub(crate) trait Motion {
    /// Goes on from a saved state.
    fn restore(&mut self, saved: &Checkpoint) -> Result<(), Error>;

    /// Runs a frame.
    fn step(&mut self) -> Result<(), Error>;

    /// As [`step`](Self::step), with the same bits, and enters how long each part took.
    fn step_timed(&mut self, profile: &mut StepProfile) -> Result<(), Error>;

    /// Whether each part of a frame is over before the next one begins, so that to time them costs nothing.
    fn waits(&self) -> bool;

    /// Time since the start of the first frame, s.
    fn time_s(&self) -> f64;

    /// Where chosen vertices are, in local meters.
    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<f32>>, Error>;

    /// The state after so many frames.
    fn save(&mut self, frame: u32) -> Result<Checkpoint, Error>;

    /// What is told of a finished run.
    fn end(&mut self) -> Result<End, Error>;
}

/// The end of a run.
#[derive(Default)]
pub(crate) struct End {
    /// Local meters, one per vertex.
    pub(crate) positions: Vec<Point3<f32>>,
    pub(crate) residuals: Vec<KindResidual>,
    pub(crate) chainmail: Option<ChainmailReport>,
    pub(crate) warnings: Vec<String>,
}
