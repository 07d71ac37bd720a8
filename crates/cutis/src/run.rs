//! Running a scene: frames, measurements, checkpoints, then the outputs that the scene names.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use cutis_mesh::{Gape, WoundGape};
use cutis_solver::{Solver, SolverReference};
use cutis_solver_cpu::SolverCpu;

use crate::checkpoint::{self, Checkpoint};
use crate::files::RunFolder;
use crate::output::{self, Outcome};
use crate::plan::{self, Prepared};
use crate::report::{Clock, Frames, KindResidual, Machine, Report, SCHEMA, Wound};
use crate::scene::{BackendChoice, LoadedScene};
use crate::{Error, Progress, files};

/// How to run a scene.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Run folder; made if it does not exist.
    pub out: PathBuf,
    /// Go on from the checkpoint in the run folder.
    pub resume: bool,
}

/// One line of `frames.csv`.
#[derive(Clone, Debug)]
pub(crate) struct FrameRow {
    pub(crate) frame: u32,
    pub(crate) time_s: f64,
    pub(crate) ms: f64,
    pub(crate) gapes: Vec<WoundGape>,
}

/// Runs a scene and writes its run folder.
///
/// # Errors
/// [`Error`]; see [`Error::is_bad_input`] for whose fault it is. Files that were written before the error stay.
pub fn run(loaded: &LoadedScene, options: &RunOptions, progress: &dyn Progress) -> Result<Report, Error> {
    let mut clock = Clock::new(progress);
    let folder = RunFolder(options.out.clone());
    let Prepared { source, body, dynamics, mut plan } = plan::prepare(loaded, &mut clock)?;
    files::create_folder(&folder.0)?;
    plan.warnings.iter().for_each(|warning| progress.note(warning));

    let mut solver: Box<dyn Solver<f32>> = match loaded.scene.solver.backend {
        BackendChoice::Reference => Box::new(
            SolverReference::new(dynamics.system, dynamics.settings).map_err(loaded.blame("solver"))?,
        ),
        _ => Box::new(
            SolverCpu::new(dynamics.system, dynamics.settings, Some(plan.backend.threads))
                .map_err(loaded.blame("solver"))?,
        ),
    };
    let stale = folder.left_from_before(&loaded.scene.output);
    if !stale.is_empty() && !options.resume {
        let note = format!(
            "{} holds files of an earlier run that this one does not write: {}",
            folder.0.display(),
            stale.join(", ")
        );
        progress.note(&note);
        plan.warnings.push(note);
    }
    let fingerprint = checkpoint::fingerprint(&loaded.scene, &source.sha256);
    let rest = &body.mesh.positions;
    let mut done = 0;
    if options.resume {
        let saved = Checkpoint::read(&folder.checkpoint(), &fingerprint, rest.len())?;
        done = saved.frame;
        if done > loaded.scene.run.frames {
            let why =
                format!("it is at frame {done}, and run.frames = {} lies before it", loaded.scene.run.frames);
            return Err(Error::Checkpoint { path: folder.checkpoint(), why });
        }
        solver.restore(&saved.positions, &saved.velocities, u64::from(saved.frame))?;
    }
    let lips = Lips::new(&body.cut.gapes);
    let first =
        FrameRow { frame: done, time_s: solver.time_s(), ms: 0.0, gapes: lips.measure(&mut *solver)? };
    let frames = loaded.scene.run.frames;
    let every = loaded.scene.run.checkpoint_every;
    let save = |solver: &mut dyn Solver<f32>, frame| {
        let (positions, velocities) = (solver.positions()?, solver.velocities()?.to_vec());
        Checkpoint { frame, positions, velocities }.write(&folder.checkpoint(), &fingerprint)
    };
    let rows = clock.stage("simulate", u64::from(frames.saturating_sub(done)), |progress| {
        let mut rows = vec![first];
        for frame in done + 1..=frames {
            let start = Instant::now();
            solver.step(1)?;
            let ms = start.elapsed().as_secs_f64() * 1e3;
            let gapes = lips.measure(&mut *solver)?;
            rows.push(FrameRow { frame, time_s: solver.time_s(), ms, gapes });
            if every > 0 && (frame % every == 0 || frame == frames) {
                save(&mut *solver, frame)?;
            }
            progress.advance(u64::from(frame - done));
        }
        Ok(rows)
    })?;

    let deformed = solver.positions()?;
    let outcome = Outcome { loaded, source: &source, body: &body, deformed: &deformed, folder: &folder };
    let products = output::write(&outcome, &mut clock)?;
    let at_rest: Vec<WoundGape> = body.cut.gapes.iter().map(|gape| gape.measure(rest)).collect();
    let wounds: Vec<Wound> = at_rest
        .iter()
        .zip(rows.last().map(|row| row.gapes.as_slice()).unwrap_or_default())
        .map(|(before, after)| Wound {
            initial_mm: before.mean_mm,
            final_mm: after.mean_mm,
            mid_mm: after.mid_mm,
            initial_mid_mm: before.mid_mm,
        })
        .collect();
    let moved = rest.iter().zip(&deformed).map(|(a, b)| f64::from((b - a).norm()) * 1e3);
    let report = Report {
        schema: SCHEMA.into(),
        cutis_version: env!("CARGO_PKG_VERSION").into(),
        machine: Machine::here(),
        inputs: source.inputs.clone(),
        scene: loaded.scene.clone(),
        backend: plan.backend,
        sizes: plan.sizes,
        skin: body.skin_report.as_ref().map(Into::into),
        colors: plan.colors,
        memory: plan.memory,
        stages: clock.stages.clone(),
        frames: frame_times(&rows),
        wound: wounds.first().cloned(),
        wounds,
        resample: products.resample.clone(),
        residuals: solver
            .residuals()?
            .iter()
            .map(|r| KindResidual { kind: r.name.into(), rms: r.rms, max: r.max })
            .collect(),
        max_displacement_mm: moved.fold(0.0, f64::max),
        left_out: plan.left_out,
        warnings: plan.warnings.into_iter().chain(products.warnings.iter().cloned()).collect(),
    };
    if loaded.scene.output.report {
        let earlier = if options.resume { earlier_frames(&folder, done)? } else { String::new() };
        files::write(&folder.frames(), frames_csv(&earlier, &rows).as_bytes())?;
        output::write_html(&report, &rows, &products, &folder)?;
        report.write(&folder.report())?;
    }
    Ok(report)
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

    /// Opening of each wound at the solver's present state.
    fn measure(&self, solver: &mut dyn Solver<f32>) -> Result<Vec<WoundGape>, Error> {
        if self.gapes.is_empty() {
            return Ok(Vec::new());
        }
        let positions = solver.positions_of(&self.vertices)?;
        let position = |vertex: u32| {
            let place = self.vertices.partition_point(|&v| v < vertex);
            positions[place].cast()
        };
        Ok(self.gapes.iter().map(|gape| gape.measure_by(&position)).collect())
    }
}

fn frame_times(rows: &[FrameRow]) -> Frames {
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
fn earlier_frames(folder: &RunFolder, done: u32) -> Result<String, Error> {
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
fn frames_csv(earlier: &str, rows: &[FrameRow]) -> String {
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
