//! A run of a scene, from the NIfTI file to the pictures.
//!
//! [`run_with`] contains all steps. [`prepare`](prepare::prepare) reads the CT ([`ct`](crate::ct)),
//! builds the body ([`body`](crate::body)) and its model ([`model`](crate::model)).
//! [`simulate`](simulate::simulate) computes the frames. [`output::write`] deforms the CT and draws
//! it, and [`summary::report`] collects the report.

pub(crate) mod checkpoint;
pub(crate) mod clock;
mod date;
pub(crate) mod files;
pub(crate) mod frames;
mod history;
pub(crate) mod other_scene;
mod peak_memory;
pub(crate) mod prepare;
pub(crate) mod rests;
mod run_loop;
mod series;
mod simulate;
mod stops;
mod summary;
mod timing;

use std::path::PathBuf;

use crate::backend::{DeviceMeter, Request, Stages};
use crate::body::Membrane;
use crate::output::report::Report;
use crate::output::{self, DeformedBody};
use crate::scene::LoadedScene;
use crate::{Error, Progress};

use checkpoint::Checkpoint;
use clock::Clock;
use files::RunFolder;
use prepare::prepare;
use simulate::simulate;

/// How to run a scene.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Run folder; it is created if it does not exist.
    pub out: PathBuf,
    /// Whether to resume from the checkpoint in the run folder. Without one the run begins at its
    /// first frame if it writes checkpoints itself, and is refused otherwise.
    pub resume: bool,
}

/// Runs a scene and writes its run folder.
///
/// # Errors
/// [`Error`]. [`Error::is_bad_input`] tells bad input from a failed run. Files that were written
/// before the error stay.
pub fn run(loaded: &LoadedScene, options: &RunOptions, progress: &dyn Progress) -> Result<Report, Error> {
    run_with(loaded, options, Request::of(loaded)?, progress)
}

/// Does the same as [`run`] on a GPU that the caller opened. It ignores the scene's backend and
/// adapter. Use it for many runs on one device, or for a device with other options.
///
/// # Errors
/// The errors of [`run`].
#[cfg(feature = "gpu")]
pub fn run_on(
    gpu: &cutis_gpu::Gpu,
    loaded: &LoadedScene,
    options: &RunOptions,
    progress: &dyn Progress,
) -> Result<Report, Error> {
    run_with(loaded, options, Request::opened(gpu), progress)
}

/// The whole run: NIfTI file -> body -> model -> frames -> outputs -> report.
fn run_with(
    loaded: &LoadedScene,
    options: &RunOptions,
    request: Request,
    progress: &dyn Progress,
) -> Result<Report, Error> {
    let (mut clock, folder) = (Clock::new(progress), RunFolder(options.out.clone()));
    files::check_writable(&folder.0)?;
    folder.remove_abandoned(progress);
    if options.resume && loaded.scene.run.checkpoint_every == 0 {
        Checkpoint::find(&folder.checkpoint())?;
    }
    let prepare::Prepared { source, body, model, backend, plan } = prepare(loaded, request, &mut clock)?;
    let setup = simulate::Setup { loaded, options, folder: &folder, source: &source, body: &body };
    let simulated = simulate(&setup, model, &backend, plan, &mut clock)?;
    let has_lines = body.membrane.as_ref().is_some_and(Membrane::has_lines);
    let removed = folder.remove_earlier(&loaded.scene.output, has_lines)?;
    if !removed.is_empty() {
        progress.note(&format!(
            "removed the files of an earlier run from {}: {}",
            folder.0.display(),
            removed.join(", ")
        ));
    }
    let deformed = DeformedBody {
        body: &body,
        positions: &simulated.result.end.positions,
        on_device: simulated.result.on_device.as_ref(),
        ct: &source.volume,
        scene: &loaded.scene,
    };
    let mut stages = Stages::on(simulated.device.as_ref().map(DeviceMeter::gpu).cloned());
    let outputs = output::write(&deformed, &loaded.scene.output, &folder, &mut stages, &mut clock)?;
    summary::report(&setup, simulated, outputs, clock)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Mutex;

    use super::*;
    use crate::Override;

    /// Keeps all notes.
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

    /// A run resumes at its last frame from a body whose vertices all lie in one point. Its
    /// constraints cannot act, and the report says so.
    #[test]
    fn a_collapsed_body_is_reported() {
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

    /// States of the surface are kept for the report, and only for it.
    #[test]
    fn a_run_without_a_report_keeps_no_states() {
        let kept = |output: &str| {
            let here = tempfile::tempdir().unwrap();
            let set = |(key, value): (&str, &str)| Override { key: key.into(), value: value.into() };
            let keys = [
                ("volume.phantom", "{ size = [48, 48, 32], seed = 1 }"),
                ("lattice.spacing_mm", "16.0"),
                ("solver.backend", "\"cpu\""),
                ("run", "{ frames = 2 }"),
                ("output", output),
            ];
            let loaded = crate::demo(&keys.map(set)).unwrap();
            let mut clock = Clock::new(&crate::Silent);
            let request = Request::of(&loaded).unwrap();
            let prepare::Prepared { source, body, model, backend, plan } =
                prepare(&loaded, request, &mut clock).unwrap();
            let options = RunOptions { out: here.path().into(), resume: false };
            let folder = RunFolder(options.out.clone());
            let setup = simulate::Setup {
                loaded: &loaded,
                options: &options,
                folder: &folder,
                source: &source,
                body: &body,
            };
            let simulated = simulate(&setup, model, &backend, plan, &mut clock).unwrap();
            simulated.recorder.map(|recorder| recorder.states.len())
        };
        assert_eq!(kept("{ report = true }"), Some(3));
        assert_eq!(kept("{ volume = true, surface = true, pictures = true }"), None);
    }

    /// Whether the voxel 90 mm in front of the middle of a volume is air.
    fn is_hollow(path: &std::path::Path) -> bool {
        let volume = cutis_volume::nifti::read(path).unwrap().volume;
        let from_middle = |voxel: &usize| {
            let at = volume.grid().mm(volume.grid().point(*voxel));
            (at - nalgebra::Point3::new(0.0, 90.0, 0.0)).norm()
        };
        let voxels = 0..volume.voxels().len();
        let nearest = voxels.min_by(|a, b| from_middle(a).total_cmp(&from_middle(b))).unwrap();
        let hu = volume.voxels()[nearest];
        assert!(!(-900..=-449).contains(&hu), "{hu} HU");
        hu < -900
    }

    /// A piece of the small body that is taken out in the second frame.
    fn with_piece_out(run: &str, output: &str) -> LoadedScene {
        let set = |(key, value): (&str, &str)| Override { key: key.into(), value: value.into() };
        let outline = "[[-40, 110, -40], [40, 110, -40], [40, 110, 40], [-40, 110, 40], [-40, 110, -40]]";
        let lesion = format!("[{{ path_mm = {outline}, depth_mm = 40, at_s = 0.01 }}]");
        let keys = [
            ("volume.phantom", "{ size = [48, 48, 32], seed = 1 }"),
            ("lattice.spacing_mm", "12.0"),
            ("solver.backend", "\"cpu\""),
            ("incision", "[]"),
            ("excision", &lesion),
            ("run", run),
            ("output", output),
        ];
        crate::demo(&keys.map(set)).unwrap()
    }

    /// The body settles before and after a piece is taken out, and the volume is that after it.
    #[test]
    fn a_body_at_rest_is_resampled_without_what_was_taken_out() {
        let folder = tempfile::tempdir().unwrap();
        let mut loaded = with_piece_out("{ frames = 0, until = \"rest\" }", "{ volume = true }");
        let hollow = |loaded: &LoadedScene| {
            let options = RunOptions { out: folder.path().into(), resume: false };
            run(loaded, &options, &crate::Silent).unwrap();
            is_hollow(&RunFolder(folder.path().into()).volume())
        };
        assert!(hollow(&loaded));
        // Control: without the excision the place is not hollow.
        loaded.scene.excision.clear();
        assert!(!hollow(&loaded));
    }

    /// The checkpoint of an interrupted run is resampled with a piece that is taken out later in
    /// its place. Control: at the end of the run it is out.
    #[test]
    fn a_piece_is_resampled_until_it_is_taken_out() {
        let folder = tempfile::tempdir().unwrap();
        let loaded = with_piece_out("{ frames = 2, checkpoint_every = 1 }", "{}");
        run(&loaded, &RunOptions { out: folder.path().into(), resume: false }, &crate::Silent).unwrap();
        let path = RunFolder(folder.path().into()).checkpoint();
        let bytes = fs::read(&path).unwrap();
        let fingerprint: [u8; 32] = bytes[8..40].try_into().unwrap();
        let count = u64::from_le_bytes(bytes[44..52].try_into().unwrap()) as usize;
        let saved = Checkpoint::read(&path, &fingerprint, count).unwrap();
        let is_out = |frame: u32| {
            Checkpoint { frame, ..saved.clone() }.write(&path, &fingerprint).unwrap();
            let out = folder.path().join("out.nii.gz");
            let input = crate::ResampleInput::Volume(None);
            let request = crate::ResampleRequest { run: folder.path().into(), input, out: out.clone() };
            crate::resample_run(&loaded, &request, &crate::Silent).unwrap();
            is_hollow(&out)
        };
        assert!(!is_out(1) && is_out(2));
    }
}
