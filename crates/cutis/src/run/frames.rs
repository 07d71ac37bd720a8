//! The frames of a run: steps, openings of the wounds, checkpoints; and `frames.csv`.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use cutis_mesh::{Gape, WoundGape};
use cutis_solver::{SolverError, StepProfile};

use crate::model::{End, Motion};
use crate::report::Frames;
use crate::run::files::{self, RunFolder};
use crate::scene::RunSection;
use crate::{CostReport, Error, Progress};

/// One line of `frames.csv`.
#[derive(Clone, Debug)]
pub(crate) struct FrameRow {
    pub(crate) frame: u32,
    pub(crate) time_s: f64,
    pub(crate) ms: f64,
    pub(crate) gapes: Vec<WoundGape>,
}

/// What the frames need beside the body in motion.
pub(crate) struct Course<'a> {
    pub(crate) run: &'a RunSection,
    pub(crate) folder: &'a RunFolder,
    pub(crate) fingerprint: [u8; 32],
    pub(crate) gapes: &'a [Gape],
    /// Frame of the checkpoint that the run goes on from.
    pub(crate) resumed: Option<u32>,
    pub(crate) timing: Timing,
}

/// How the time of the solver's parts is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Timing {
    No,
    /// In every frame: on the host that costs nothing to speak of.
    Throughout,
    /// In one more frame, of which nothing is kept: on a device the parts are waited for, which a frame is not.
    OneMore,
}

/// Times of the solver's parts.
pub(crate) struct Times {
    profile: StepProfile,
    frames: u32,
    timing: Timing,
}

impl Times {
    /// Enters the times where there are any.
    pub(crate) fn enter(&self, costs: CostReport) -> CostReport {
        let how = match (self.timing, self.frames) {
            (Timing::No, _) => {
                return CostReport { time: "not measured: no report was asked for".into(), ..costs };
            }
            (_, 0) => {
                return CostReport { time: "not measured: there was no frame to measure".into(), ..costs };
            }
            (Timing::Throughout, frames) => format!("mean of the {frames} frames of this run"),
            (Timing::OneMore, _) => {
                "one frame more than the run has, part by part, each waited for: together longer than a frame"
                    .into()
            }
        };
        costs.with_times(&self.profile, self.frames.into(), &how)
    }
}

/// What the frames leave.
pub(crate) struct Finish {
    /// The state before the first frame, then one row per frame.
    pub(crate) rows: Vec<FrameRow>,
    pub(crate) end: End,
    pub(crate) times: Times,
}

impl Course<'_> {
    /// Frames that an earlier run did.
    pub(crate) fn done(&self) -> u32 {
        self.resumed.unwrap_or(0)
    }

    /// Runs the frames. Of the state it reads the lips of the wounds after each frame, and all of it at a checkpoint and at
    /// the end.
    pub(crate) fn run(&self, motion: &mut dyn Motion, progress: &dyn Progress) -> Result<Finish, Error> {
        let mut at =
            Reached { frame: self.done(), saved: self.resumed.map(|n| (n, self.folder.checkpoint())) };
        self.frames(motion, progress, &mut at).map_err(|error| at.name(error))
    }

    fn frames(
        &self,
        motion: &mut dyn Motion,
        progress: &dyn Progress,
        at: &mut Reached,
    ) -> Result<Finish, Error> {
        let lips = Lips::new(self.gapes);
        let RunSection { frames, checkpoint_every: every } = *self.run;
        let row = |motion: &mut dyn Motion, frame, ms| {
            Ok::<_, Error>(FrameRow { frame, time_s: motion.time_s(), ms, gapes: lips.measure(motion)? })
        };
        let mut rows = vec![row(motion, self.done(), 0.0)?];
        let mut times = Times { profile: StepProfile::default(), frames: 0, timing: self.timing };
        for frame in self.done() + 1..=frames {
            at.frame = frame;
            let start = Instant::now();
            if self.timing == Timing::Throughout {
                motion.step_timed(&mut times.profile)?;
                times.frames += 1;
            } else {
                motion.step()?;
            }
            let ms = start.elapsed().as_secs_f64() * 1e3;
            rows.push(row(motion, frame, ms)?);
            if every > 0 && (frame % every == 0 || frame == frames) {
                self.save(motion, frame)?;
                at.saved = Some((frame, self.folder.checkpoint()));
            }
            progress.advance(u64::from(frame - self.done()));
        }
        let end = motion.end()?;
        // What happens to the body from here on is nobody's business, and a failure no reason to lose the run.
        if self.timing == Timing::OneMore && rows.len() > 1 && motion.step_timed(&mut times.profile).is_ok() {
            times.frames = 1;
        }
        Ok(Finish { rows, end, times })
    }

    fn save(&self, motion: &mut dyn Motion, frame: u32) -> Result<(), Error> {
        motion.save(frame)?.write(&self.folder.checkpoint(), &self.fingerprint)
    }
}

/// How far a run came.
struct Reached {
    frame: u32,
    saved: Option<(u32, PathBuf)>,
}

impl Reached {
    /// Says where a device failed, and what is left of the run.
    fn name(self, error: Error) -> Error {
        match error {
            Error::Solver(source @ SolverError::Device { .. }) => {
                Error::Stopped { frame: self.frame, saved: self.saved, source }
            }
            other => other,
        }
    }
}

/// The vertices that the openings are measured at: what a frame needs of the state, and all that is read of it.
struct Lips<'a> {
    gapes: &'a [Gape],
    /// Ascending.
    vertices: Vec<u32>,
}

impl<'a> Lips<'a> {
    fn new(gapes: &'a [Gape]) -> Self {
        let mut vertices: Vec<u32> =
            gapes.iter().flat_map(|gape| gape.left().iter().chain(gape.right())).copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        Self { gapes, vertices }
    }

    /// Opening of each wound at the present state.
    fn measure(&self, motion: &mut dyn Motion) -> Result<Vec<WoundGape>, Error> {
        if self.gapes.is_empty() {
            return Ok(Vec::new());
        }
        let positions = motion.positions_of(&self.vertices)?;
        let position = |vertex: u32| {
            let place = self.vertices.partition_point(|&v| v < vertex);
            positions[place].cast()
        };
        Ok(self.gapes.iter().map(|gape| gape.measure_by(&position)).collect())
    }
}

/// Time per frame.
pub(crate) fn frame_times(rows: &[FrameRow]) -> Frames {
    let times: Vec<f64> = rows.iter().skip(1).map(|row| row.ms).collect();
    if times.is_empty() {
        return Frames::default();
    }
    Frames {
        count: times.len() as u32,
        ms_mean: times.iter().sum::<f64>() / times.len() as f64,
        ms_min: times.iter().copied().fold(f64::INFINITY, f64::min),
    }
}

/// The lines of `frames.csv` that an earlier run wrote before frame `done`.
pub(crate) fn earlier_frames(folder: &RunFolder, done: u32) -> Result<String, Error> {
    if !folder.frames().exists() {
        return Ok(String::new());
    }
    let text = String::from_utf8_lossy(&files::read(&folder.frames())?).into_owned();
    let before = |line: &&str| {
        line.split(',').next().and_then(|frame| frame.parse::<u32>().ok()).is_some_and(|frame| frame < done)
    };
    Ok(text.lines().filter(before).flat_map(|line| [line, "\n"]).collect())
}

/// `frames.csv`: the first line is the state before the first frame.
pub(crate) fn frames_csv(earlier: &str, rows: &[FrameRow]) -> String {
    let wounds = rows.first().map_or(0, |row| row.gapes.len());
    let mut out = String::from("frame,time_s,ms");
    for n in 0..wounds {
        let _ = write!(out, ",gape_{n}_mean_mm,gape_{n}_mid_mm");
    }
    out.push('\n');
    out.push_str(earlier);
    for row in rows {
        let _ = write!(out, "{},{},{:.3}", row.frame, row.time_s, row.ms);
        for gape in &row.gapes {
            let _ = write!(out, ",{:.4},{:.4}", gape.mean_mm, gape.mid_mm);
        }
        out.push('\n');
    }
    out
}
