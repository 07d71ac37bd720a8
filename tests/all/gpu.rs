//! Scenes on a GPU: agreement with the CPU, kernels and readbacks, and the behavior when the device
//! is lost.

use std::path::Path;
use std::sync::Mutex;

use cutis::gpu::{Counters, Gpu, GpuOptions, Select};
use cutis::report::Report;
use cutis::solver::SolverError;
use cutis::volume::nifti;
use cutis::{Error, LoadedScene, Progress, RunOptions, Silent};
use cutis_test_kit::gpu::{is_exact, on_each_adapter};

use crate::scenes::{self, Run, SMALL, names, run_in, state_of};

const BARE: (&str, &str) = ("output", "{}");

/// The small phantom on a coarser lattice, because software devices are slow.
fn scene(set: &[(&str, &str)]) -> LoadedScene {
    scenes::scene(SMALL, &[&[("lattice.spacing_mm", "12")], set].concat())
}

/// Runs a scene on an open device.
pub fn run_on(gpu: &Gpu, folder: &Path, loaded: &LoadedScene, resume: bool) -> Result<Report, Error> {
    cutis::run_on(gpu, loaded, &RunOptions { out: folder.into(), resume }, &Silent)
}

/// Options that select the adapter of an open device.
fn options_of(gpu: &Gpu) -> GpuOptions {
    GpuOptions { select: Select::Index(gpu.adapter().index), ..GpuOptions::default() }
}

/// Positions and velocities in the checkpoint of a folder.
fn state(folder: &Path) -> Vec<f32> {
    let bytes = std::fs::read(folder.join("checkpoint.bin")).unwrap();
    let [positions, words] = state_of(&bytes);
    let values = [positions, words].concat();
    values.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

/// True if two runs agree. Software adapters must give the CPU's bits. Hardware may fuse a
/// multiplication and an addition, so its results may differ by 1e-5 of the body's size and of the
/// largest velocity.
pub fn agree(gpu: &Gpu, first: &Path, second: &Path) -> bool {
    let (first, second) = (state(first), state(second));
    if is_exact(gpu) {
        return first == second;
    }
    let near = |a: &[f32], b: &[f32]| {
        let extent = a.iter().fold(0.0_f32, |extent, x| extent.max(x.abs()));
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * extent)
    };
    assert_eq!(first.len(), second.len());
    let half = first.len() / 2;
    near(&first[..half], &second[..half]) && near(&first[half..], &second[half..])
}

#[test]
fn a_run_on_a_gpu_equals_the_run_on_the_cpu() {
    on_each_adapter(|gpu| {
        let handle = "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 20, 5], over_s = 0.1 }]";
        let cases: [&[(&str, &str)]; 3] = [
            &[("solver.formulation", "xpbd")],
            &[("solver.formulation", "pbd")],
            &[("solver.iterations", "3"), ("solver.substeps", "4"), ("handle", handle)],
        ];
        for case in cases {
            let small = |more: &[(&str, &str)]| {
                scene(&[&[BARE, ("run.frames", "4"), ("run.checkpoint_every", "4")], case, more].concat())
            };
            let [cpu, on_gpu, control] = [(); 3].map(|()| tempfile::tempdir().unwrap());
            run_in(cpu.path(), &small(&[]), false).unwrap();
            let report = run_on(gpu, on_gpu.path(), &small(&[]), false).unwrap();
            assert_eq!((report.backend.name.as_str(), report.frames.count), ("gpu", 4));
            assert!(agree(gpu, cpu.path(), on_gpu.path()), "{case:?}");
            run_on(gpu, control.path(), &small(&[("constraints.stc.rest_area_scale", "0.79")]), false)
                .unwrap();
            assert!(!agree(gpu, cpu.path(), control.path()), "{case:?}: the comparison sees a change of 1 %");
        }
    });
}

/// A run can resume from a checkpoint of the other backend.
#[test]
fn a_run_can_resume_on_the_other_backend() {
    on_each_adapter(|gpu| {
        let frames =
            |n| scene(&[("output", "{ report = true }"), ("run.frames", n), ("run.checkpoint_every", "3")]);
        let [whole, first, second] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        run_in(whole.path(), &frames("6"), false).unwrap();
        run_in(first.path(), &frames("3"), false).unwrap();
        assert_eq!(run_on(gpu, first.path(), &frames("6"), true).unwrap().frames.count, 3);
        run_on(gpu, second.path(), &frames("3"), false).unwrap();
        assert_eq!(run_in(second.path(), &frames("6"), true).unwrap().backend.name, "cpu");
        for halves in [&first, &second] {
            assert!(agree(gpu, whole.path(), halves.path()));
            let table = std::fs::read_to_string(halves.path().join("frames.csv")).unwrap();
            assert_eq!(table.lines().count(), 8, "{table}");
        }
    });
}

/// Constraint kinds that the scene does not name have no kernels.
#[test]
fn only_the_needed_kernels_are_built() {
    on_each_adapter(|gpu| {
        let kernels = |set: &[(&str, &str)]| {
            let folder = tempfile::tempdir().unwrap();
            let loaded = scene(&[&[BARE, ("run.frames", "1")], set].concat());
            let report = run_on(gpu, folder.path(), &loaded, false).unwrap();
            let parts: Vec<String> = report.device_memory.iter().map(|part| part.part.clone()).collect();
            (report.device.unwrap().kernels, parts)
        };
        let (all, parts) = kernels(&[]);
        assert_eq!(parts, ["vertices", "distance", "volume", "stc"]);
        let one = "{ distance = { youngs_modulus_pa = 5e3 } }";
        let two = "{ distance = { youngs_modulus_pa = 5e3 }, volume = { bulk_modulus_pa = 5e4 } }";
        let counts = [
            kernels(&[("constraints", "{}")]),
            kernels(&[("constraints", one)]),
            kernels(&[("constraints", two)]),
        ];
        let [none, one, two] = counts.each_ref().map(|(count, _)| *count);
        assert!(none < one && one < two && two < all, "{none} {one} {two} {all}");
        // Each kind adds two kernels: its projection and its residual.
        assert_eq!((two - one, all - two), (one - none, one - none));
        assert_eq!(counts[0].1, ["vertices"]);
        let handle = "[{ at_mm = [-40, 100, 0], radius_mm = 25, move_mm = [0, 20, 5] }]";
        let (with_handle, parts) = kernels(&[("handle", handle)]);
        assert!(with_handle > all && parts.iter().any(|part| part == "handles"));
        // Without a wound no kernel gathers its lips.
        let (closed, _) = kernels(&[("incision", "[]")]);
        assert!(closed < all, "{closed} {all}");
    });
}

/// A frame reads a check for finite numbers and the lips of the wounds. It does not read the whole
/// body.
#[test]
fn a_frame_reads_the_lips_only() {
    on_each_adapter(|gpu| {
        let read = |frames: &str, every: &str| {
            let before = gpu.counters();
            let set = [BARE, ("run.frames", frames), ("run.checkpoint_every", every)];
            let folder = tempfile::tempdir().unwrap();
            let report = run_on(gpu, folder.path(), &scene(&set), false).unwrap();
            let after = gpu.counters();
            let work = report.device.unwrap();
            let counted = (after.readback_bytes - before.readback_bytes, after.kernels - before.kernels);
            assert_eq!((work.readback_bytes, work.kernels), counted, "of this run, not of those before it");
            let vertices = report.sizes.vertices as u64;
            (after.submits - before.submits, after.readback_bytes - before.readback_bytes, vertices)
        };
        let (few, many) = (read("2", "0"), read("12", "0"));
        assert!((many.0 - few.0) <= 2 * 10, "a step, and a gathering of the lips: {few:?} {many:?}");
        let body = 16 * many.2;
        let per_frame = (many.1 - few.1) / 10;
        assert!(per_frame > 12 && per_frame < body / 20, "{per_frame} of {body} bytes");
        let saved = read("12", "1");
        assert!((saved.1 - many.1) / 12 >= body, "a checkpoint reads all of it: {saved:?} {many:?}");
    });
}

/// Destroys the device after a number of frames.
struct Loses<'a>(&'a Gpu, u64);

impl Progress for Loses<'_> {
    fn begin(&self, _stage: &str, _total: u64) {}
    fn advance(&self, done: u64) {
        if done == self.1 {
            self.0.lose();
        }
    }
    fn end(&self) {}
    fn note(&self, _message: &str) {}
}

#[test]
fn a_lost_device_leaves_the_last_checkpoint() {
    on_each_adapter(|gpu| {
        let loaded = |every| scene(&[BARE, ("run.frames", "6"), ("run.checkpoint_every", every)]);
        let [folder, whole, without] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        let lose = |gpu: &Gpu, folder: &Path, every| {
            let options = RunOptions { out: folder.into(), resume: false };
            cutis::run_on(gpu, &loaded(every), &options, &Loses(gpu, 3)).unwrap_err()
        };
        let error = lose(gpu, folder.path(), "2");
        let Error::Stopped { frame: 4, saved: Some((2, _)), source: SolverError::Device { time_s, .. } } =
            &error
        else {
            panic!("{error:?}")
        };
        assert!((time_s - 2.0 / 60.0).abs() < 1e-9, "the state that the checkpoint read: {time_s}");
        let text = error.to_string();
        for word in
            ["frame 4", "lost", gpu.adapter().name.as_str(), "checkpoint.bin", "--resume", "--backend cpu"]
        {
            assert!(text.contains(word), "no {word:?} in: {text}");
        }
        assert!(!error.is_bad_input());

        let resumed = run_in(folder.path(), &loaded("2"), true).unwrap();
        assert_eq!((resumed.frames.count, resumed.backend.name.as_str()), (4, "cpu"));
        run_in(whole.path(), &loaded("2"), false).unwrap();
        assert!(agree(gpu, whole.path(), folder.path()));

        // A run does not start on a lost device. If there is no checkpoint, the message says so.
        let error = run_on(gpu, without.path(), &loaded("2"), false).unwrap_err();
        assert!(!error.is_bad_input() && error.to_string().contains("lost"), "{error}");
        assert!(names(without.path()).is_empty());
        let again = Gpu::open(&options_of(gpu)).unwrap();
        let error = lose(&again, without.path(), "0");
        assert!(
            matches!(error, Error::Stopped { saved: None, .. })
                && error.to_string().contains("no checkpoint")
        );
        assert!(names(without.path()).is_empty());
    });
}

/// Voxels of the deformed CT in a folder.
fn deformed(folder: &Path) -> Vec<i16> {
    nifti::read(folder.join("deformed.nii.gz")).unwrap().volume.voxels().to_vec()
}

/// Share of voxels that differ by more than rounding.
pub fn share_differing(first: &[i16], second: &[i16]) -> f64 {
    let differing = first.iter().zip(second).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    differing as f64 / first.len() as f64
}

fn places(report: &Report, names: &[&str]) -> Vec<String> {
    let named = report.stages.iter().filter(|stage| names.contains(&stage.name.as_str()));
    named.map(|stage| stage.on.clone()).collect()
}

const STAGES: [&str; 3] = ["simulate", "resample the CT", "pictures"];

#[test]
fn the_ct_and_the_pictures_are_made_on_the_gpu() {
    on_each_adapter(|gpu| {
        let loaded = |output, scale| {
            scene(&[("output", output), ("run.frames", "3"), ("constraints.stc.rest_area_scale", scale)])
        };
        let (both, one) = ("{ volume = true, pictures = true }", "{ volume = true }");
        let [cpu, on_gpu, control] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        let expected = run_in(cpu.path(), &loaded(both, "0.8"), false).unwrap();
        let report = run_on(gpu, on_gpu.path(), &loaded(both, "0.8"), false).unwrap();
        run_on(gpu, control.path(), &loaded(one, "0.9"), false).unwrap();
        assert_eq!(
            (places(&report, &STAGES), places(&expected, &STAGES)),
            (vec!["gpu".into(); 3], vec!["cpu".into(); 3])
        );
        assert_eq!(names(on_gpu.path()), names(cpu.path()));
        let [cpu, on_gpu, control] = [&cpu, &on_gpu, &control].map(|folder| deformed(folder.path()));
        // The GPU looks up positions in single precision. A voxel on a face may fall into the
        // neighboring tetrahedron.
        let (found, noticed) = (share_differing(&cpu, &on_gpu), share_differing(&cpu, &control));
        assert!(
            found < 1e-4 && noticed > 20.0 * 1e-4,
            "{found} of the voxels differ, {noticed} of the control's"
        );
        let (a, b) = (expected.resample.unwrap(), report.resample.unwrap());
        let near = |a: u64, b: u64| a.abs_diff(b) as f64 <= 1e-4 * cpu.len() as f64;
        assert!(near(a.moved_voxels, b.moved_voxels) && near(a.folds, b.folds), "{a:?} {b:?}");
    });
}

/// Counters of a GPU when stages begin and end, each with the name of the stage.
struct Counts<'a>(&'a Gpu, Mutex<Vec<(String, Counters)>>);

impl Progress for Counts<'_> {
    fn begin(&self, stage: &str, _total: u64) {
        self.1.lock().unwrap().push((stage.to_owned(), self.0.counters()));
    }
    fn advance(&self, _done: u64) {}
    fn end(&self) {
        let mut counts = self.1.lock().unwrap();
        let name = format!("end of {}", counts.last().unwrap().0);
        counts.push((name, self.0.counters()));
    }
    fn note(&self, _message: &str) {}
}

/// After the simulation the GPU copies the positions for the resampler. The host uploads only the
/// shell of air around the body, and reads nothing but the resampled voxels.
#[test]
fn positions_stay_on_the_gpu_for_resampling() {
    on_each_adapter(|gpu| {
        let loaded = scene(&[("output", "{ volume = true }"), ("run.frames", "2")]);
        let folder = tempfile::tempdir().unwrap();
        let options = RunOptions { out: folder.path().into(), resume: false };
        let counts = Counts(gpu, Mutex::default());
        let report = cutis::run_on(gpu, &loaded, &options, &counts).unwrap();
        let counts = counts.1.into_inner().unwrap();
        let at = |name: &str| counts.iter().find(|(stage, _)| stage == name).unwrap().1;
        let [simulated, begun, done] =
            ["end of simulate", "resample the CT", "end of resample the CT"].map(at);
        let between = [
            begun.submits - simulated.submits,
            begun.writes - simulated.writes,
            begun.readbacks - simulated.readbacks,
        ];
        assert_eq!(between, [1, 1, 0], "one copy on the GPU, one upload of the shell, no read");
        let read = done.readback_bytes - begun.readback_bytes;
        let voxels = deformed(folder.path()).len() as u64;
        let positions = 12 * report.sizes.vertices as u64;
        assert!(read >= 2 * voxels && read < 2 * voxels + positions, "{read} bytes for {voxels} voxels");
    });
}

/// Destroys the device when a stage begins.
struct LosesAt<'a>(&'a Gpu, &'a str);

impl Progress for LosesAt<'_> {
    fn begin(&self, stage: &str, _total: u64) {
        if stage == self.1 {
            self.0.lose();
        }
    }
    fn advance(&self, _done: u64) {}
    fn end(&self) {}
    fn note(&self, _message: &str) {}
}

/// A finished simulation is kept. The CPU writes the outputs, and the report mentions it.
#[test]
fn a_device_lost_after_the_simulation_loses_no_results() {
    on_each_adapter(|gpu| {
        let loaded = scene(&[("output", "{ volume = true, pictures = true }"), ("run.frames", "1")]);
        let [whole, folder] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        run_in(whole.path(), &loaded, false).unwrap();
        let options = RunOptions { out: folder.path().into(), resume: false };
        let report = cutis::run_on(gpu, &loaded, &options, &LosesAt(gpu, "resample the CT")).unwrap();
        assert_eq!(places(&report, &STAGES), ["gpu", "cpu", "cpu"]);
        let said =
            report.warnings.iter().filter(|line| line.contains("ran on the CPU") && line.contains("lost"));
        assert_eq!(said.count(), 1, "{:?}", report.warnings);
        if is_exact(gpu) {
            assert!(deformed(whole.path()) == deformed(folder.path()));
        }
    });
}

/// Results are bit-identical with split colors and with the baseline limits of all devices.
#[test]
fn a_run_in_small_chunks_is_the_same() {
    on_each_adapter(|whole| {
        let loaded = scene(&[BARE, ("run.frames", "2"), ("run.checkpoint_every", "2")]);
        let expected = tempfile::tempdir().unwrap();
        run_on(whole, expected.path(), &loaded, false).unwrap();
        let options = GpuOptions { baseline_limits: true, chunk_cap: Some(200), ..options_of(whole) };
        let capped = Gpu::open(&options).unwrap();
        let folder = tempfile::tempdir().unwrap();
        run_on(&capped, folder.path(), &loaded, false).unwrap();
        assert!(capped.counters().dispatches > 2 * whole.counters().dispatches, "it was split");
        assert!(agree(whole, expected.path(), folder.path()));
    });
}

#[test]
fn a_cpu_run_reports_no_gpu() {
    for backend in ["cpu", "reference", "auto"] {
        let set = [BARE, ("run.frames", "1"), ("solver.backend", backend)];
        let report = Run::of(&scene(&set)).report;
        assert!(
            report.device.is_none() && report.device_memory.is_empty() && report.backend.adapter.is_none()
        );
        assert!(report.stages.iter().all(|stage| stage.on == "cpu"), "{:?}", report.stages);
        assert!(report.left_out.contains(&"gpu: no device is opened".to_owned()), "{:?}", report.left_out);
    }
}
