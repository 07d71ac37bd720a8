//! Running a scene: frames, measurements, checkpoints, then the outputs that the scene names.

pub(crate) mod checkpoint;
pub(crate) mod clock;
pub(crate) mod files;
pub(crate) mod frames;

use std::path::PathBuf;

use cutis_mesh::WoundGape;

use crate::backend::{Chosen, Metered, Request, Stages};
use crate::body::Body;
use crate::cost::plan::{self, Matter, Prepared};
use crate::model::constraints::system::Dynamics;
use crate::model::{Chained, Motion, Stepped};
use crate::output::{self, Outcome};
use crate::report::{Machine, Report, SCHEMA, Wound};
use crate::run::clock::Clock;
use crate::run::files::RunFolder;
use crate::run::frames::{Course, Finish, Timing, earlier_frames, frame_times, frames_csv};
use crate::scene::LoadedScene;
use crate::{Error, Progress};
use checkpoint::Checkpoint;

/// How to run a scene.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Run folder; made if it does not exist.
    pub out: PathBuf,
    /// Go on from the checkpoint in the run folder.
    pub resume: bool,
}

/// Runs a scene and writes its run folder.
///
/// # Errors
/// [`Error`]; see [`Error::is_bad_input`] for whose fault it is. Files that were written before the error stay.
pub fn run(loaded: &LoadedScene, options: &RunOptions, progress: &dyn Progress) -> Result<Report, Error> {
    run_with(loaded, options, Request::of(loaded)?, progress)
}

/// As [`run`], on a GPU that the caller opened, whatever the scene says of backend and adapter: for many runs on one device,
/// or a device with other options.
///
/// # Errors
/// As [`run`].
#[cfg(feature = "gpu")]
pub fn run_on(
    gpu: &cutis_gpu::Gpu,
    loaded: &LoadedScene,
    options: &RunOptions,
    progress: &dyn Progress,
) -> Result<Report, Error> {
    run_with(loaded, options, Request::opened(gpu), progress)
}

fn run_with(
    loaded: &LoadedScene,
    options: &RunOptions,
    request: Request,
    progress: &dyn Progress,
) -> Result<Report, Error> {
    let mut clock = Clock::new(progress);
    let folder = RunFolder(options.out.clone());
    let Prepared { source, body, matter, backend, mut plan } = plan::prepare(loaded, request, &mut clock)?;
    let (mut motion, device) = start(loaded, &body, matter, &backend, &mut clock)?;
    let place = if device.is_some() { "gpu" } else { "cpu" };
    files::create_folder(&folder.0)?;
    plan.warnings.iter().for_each(|warning| progress.note(warning));
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
    let frames = loaded.scene.run.frames;
    let mut resumed = None;
    if options.resume {
        let saved = Checkpoint::read(&folder.checkpoint(), &fingerprint, rest.len())?;
        if saved.frame > frames {
            let why = format!("it is at frame {}, and run.frames = {frames} lies before it", saved.frame);
            return Err(Error::Checkpoint { path: folder.checkpoint(), why });
        }
        motion.restore(&saved)?;
        resumed = Some(saved.frame);
    }
    let timing = match (loaded.scene.output.report, motion.waits()) {
        (false, _) => Timing::No,
        (true, true) => Timing::Throughout,
        (true, false) => Timing::OneMore,
    };
    let course = Course {
        run: &loaded.scene.run,
        folder: &folder,
        fingerprint,
        gapes: &body.cut.gapes,
        resumed,
        timing,
    };
    let todo = u64::from(frames.saturating_sub(course.done()));
    let Finish { rows, end, times } =
        clock.stage_on(place, "simulate", todo, |progress| course.run(&mut *motion, progress))?;
    // The body's memory on the device is free for the stages that follow.
    drop(motion);
    end.warnings.iter().for_each(|warning| progress.note(warning));
    plan.warnings.extend(end.warnings);
    let deformed = end.positions;

    let outcome = Outcome { loaded, source: &source, body: &body, deformed: &deformed, folder: &folder };
    let mut stages = Stages::on(device.as_ref().map(Metered::gpu));
    let products = output::write(&outcome, &mut stages, &mut clock)?;
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
    let crossed = crossed_lips(&wounds);
    crossed.iter().for_each(|warning| progress.note(warning));
    plan.warnings.extend(crossed);
    let moved = rest.iter().zip(&deformed).map(|(a, b)| f64::from((b - a).norm()) * 1e3);
    let max_displacement_mm = moved.fold(0.0, f64::max);
    let border_displacement_mm = body.border_displacement_mm(&deformed);
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
        device_memory: plan.device_memory,
        costs: times.enter(plan.costs),
        device: device.as_ref().map(Metered::work),
        stages: clock.stages.clone(),
        frames: frame_times(&rows),
        wound: wounds.first().cloned(),
        wounds,
        resample: products.resample.clone(),
        chainmail: end.chainmail,
        residuals: end.residuals,
        max_displacement_mm,
        border_displacement_mm,
        left_out: plan.left_out,
        warnings: plan.warnings.into_iter().chain(products.warnings.iter().cloned()).collect(),
    };
    if loaded.scene.output.report {
        let earlier = if options.resume { earlier_frames(&folder, course.done())? } else { String::new() };
        files::write(&folder.frames(), frames_csv(&earlier, &rows).as_bytes())?;
        output::write_html(&report, &rows, &products, &folder)?;
        report.write(&folder.report())?;
    }
    Ok(report)
}

/// Puts the body into motion; the device that it is on, if it is on one.
fn start<'a>(
    loaded: &LoadedScene,
    body: &'a Body,
    matter: Matter,
    backend: &Chosen,
    clock: &mut Clock<'_>,
) -> Result<(Box<dyn Motion + 'a>, Option<Metered>), Error> {
    match matter {
        Matter::Chain(chain) => {
            let started = if backend.on_gpu() {
                let start = |_: &dyn Progress| backend.start_chain(&chain.chain);
                clock.stage_on("gpu", "start the GPU", 0, start).map_err(loaded.blame("solver.backend"))?
            } else {
                None
            };
            let (relaxer, device) = started.unzip();
            let chained = Chained::new(loaded, *chain, body, backend.chain_threads(), relaxer);
            Ok((Box::new(chained.map_err(loaded.blame("solver.threads"))?), device))
        }
        Matter::Dynamics(dynamics) => {
            let Dynamics { system, settings, .. } = *dynamics;
            let running = if backend.on_gpu() {
                clock
                    .stage_on("gpu", "start the GPU", 0, |_| backend.start(system, settings))
                    .map_err(loaded.blame("solver.backend"))?
            } else {
                backend.start(system, settings).map_err(loaded.blame("solver"))?
            };
            let (solver, device) = running.into_parts();
            Ok((Box::new(Stepped { solver, on_device: device.is_some() }), device))
        }
    }
}

/// Wounds that are open the wrong way round: nothing keeps parts of a body out of each other.
fn crossed_lips(wounds: &[Wound]) -> Vec<String> {
    let least = wounds.iter().map(|wound| wound.final_mm.min(wound.mid_mm)).enumerate();
    let crossed = least.filter(|(_, least)| *least < 0.0);
    let told = crossed.map(|(n, least)| {
        format!(
            "the lips of incision[{n}] have passed through each other, by {:.2} mm: there is no contact",
            -least
        )
    });
    told.collect()
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Mutex;

    use super::*;
    use crate::Override;

    /// Keeps what is noted.
    #[derive(Default)]
    struct Notes(Mutex<Vec<String>>);

    impl Progress for Notes {
        fn begin(&self, _stage: &str, _total: u64) {}
        fn advance(&self, _done: u64) {}
        fn end(&self) {}
        fn note(&self, message: &str) {
            if let Ok(mut notes) = self.0.lock() {
                notes.push(message.into());
            }
        }
    }

    /// A run goes on from a body whose vertices all lie in one point, and is at its end: it says that nothing can act.
    #[test]
    fn a_body_that_ends_collapsed_is_told_of() {
        let folder = tempfile::tempdir().unwrap();
        let set = |(key, value): (&str, &str)| Override { key: key.into(), value: value.into() };
        let loaded = crate::demo(
            &[
                ("volume.phantom", "{ size = [48, 48, 32], seed = 1 }"),
                ("lattice.spacing_mm", "16.0"),
                ("solver.backend", "\"cpu\""),
                ("solver.substeps", "1"),
                ("run", "{ frames = 1, checkpoint_every = 1 }"),
                ("output", "{ report = true }"),
            ]
            .map(set),
        )
        .unwrap();
        let collapsed = |report: &Report| report.warnings.iter().any(|w| w.contains("have collapsed"));
        let options = RunOptions { out: folder.path().into(), resume: false };
        assert!(!collapsed(&run(&loaded, &options, &crate::Silent).unwrap()));

        let path = RunFolder(folder.path().into()).checkpoint();
        let bytes = fs::read(&path).unwrap();
        let fingerprint: [u8; 32] = bytes[8..40].try_into().unwrap();
        let count = u64::from_le_bytes(bytes[44..52].try_into().unwrap()) as usize;
        let mut saved = Checkpoint::read(&path, &fingerprint, count).unwrap();
        let place = saved.positions[0];
        saved.positions.fill(place);
        saved.write(&path, &fingerprint).unwrap();
        let notes = Notes::default();
        let resumed = RunOptions { resume: true, ..options };
        assert!(collapsed(&run(&loaded, &resumed, &notes).unwrap()));
        assert!(notes.0.lock().unwrap().iter().any(|note| note.contains("have collapsed")));
        let html = fs::read_to_string(RunFolder(folder.path().into()).html()).unwrap();
        assert!(html.contains("have collapsed"));
    }
}
