//! A real CT through a bent lattice: the GPU compared with its twin and with the CPU.

use std::time::Instant;

use cutis_resample::{ResamplerOptions, resample, resample_gpu};
use cutis_resample_twin as twin;
use cutis_test_kit::gpu::{is_exact, on_each_adapter};
use cutis_test_kit::scans;
use cutis_volume::nifti;
use nalgebra::Vector3;

use super::scenes::Scene;
use crate::bodies::lattice;

#[test]
fn an_abdomen_differs_by_roundings_only() {
    let Some(path) = scans::find("ct/abdomen_ts_122x101x112.nii.gz") else { return };
    let volume = nifti::read(path).unwrap().volume;
    let grid = *volume.grid();
    let mesh = lattice(&grid, [60, 50, 55], [2.0; 3], grid.shape.map(|n| n as f64 - 5.0));
    let mut scene = Scene::new("abdomen", volume, mesh).moved(|p| {
        let wave = |x: f64| (12.0 * x).sin();
        p + Vector3::new(wave(p.y), 0.6 * wave(p.z), 0.4 * wave(p.x)) * 0.008
    });
    // The cells of the last slices are removed; the slices before them are a shell.
    scene.removed = scene.mesh.tets.split_off(6 * 60 * 50 * 52);
    scene.body_tets = 6 * 60 * 50 * 48;
    let started = Instant::now();
    let (on_cpu, report_on_cpu) = resample(&scene.volume, &scene.warp(), &|_, _| {}).unwrap();
    eprintln!("CPU: {:?}, {report_on_cpu:?}", started.elapsed());
    let air = on_cpu.voxels().iter().copied().min().unwrap_or(0).max(-1024);

    on_each_adapter(|gpu| {
        let started = Instant::now();
        let (found, report) = resample_gpu(gpu, &scene.volume, &scene.warp(), &|_, _| {}).unwrap();
        let elapsed = started.elapsed();
        let pairs = || found.voxels().iter().zip(on_cpu.voxels());
        let more_than = |hu: u16| pairs().filter(|(a, b)| a.abs_diff(**b) > hu).count();
        eprintln!("{}: {elapsed:?}, {report:?}", gpu.adapter().name);
        eprintln!("{} of {} voxels differ, {} by more than 1", more_than(0), grid.len(), more_than(1));
        // One of 256 places between voxels rounds differently, for steps of up to 2000 HU and an
        // error of 10⁻⁴ voxels.
        assert!(more_than(0) * 256 < grid.len());
        // Larger differences occur only where one result is air: at centers within the rounding of
        // the surface of the body, which has about 70 000 voxel faces.
        for (&a, &b) in pairs() {
            assert!(a.abs_diff(b) <= 1 || a == air || b == air, "{a} instead of {b}");
        }
        assert!(more_than(1) < 20);
        assert_eq!(report.inverted_tets, report_on_cpu.inverted_tets);

        if is_exact(gpu) {
            let options = ResamplerOptions::centered(&scene.warp());
            let (by_twin, report_by_twin) = twin::resample(&scene.volume, &scene.warp(), &options).unwrap();
            assert!(by_twin == found && report_by_twin == report);
        }
    });
}
