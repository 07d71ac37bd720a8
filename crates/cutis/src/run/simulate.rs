//! The frames of a run: starts the model, resumes from a checkpoint, steps the simulation.

use cutis_solver::Formulation;

use super::RunOptions;
use super::checkpoint::{self, Checkpoint};
use super::clock::Clock;
use super::files::{self, RunFolder};
use super::frames::FrameRow;
use super::other_scene;
use super::rests::Rests;
use super::run_loop::{RunLoop, RunResult};
use super::series::Series;
use super::stops::Stop;
use super::timing::Timing;
use crate::backend::{Chosen, DeviceMeter};
use crate::body::{Body, Membrane};
use crate::cost::Plan;
use crate::ct::source::Source;
use crate::model::{Model, ModelInput, Simulation, Started};
use crate::output::surface::Recorder;
use crate::scene::{LoadedScene, RunEnd};
use crate::{Error, Progress};

/// A run before its first frame.
pub(super) struct Setup<'a> {
    pub(super) loaded: &'a LoadedScene,
    pub(super) options: &'a RunOptions,
    pub(super) folder: &'a RunFolder,
    pub(super) source: &'a Source,
    pub(super) body: &'a Body,
}

/// A run after its last frame.
pub(super) struct Simulated {
    /// The plan, with the warnings of the run.
    pub(super) plan: Plan,
    /// The GPU that the simulation ran on, if it ran on one.
    pub(super) device: Option<DeviceMeter>,
    pub(super) result: RunResult,
    /// States of the skin for the report; none without a report or without a skin.
    pub(super) recorder: Option<Recorder>,
}

/// Runs the frames.
///
/// # Errors
/// [`Error`] for a backend that does not start, a checkpoint that does not fit, and a frame that
/// fails.
pub(super) fn simulate(
    setup: &Setup<'_>,
    model: Box<dyn Model>,
    backend: &Chosen,
    mut plan: Plan,
    clock: &mut Clock<'_>,
) -> Result<Simulated, Error> {
    let Setup { loaded, options, folder, source, body } = *setup;
    let scene = &loaded.scene;
    let input = ModelInput { file: loaded.file(), scene, body };
    let Started { mut simulation, device } = model.start(&input, backend, clock)?;
    files::create_folder(&folder.0)?;
    plan.warnings.extend(stale_files(setup));
    plan.warnings.iter().for_each(|warning| clock.progress.note(warning));
    let fingerprint = checkpoint::fingerprint(scene, &source.sha256);
    let resumes = options.resume && !begins_again(setup, clock.progress);
    let resumed = if resumes { Some(resume(setup, &fingerprint, &mut *simulation)?) } else { None };
    let (resumed, (history, rests)) =
        resumed.map_or_else(Default::default, |(frames, history, rests)| (Some(frames), (history, rests)));
    let run_loop = RunLoop {
        run: &scene.run,
        folder,
        fingerprint,
        gapes: &body.cut.gapes,
        sutures: if scene.solver.formulation == Formulation::Pbd { 0 } else { body.stitches.len() },
        stops: Stop::all(&plan.steps, scene),
        resumed,
        history,
        rests,
        timing: match (scene.output.report, simulation.parts_are_sequential()) {
            (false, _) => Timing::No,
            (true, true) => Timing::EveryFrame,
            (true, false) => Timing::ExtraFrame,
        },
        resamples: scene.output.volume || scene.output.pictures,
        device: device.as_ref(),
        series: Series::of(folder, body, scene.output.series_every),
        dt_s: scene.solver.dt_s,
    };
    let rests = if scene.run.until == RunEnd::Rest { 1 + run_loop.stops.len() } else { 0 };
    let mut recorder = match scene.output.report {
        true => Recorder::new(body, &source.volume, scene.run.frames, rests),
        false => None,
    };
    let result = run_loop.run(&mut *simulation, backend.place(), recorder.as_mut(), clock)?;
    // This frees the simulation's memory on the GPU for the stages that follow.
    drop(simulation);
    warn(&mut plan, &result.end.warnings, clock.progress);
    Ok(Simulated { plan, device, result, recorder })
}

/// Adds warnings to the plan, and shows them to the user.
pub(super) fn warn(plan: &mut Plan, warnings: &[String], progress: &dyn Progress) {
    warnings.iter().for_each(|warning| progress.note(warning));
    plan.warnings.extend_from_slice(warnings);
}

/// Warning about files that this run will neither replace nor remove.
fn stale_files(setup: &Setup<'_>) -> Option<String> {
    let has_lines = setup.body.membrane.as_ref().is_some_and(Membrane::has_lines);
    let stale = setup.folder.stale_files(&setup.loaded.scene.output, has_lines);
    (!stale.is_empty() && !setup.options.resume).then(|| {
        format!(
            "{} holds files that this run does not write, and that no report of Cutis lists: {}",
            setup.folder.0.display(),
            stale.join(", ")
        )
    })
}

/// Whether there is nothing to resume from, because a run with checkpoints ended before the first.
fn begins_again(setup: &Setup<'_>, progress: &dyn Progress) -> bool {
    let path = setup.folder.checkpoint();
    let again = setup.loaded.scene.run.checkpoint_every > 0 && !path.exists();
    if again {
        progress.note(&format!("there is no {} yet: the run begins at its first frame", path.display()));
    }
    again
}

/// Restores the state of the run folder's checkpoint, and returns the number of computed frames,
/// their rows, and the states of rest after them.
fn resume(
    setup: &Setup<'_>,
    fingerprint: &[u8; 32],
    simulation: &mut dyn Simulation,
) -> Result<(u32, Vec<FrameRow>, Option<Rests>), Error> {
    let (path, run) = (setup.folder.checkpoint(), &setup.loaded.scene.run);
    let saved = Checkpoint::read(&path, fingerprint, setup.body.mesh.positions.len())
        .map_err(|error| other_scene::explain(error, setup.folder, &setup.loaded.scene))?;
    // States of rest come after all frames, and time goes on without frames between them.
    let computed = saved.history.len().saturating_sub(1) as u32;
    let why = if saved.rests.is_some() && (run.until, run.frames) != (RunEnd::Rest, computed) {
        format!(
            "it is a state of rest after {computed} frames: set run.until = \"rest\" and run.frames = {computed}"
        )
    } else if saved.rests.is_none() && saved.frame > run.frames {
        format!("it is at frame {}, and run.frames = {} lies before it", saved.frame, run.frames)
    } else {
        simulation.restore(&saved)?;
        let frames = if saved.rests.is_some() { computed } else { saved.frame };
        return Ok((frames, saved.history, saved.rests));
    };
    Err(Error::Checkpoint { path, why })
}
