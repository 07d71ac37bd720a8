//! The frames of a run: steps, openings of the wounds, checkpoints.

use std::path::PathBuf;
use std::time::Instant;

use cutis_mesh::{Gape, WoundGape};
use cutis_rest::Step;
use cutis_solver::SolverError;

use super::checkpoint::Checkpoint;
use super::clock::Clock;
use super::files::RunFolder;
use super::frames::FrameRow;
use super::rests::Rests;
use super::series::Series;
use super::stops::{SEARCH, SearchBar, Settled, Stop};
use super::timing::{PartTimes, Timing};
use crate::backend::{DeviceMeter, DevicePositions};
use crate::model::{Simulation, SimulationEnd};
use crate::output::rest_report::RestReport;
use crate::output::surface::Recorder;
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
    /// When something that is done to the body ends, in the order of time.
    pub(super) stops: Vec<Stop>,
    /// Computed frames of the checkpoint from which the run resumes.
    pub(super) resumed: Option<u32>,
    /// The rows up to that frame.
    pub(super) history: Vec<FrameRow>,
    /// The states of rest of the checkpoint, if it comes after them.
    pub(super) rests: Option<Rests>,
    pub(super) timing: Timing,
    /// Whether an output needs the final positions on the GPU.
    pub(super) resamples: bool,
    pub(super) device: Option<&'a DeviceMeter>,
    pub(super) series: Option<Series<'a>>,
    /// Duration of a frame, s.
    pub(super) dt_s: f64,
}

/// The result of the frames.
pub(super) struct RunResult {
    /// The state before the first frame, then one row per frame, also of those before a checkpoint.
    pub(super) rows: Vec<FrameRow>,
    pub(super) end: SimulationEnd,
    /// The states of rest after the frames, if the run ends there.
    pub(super) settled: Option<Settled>,
    /// The final positions on the GPU, if the simulation ran there and an output needs them.
    pub(super) on_device: Option<DevicePositions>,
    pub(super) times: PartTimes,
}

/// The end of a simulation, and its positions on the GPU.
type Ended = (SimulationEnd, Option<DevicePositions>);

impl RunLoop<'_> {
    /// Frames that an earlier run computed.
    fn done(&self) -> u32 {
        self.resumed.unwrap_or(0)
    }

    /// Frames that this run computes.
    pub(super) fn count(&self) -> u64 {
        u64::from(self.run.frames.saturating_sub(self.done()))
    }

    /// Runs the frames on `place`, which is `cpu` or `gpu`, and then finds the states of rest. It
    /// reads the lips of the wounds after each frame, and the whole state at a checkpoint and at
    /// the end.
    pub(super) fn run(
        &self,
        simulation: &mut dyn Simulation,
        place: &'static str,
        mut recorder: Option<&mut Recorder>,
        clock: &mut Clock<'_>,
    ) -> Result<RunResult, Error> {
        let saved = self.resumed.map(|frame| (frame, self.folder.checkpoint()));
        let mut at = Position { frame: self.done(), saved };
        let lips = Lips::new(self.gapes);
        let mut times = PartTimes::new(self.timing);
        let mut rows = self.history.clone();
        let now = self.row(simulation, &lips, self.done(), None)?;
        let has_rests = |rests: &Rests| rests.are_like(&now) && rests.stops.len() <= 1 + self.stops.len();
        let fits = self.rests.as_ref().is_none_or(has_rests);
        match rows.last() {
            None if self.resumed.is_none() => rows.push(now),
            Some(last) if fits && last.is_like(&now) && rows.len() as u64 == u64::from(now.frame) + 1 => {}
            _ => {
                let why = "its history is not that of this scene".into();
                return Err(Error::Checkpoint { path: self.folder.checkpoint(), why });
            }
        }
        if let Some(series) = &self.series {
            series.begin(self.resumed.is_some(), self.rests.is_some())?;
            if self.resumed.is_none() {
                series.frame(simulation, 0, self.run.frames)?;
            }
        }
        if let Some(recorder) = &mut recorder {
            recorder.start(&rows[0], self.resumed);
            if let (0, Some(_), Some(last), None) = (self.count(), self.resumed, rows.last(), &self.rests) {
                recorder.frame(simulation, last)?;
            }
        }
        let mut frames =
            |simulation: &mut dyn Simulation, recorder: Option<&mut Recorder>, progress: &dyn Progress| {
                let done = self.frames(simulation, &lips, &mut times, recorder, progress, &mut at, &mut rows);
                done.map_err(|error| at.name(error))
            };
        let (settled, (end, on_device)) = if self.run.until == RunEnd::Frames {
            let ended = clock.stage_on(place, "simulate", self.count(), |progress| {
                frames(simulation, recorder, progress)?;
                self.end(simulation)
            })?;
            (None, ended)
        } else {
            if self.count() > 0 {
                clock.stage_on(place, "simulate", self.count(), |progress| {
                    frames(simulation, recorder.as_deref_mut(), progress)
                })?;
            }
            let (settled, ended) = self.settle(simulation, place, &lips, recorder, clock, &rows)?;
            (Some(settled), ended)
        };
        if let Some(series) = &self.series {
            let rests = settled.as_ref().map_or(0, |settled| settled.stops.len());
            series.finish(self.run.frames, rests, self.dt_s)?;
        }
        if self.count() > 0 {
            self.time_extra_frame(simulation, &mut times);
        }
        Ok(RunResult { rows, settled, end, on_device, times })
    }

    /// The state at the end, and the positions on the GPU if an output needs them.
    fn end(&self, simulation: &mut dyn Simulation) -> Result<Ended, Error> {
        let end = simulation.end()?;
        Ok((end, if self.resamples { simulation.positions_on_device() } else { None }))
    }

    /// Finds the state of rest after each thing that is still to be done to the body. The equations
    /// are solved on `place`. `rows` are those of the frames.
    fn settle(
        &self,
        simulation: &mut dyn Simulation,
        place: &'static str,
        lips: &Lips<'_>,
        mut recorder: Option<&mut Recorder>,
        clock: &mut Clock<'_>,
        rows: &[FrameRow],
    ) -> Result<(Settled, Ended), Error> {
        let row = |simulation: &mut dyn Simulation, ms| self.row(simulation, lips, self.run.frames, ms);
        let mut settled = match &self.rests {
            Some(rests) => Settled::resumed(rests, row(simulation, None)?),
            None => Settled::default(),
        };
        let known = settled.stops.len();
        let start_s = settled.stops.first().map_or(simulation.time_s(), |stop| stop.time_s);
        let later = self.stops.iter().filter(|stop| stop.time_s > start_s);
        let later = later.map(|stop| (stop.time_s, stop.done.clone()));
        let states: Vec<(f64, Vec<String>)> = [(start_s, Vec::new())].into_iter().chain(later).collect();
        let count = states.len();
        if let (Some(recorder), Some((_, row)), Some(stop)) =
            (&mut recorder, &settled.last, settled.stops.last().filter(|_| known == count))
        {
            recorder.rest([count; 2], &stop.done, simulation, row)?;
        }
        let total = SEARCH * count.saturating_sub(known) as u64;
        clock.stage_on(place, "search for the state of rest", total, |progress| {
            let end_if_stopped = |simulation: &mut dyn Simulation, settled: &Settled| {
                if !progress.is_stopped() {
                    return Ok(());
                }
                let frame = self.save(simulation, settled, rows)?;
                Err(Error::Interrupted { frame, checkpoint: self.folder.checkpoint() })
            };
            end_if_stopped(simulation, &settled)?;
            for (n, (time_s, done)) in states.into_iter().enumerate().skip(known) {
                let start = Instant::now();
                let mut bar = SearchBar::new(self.run.error);
                let before = SEARCH * (n - known) as u64;
                let mut advance = |step: &Step| progress.advance(before + bar.after(step));
                let rest = simulation.settle(time_s, self.run.error, &mut advance)?;
                let ms = start.elapsed().as_secs_f64() * 1e3;
                let row = row(simulation, Some(ms))?;
                if let Some(recorder) = &mut recorder {
                    recorder.rest([n + 1, count], &done, simulation, &row)?;
                }
                if let Some(series) = &self.series {
                    series.rest(simulation, n + 1)?;
                }
                settled.add(RestReport::of(&rest, ms, place), row, done);
                if self.run.checkpoint_every > 0 {
                    self.save(simulation, &settled, rows)?;
                }
                progress.advance(before + SEARCH);
                end_if_stopped(simulation, &settled)?;
            }
            Ok((settled, self.end(simulation)?))
        })
    }

    /// The state of the wounds, sutures and handles.
    fn row(
        &self,
        simulation: &mut dyn Simulation,
        lips: &Lips<'_>,
        frame: u32,
        ms: Option<f64>,
    ) -> Result<FrameRow, Error> {
        let time_s = simulation.time_s();
        let sutures = suture_forces(self.sutures, &simulation.thread_forces()?);
        let handles = simulation.handle_forces()?;
        Ok(FrameRow { frame, time_s, ms, gapes: lips.measure(simulation)?, sutures, handles })
    }

    fn frames(
        &self,
        simulation: &mut dyn Simulation,
        lips: &Lips<'_>,
        times: &mut PartTimes,
        mut recorder: Option<&mut Recorder>,
        progress: &dyn Progress,
        at: &mut Position,
        rows: &mut Vec<FrameRow>,
    ) -> Result<(), Error> {
        let RunSection { frames, checkpoint_every: every, .. } = *self.run;
        for frame in self.done() + 1..=frames {
            if progress.is_stopped() {
                return Err(self.interrupted(simulation, frame - 1, at, rows));
            }
            at.frame = frame;
            let start = Instant::now();
            if self.timing == Timing::EveryFrame {
                simulation.step_timed(&mut times.profile)?;
                times.frames += 1;
            } else {
                simulation.step()?;
            }
            let ms = start.elapsed().as_secs_f64() * 1e3;
            let row = self.row(simulation, lips, frame, Some(ms))?;
            if let Some(recorder) = &mut recorder {
                recorder.frame(simulation, &row)?;
            }
            rows.push(row);
            if let Some(series) = &self.series {
                series.frame(simulation, frame, frames)?;
            }
            if every > 0 && (frame % every == 0 || frame == frames) {
                at.saved =
                    Some((self.save(simulation, &Settled::default(), rows)?, self.folder.checkpoint()));
            }
            progress.advance(u64::from(frame - self.done()));
        }
        Ok(())
    }

    /// Writes a checkpoint of the present state, and returns the number of frames that have passed.
    fn save(
        &self,
        simulation: &mut dyn Simulation,
        settled: &Settled,
        rows: &[FrameRow],
    ) -> Result<u32, Error> {
        let frame = (simulation.time_s() / self.dt_s).round() as u32;
        let saved = simulation.save(frame)?;
        let saved = Checkpoint { history: rows.to_vec(), rests: settled.saved(), ..saved };
        saved.write(&self.folder.checkpoint(), &self.fingerprint)?;
        Ok(frame)
    }

    /// Saves the state of a run that the user ends, unless the last checkpoint has it.
    fn interrupted(
        &self,
        simulation: &mut dyn Simulation,
        frame: u32,
        at: &Position,
        rows: &[FrameRow],
    ) -> Error {
        let is_saved = at.saved.as_ref().is_some_and(|(saved, _)| *saved == frame);
        match if is_saved { Ok(frame) } else { self.save(simulation, &Settled::default(), rows) } {
            Ok(frame) => Error::Interrupted { frame, checkpoint: self.folder.checkpoint() },
            Err(error) => error,
        }
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
    fn name(&self, error: Error) -> Error {
        match error {
            Error::Solver(source @ SolverError::Device { .. }) => {
                Error::Stopped { frame: self.frame, saved: self.saved.clone(), source }
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
