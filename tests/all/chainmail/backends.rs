//! A chain gives the same bits on any number of threads and on a GPU.

use cutis::gpu::Gpu;
use cutis_test_kit::gpu::on_each_adapter;

use super::*;
use crate::gpu::{run_on, share_differing};

const FILES: [&str; 3] = ["checkpoint.bin", "deformed.nii.gz", "skin.vtu"];

/// Two cuts at different times: with a width, and without one.
const CUTS: [&str; 2] = [
    "[{ from_mm = [0, 110, -50], to_mm = [0, 110, 50], depth_mm = 25, width_mm = 9, at_s = 0.25 },
      { from_mm = [50, 105, -25], to_mm = [50, 105, 25], depth_mm = 25, width_mm = 9 }]",
    "[{ from_mm = [0, 110, -50], to_mm = [0, 110, 50], depth_mm = 25, at_s = 0.125, speed_mm_s = 250 },
      { from_mm = [50, 105, -25], to_mm = [50, 105, 25], depth_mm = 25 }]",
];

/// Two cuts, one handle that tissue can follow, and one that it cannot.
fn busy(incisions: &str, set: &[(&str, &str)]) -> LoadedScene {
    let handles = "[{ at_mm = [-15, 105, 0], radius_mm = 11, move_mm = [-18, 0, 3], over_s = 0.5 },
        { at_mm = [65, 98, 0], radius_mm = 11, move_mm = [150, 20, 0], over_s = 0.375 }]";
    let common = [
        ("incision", incisions),
        ("handle", handles),
        ("chainmail.relax_per_frame", "4"),
        ("output", "{ volume = true, surface = true }"),
    ];
    chain(&[&common, set].concat())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    for cuts in CUTS {
        let run = |set: &[(&str, &str)]| Run::of(&busy(cuts, set));
        let one = run(&[("solver.threads", "1")]);
        let chainmail = one.report.chainmail.clone();
        assert!(
            chainmail
                .as_ref()
                .is_some_and(|chainmail| chainmail.violated_links > 0 && chainmail.relax_moves > 1000)
        );
        for (backend, threads) in [("cpu", "2"), ("cpu", "3"), ("cpu", "8"), ("reference", "0")] {
            let other = run(&[("solver.backend", backend), ("solver.threads", threads)]);
            assert_eq!(other.report.backend.name, backend);
            assert!(FILES.iter().all(|file| one.bytes(file) == other.bytes(file)), "{backend} {threads}");
            assert_eq!(other.report.chainmail, chainmail, "{backend} {threads}");
        }
        // Negative control: one sweep less per frame changes the result.
        let control = run(&[("chainmail.relax_per_frame", "3")]);
        assert!(one.state() != control.state() && one.bytes("skin.vtu") != control.bytes("skin.vtu"));
    }
}

/// This holds on any device, because ChainMail computes with integers.
#[test]
fn a_gpu_gives_the_same_bits() {
    on_each_adapter(|gpu| CUTS.iter().for_each(|cuts| compare(gpu, cuts)));
}

/// Compares a run on a GPU with one on the CPU.
fn compare(gpu: &Gpu, cuts: &str) {
    let (loaded, folder) = (busy(cuts, &[]), tempfile::tempdir().unwrap());
    let cpu = Run::of(&loaded);
    let report = run_on(gpu, folder.path(), &loaded, false).unwrap();
    assert_eq!((report.backend.name.as_str(), &report.chainmail), ("gpu", &cpu.report.chainmail));
    assert_eq!(report.device_memory.len(), 1);
    let read = |file: &str| std::fs::read(folder.path().join(file)).unwrap();
    for file in ["checkpoint.bin", "skin.vtu"] {
        assert!(cpu.bytes(file) == read(file), "{file}");
    }
    // The GPU looks up the tetrahedron of a voxel in single precision.
    let found = nifti::read(folder.path().join("deformed.nii.gz")).unwrap().volume;
    assert!(share_differing(cpu.deformed().voxels(), found.voxels()) < 1e-4);
    // Half of the run is on the GPU and half on the CPU. Without resampling the device only
    // relaxes the chain.
    let other = tempfile::tempdir().unwrap();
    let mut half = first(3, &loaded);
    half.scene.output.volume = false;
    let report = run_on(gpu, other.path(), &half, false).unwrap();
    assert!(report.device.is_some_and(|device| device.submits > 0));
    scenes::run_in(other.path(), &loaded, true).unwrap();
    assert!(std::fs::read(other.path().join("checkpoint.bin")).unwrap() == cpu.bytes("checkpoint.bin"));
}
