//! A real CT through a bending lattice: the GPU, its twin and the CPU.

use std::path::PathBuf;
use std::time::Instant;

use cutis_gpu::AdapterKind;
use cutis_resample::{ResamplerOptions, resample, resample_gpu, twin};
use cutis_volume::nifti;
use nalgebra::Vector3;

use crate::common::lattice;
use crate::gpu;
use crate::scenes::Scene;

/// The test data's folder, or `None` with a printed reason; in CI its absence is a failure.
fn data() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let folder = PathBuf::from(std::env::var_os("CUTIS_TEST_DATA").unwrap_or_else(|| beside.into()));
    if folder.join("ct").is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "no test data at {}", folder.display());
    eprintln!("skipped: no test data at {} (set CUTIS_TEST_DATA)", folder.display());
    None
}

#[test]
fn an_abdomen_is_the_same_but_for_roundings() {
    let Some(folder) = data() else { return };
    let Some(gpu) = gpu() else { return };
    let volume = nifti::read(folder.join("ct/abdomen_ts_122x101x112.nii.gz")).unwrap().volume;
    let grid = *volume.grid();
    let mesh = lattice(&grid, [60, 50, 55], [2.0; 3], grid.shape.map(|n| n as f64 - 5.0));
    let mut scene = Scene::new("abdomen", volume, mesh).moved(|p| {
        let wave = |x: f64| (12.0 * x).sin();
        p + Vector3::new(wave(p.y), 0.6 * wave(p.z), 0.4 * wave(p.x)) * 0.008
    });
    // The cells of the lattice's last slices were cut away, the slices before them are a shell.
    scene.removed = scene.mesh.tets.split_off(6 * 60 * 50 * 52);
    scene.body_tets = 6 * 60 * 50 * 48;

    let started = Instant::now();
    let (found, report) = resample_gpu(&gpu, &scene.volume, &scene.warp(), &|_, _| {}).unwrap();
    let by_gpu = started.elapsed();
    let (of_cpu, report_of_cpu) = resample(&scene.volume, &scene.warp(), &|_, _| {}).unwrap();
    let by_cpu = started.elapsed() - by_gpu;
    let apart: Vec<u16> = found.voxels().iter().zip(of_cpu.voxels()).map(|(a, b)| a.abs_diff(*b)).collect();
    let more_than = |hu: u16| apart.iter().filter(|&&apart| apart > hu).count();
    eprintln!(
        "{}: {} of {} voxels differ from the CPU's, {} by more than 1; {by_gpu:?}, CPU {by_cpu:?}\n{report:?}\n{report_of_cpu:?}",
        gpu.adapter().name,
        more_than(0),
        apart.len(),
        more_than(1),
    );
    // One of 256 places in a step between voxels rounds otherwise, for steps of up to 2000 HU and an error of 10⁻⁴ voxels.
    assert!(more_than(0) * 256 < apart.len());
    // More than that only where one has air: a center within the rounding of the body's surface, some 70 000 voxel faces large.
    let lowest = found.voxels().iter().copied().min().unwrap_or(0);
    let air = lowest.max(-1024);
    for ((&a, &b), &apart) in found.voxels().iter().zip(of_cpu.voxels()).zip(&apart) {
        assert!(apart <= 1 || a == air || b == air, "{a} instead of {b}");
    }
    assert!(more_than(1) < 20);
    assert_eq!(report.inverted_tets, report_of_cpu.inverted_tets);

    if gpu.adapter().kind == AdapterKind::Software {
        let options = ResamplerOptions::centerd(&scene.warp());
        let (of_twin, report_of_twin) = twin::resample(&scene.volume, &scene.warp(), &options).unwrap();
        assert!(of_twin == found && report_of_twin == report);
    }
}
