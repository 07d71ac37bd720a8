//! The frames of a run: steps, openings of the wounds, checkpoints.

use std::path::PathBuf;
use std::time::Instant;

use cutis_mesh::{Gape, WoundGape};
use cutis_solver::SolverError;

use super::files::RunFolder;
use super::frames::FrameRow;
use super::timing::{PartTimes, Timing};
use crate::backend::{DeviceMeter, DevicePositions};
use crate::model::{Simulation, SimulationEnd};
use crate::output::rest_report::RestReport;
use crate::scene::{RunEnd, RunSection};
use crate::{Error, Progress};

/// Inputs of the frames in addition to the simulation.
pub(super) struct RunLoop<'a> {
    pub(super) run: &'a RunSection,
    pub(super) folder: &'a RunFolder,
    pub(super) fingerprint: [u8; 32],
    pub(super) gapes: &'a [Gape],
    /// Number of sutures whose forces are known.
    pub(super) sutures: usize,
    /// Frame of the checkpoint from which the run resumes.
    pub(super) resumed: Option<u32>,
    pub(super) timing: Timing,
    /// Whether an output needs the final positions on the GPU.
    pub(super) resamples: bool,
    pub(super) device: Option<&'a DeviceMeter>,
}

/// The result of the frames.
pub(super) struct RunResult {
    /// The state before the first frame, then one row per frame.
    pub(super) rows: Vec<FrameRow>,
    pub(super) end: SimulationEnd,
    /// The body at rest after the frames, if the run ends there.
    pub(super) rest: Option<(RestReport, FrameRow)>,
    /// The final positions on the GPU, if the simulation ran there and an output needs them.
    pub(super) on_device: Option<DevicePositions>,
    pub(super) times: PartTimes,
}

impl RunLoop<'_> {
    /// Frames that an earlier run computed.
    fn done(&self) -> u32 {
        self.resumed.unwrap_or(0)
    }

    /// Frames that this run computes.
    pub(super) fn count(&self) -> u64 {
        u64::from(self.run.frames.saturating_sub(self.done()))
    }

    /// Runs the frames. It reads the lips of the wounds after each frame, and the whole state at a
    /// checkpoint and at the end.
    pub(super) fn run(
        &self,
        simulation: &mut dyn Simulation,
        progress: &dyn Progress,
    ) -> Result<RunResult, Error> {
        let saved = self.resumed.map(|frame| (frame, self.folder.checkpoint()));
        let mut at = Position { frame: self.done(), saved };
        self.frames(simulation, progress, &mut at).map_err(|error| at.name(error))
    }

    fn frames(
        &self,
        simulation: &mut dyn Simulation,
        progress: &dyn Progress,
        at: &mut Position,
    ) -> Result<RunResult, Error> {
        let lips = Lips::new(self.gapes);
        let RunSection { frames, until, error, checkpoint_every: every } = *self.run;
        let row = |simulation: &mut dyn Simulation, frame, ms| {
            let time_s = simulation.time_s();
            let sutures = suture_forces(self.sutures, &simulation.thread_forces()?);
            let handles = simulation.handle_forces()?;
            Ok::<_, Error>(FrameRow { frame, time_s, ms, gapes: lips.measure(simulation)?, sutures, handles })
        };
        let mut rows = vec![row(simulation, self.done(), 0.0)?];
        let mut times = PartTimes::new(self.timing);
        for frame in self.done() + 1..=frames {
            at.frame = frame;
            let start = Instant::now();
            if self.timing == Timing::EveryFrame {
                simulation.step_timed(&mut times.profile)?;
                times.frames += 1;
            } else {
                simulation.step()?;
            }
            let ms = start.elapsed().as_secs_f64() * 1e3;
            rows.push(row(simulation, frame, ms)?);
            if every > 0 && (frame % every == 0 || frame == frames) {
                simulation.save(frame)?.write(&self.folder.checkpoint(), &self.fingerprint)?;
                at.saved = Some((frame, self.folder.checkpoint()));
            }
            progress.advance(u64::from(frame - self.done()));
        }
        let mut rest = None;
        if until == RunEnd::Rest {
            let start = Instant::now();
            let mut found = RestReport::of(&simulation.settle(error)?);
            found.ms = start.elapsed().as_secs_f64() * 1e3;
            let row = row(simulation, frames, found.ms)?;
            rest = Some((found, row));
        }
        let end = simulation.end()?;
        let on_device = if self.resamples { simulation.positions_on_device() } else { None };
        if rows.len() > 1 {
            self.time_extra_frame(simulation, &mut times);
        }
        Ok(RunResult { rows, rest, end, on_device, times })
    }

    /// Times the parts of one more frame, if they are not timed in every frame. The state is no
    /// longer needed, so a failure is ignored.
    fn time_extra_frame(&self, simulation: &mut dyn Simulation, times: &mut PartTimes) {
        if self.timing == Timing::ExtraFrame && simulation.step_timed(&mut times.profile).is_ok() {
            times.frames = 1;
            times.stamped = self.device.is_some_and(DeviceMeter::has_timestamps);
        }
    }
}

/// The sum of the forces in the threads of each suture, and the largest one, N.
fn suture_forces(sutures: usize, threads: &[(usize, f64)]) -> Vec<[f64; 2]> {
    let mut forces = vec![[0.0; 2]; sutures];
    for &(suture, force) in threads {
        let [sum, largest] = &mut forces[suture];
        *sum += force;
        *largest = f64::max(*largest, force);
    }
    forces
}

/// The present frame and the last checkpoint, for an error.
struct Position {
    frame: u32,
    saved: Option<(u32, PathBuf)>,
}

impl Position {
    /// Adds frame and checkpoint to the error of a device.
    fn name(self, error: Error) -> Error {
        match error {
            Error::Solver(source @ SolverError::Device { .. }) => {
                Error::Stopped { frame: self.frame, saved: self.saved, source }
            }
            other => other,
        }
    }
}

/// The vertices at which openings are measured. A frame reads these vertices and no others.
struct Lips<'a> {
    gapes: &'a [Gape],
    /// In ascending order.
    vertices: Vec<u32>,
}

impl<'a> Lips<'a> {
    fn new(gapes: &'a [Gape]) -> Self {
        let mut vertices: Vec<u32> = gapes.iter().flat_map(Gape::vertices).collect();
        vertices.sort_unstable();
        vertices.dedup();
        Self { gapes, vertices }
    }

    /// Opening of each wound in the present state.
    fn measure(&self, simulation: &mut dyn Simulation) -> Result<Vec<WoundGape>, Error> {
        if self.gapes.is_empty() {
            return Ok(Vec::new());
        }
        let positions = simulation.positions_of(&self.vertices)?;
        let position = |vertex: u32| {
            let place = self.vertices.partition_point(|&v| v < vertex);
            positions[place].cast()
        };
        Ok(self.gapes.iter().map(|gape| gape.measure_by(&position)).collect())
    }
}
