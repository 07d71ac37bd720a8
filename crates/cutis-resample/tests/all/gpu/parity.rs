//! The GPU gives the bits of its twin on every adapter that does not fuse operations. On any
//! adapter, each voxel and each count is allowed by the `f64` oracle.

use cutis_gpu::Gpu;
use cutis_resample::{
    ResampleError, ResampleReport, ResamplerGpu, ResamplerOptions, SlabState, resample, resample_gpu,
};
use cutis_resample_twin as twin;
use cutis_test_kit::gpu::{is_exact, on_each_adapter};
use cutis_volume::{Grid, Volume};

use super::oracle::Oracle;
use super::scenes::{self, Scene};

/// Slices per slab; no scene is divided evenly.
const SLAB: usize = 7;

fn options(scene: &Scene) -> ResamplerOptions {
    ResamplerOptions { slab_slices: Some(SLAB), ..ResamplerOptions::centered(&scene.warp()) }
}

/// The state of every slab and the number of inverted tets, with changed kernel sources.
fn on_gpu(gpu: &Gpu, scene: &Scene, change: &dyn Fn(String) -> String) -> (Vec<SlabState>, usize) {
    let mut resampler =
        ResamplerGpu::with_sources(gpu, &scene.volume, &scene.warp(), &options(scene), change).unwrap();
    resampler.resample(&scene.deformed).unwrap();
    let states = (0..resampler.slabs()).map(|slab| resampler.slab_state(slab).unwrap()).collect();
    (states, resampler.report().unwrap().inverted_tets)
}

fn by_twin(scene: &Scene) -> (Vec<SlabState>, usize) {
    let slices = scene.volume.grid().shape[2];
    let slab = |start| {
        let slab = start..slices.min(start + SLAB);
        twin::resample_slab(&scene.volume, &scene.warp(), &options(scene), slab).unwrap()
    };
    let (_, report) = twin::resample(&scene.volume, &scene.warp(), &options(scene)).unwrap();
    ((0..slices).step_by(SLAB).map(slab).collect(), report.inverted_tets)
}

#[test]
fn every_slab_has_the_bits_of_the_twin() {
    on_each_adapter(|gpu| {
        if !is_exact(gpu) {
            eprintln!("skipped: {} may fuse products and sums", gpu.adapter().name);
            return;
        }
        for mut scene in scenes::all() {
            let (found, expected) = (on_gpu(gpu, &scene, &|source| source), by_twin(&scene));
            assert!(found == expected, "{}", scene.name);
            let (_, report) = resample_gpu(gpu, &scene.volume, &scene.warp(), &|_, _| {}).unwrap();
            let (_, by_the_twin) = twin::resample(&scene.volume, &scene.warp(), &options(&scene)).unwrap();
            assert_eq!(report, by_the_twin, "{}", scene.name);

            let extent = scene.mesh.rest.iter().fold(0.0, |most: f32, p| most.max(p.coords.amax()));
            for p in scene.deformed.iter_mut().step_by(3) {
                p.y += 16.0 * f32::EPSILON * extent;
            }
            assert!(by_twin(&scene) != expected, "control: {} with vertices off by 16 roundings", scene.name);
        }
    });
}

/// Replacements of one operation each. The first text occurs in a source.
const MUTATIONS: &[(&str, &str)] = &[
    ("grid.yz * p.z", "grid.zy * p.z"),
    ("any(p != rest[v].xyz)", "all(p != rest[v].xyz)"),
    ("before < 0.0) <= 0.0", "before > 0.0) <= 0.0"),
    ("9.5367431640625e-7", "9.5367431640625e-4"),
    ("cross_3(ad, ab)", "cross_3(ab, ad)"),
    ("tolerance * vec4f(", "100.0 * tolerance * vec4f("),
    ("max(ceil(low) - region", "max(floor(low) - region"),
    ("vec3u(end) + vec3u(1u)", "vec3u(end)"),
    ("end > slab.first", "end > slab.first + 1u"),
    ("first < slab.first + slab.slices", "first + 1u < slab.first + slab.slices"),
    ("widen(chunk.list + 1u, left)", "widen(chunk.list + 1u, now)"),
    ("widen(chunk.list, now)", "widen(chunk.list, left)"),
    ("r / rows", "(r + 1u) / rows"),
    ("i < covered.end.x", "i + 1u < covered.end.x"),
    ("walk_rows(t, box_in_slab(tets[t]), lane, 64u)", "walk_rows(t, box_in_slab(tets[t]), lane, 65u)"),
    ("at += groups.x", "at += groups.x + 1u"),
    ("select(key | NEAR, key,", "select(key, key,"),
    ("t < chunk.body &&", "true &&"),
    ("all(height > tet.near)", "all(height > tet.rounding)"),
    ("2u * plane()", "plane()"),
    ("fraction * (b - a)", "1.001 * fraction * (b - a)"),
    ("f.z) + 0.5", "f.z) + 0.499"),
    ("ab * share.y + ac * share.z", "ab * share.z + ac * share.y"),
    ("select(sum, tet.volume, held)", "sum"),
    ("padding < 8u", "padding < 7u"),
    ("16u * half", "16u * (1u - half)"),
    ("folds += mark(1u, voxel)", "folds += mark(0u, voxel)"),
];

#[test]
fn every_mutation_of_the_kernels_is_detected() {
    on_each_adapter(|gpu| {
        if !is_exact(gpu) {
            return;
        }
        let scenes: Vec<_> = scenes::all().into_iter().map(|scene| (by_twin(&scene), scene)).collect();
        for (from, to) in MUTATIONS {
            let used = std::cell::Cell::new(false);
            let change = |source: String| {
                used.set(used.get() || source.contains(from));
                source.replace(from, to)
            };
            let detected = scenes.iter().find(|(expected, scene)| on_gpu(gpu, scene, &change) != *expected);
            eprintln!("{to}: {:?}", detected.map(|(_, scene)| scene.name));
            assert!(used.get(), "no kernel contains {from}");
            assert!(detected.is_some(), "{from} → {to}");
        }
    });
}

type Resampled = (Volume, ResampleReport);

fn through_twin(scene: &Scene) -> Resampled {
    twin::resample(&scene.volume, &scene.warp(), &options(scene)).unwrap()
}

fn through_gpu(gpu: &Gpu, scene: &Scene) -> Resampled {
    resample_gpu(gpu, &scene.volume, &scene.warp(), &|_, _| {}).unwrap()
}

/// Each voxel and each count must be one that `f64` allows, and vertices that are off by 0.02 mm
/// must be detected.
fn assert_allowed(run: impl Fn(&Scene) -> Resampled) {
    for mut scene in scenes::all() {
        let oracle = Oracle::new(&scene);
        eprintln!("{}: {} ambiguous voxels", scene.name, oracle.ambiguous);
        let (volume, report) = run(&scene);
        assert_eq!(oracle.objection(&volume, &report), None, "{}", scene.name);
        for p in scene.deformed.iter_mut().step_by(3) {
            p.x += 2e-5;
        }
        let (volume, report) = run(&scene);
        assert!(oracle.objection(&volume, &report).is_some(), "control: {}", scene.name);
    }
}

#[test]
fn the_twin_gives_voxels_and_counts_that_f64_allows() {
    assert_allowed(through_twin);
}

#[test]
fn the_gpu_gives_voxels_and_counts_that_f64_allows() {
    on_each_adapter(|gpu| assert_allowed(|scene| through_gpu(gpu, scene)));
}

/// The result differs from the CPU's by roundings only. Where `exact`, no scene has a difference of
/// more than 1.
fn assert_near_cpu(exact: bool, run: impl Fn(&Scene) -> Resampled) {
    for scene in scenes::near() {
        let (on_cpu, report_on_cpu) = resample(&scene.volume, &scene.warp(), &|_, _| {}).unwrap();
        let oracle = Oracle::new(&scene);
        assert_eq!(oracle.objection(&on_cpu, &report_on_cpu), None, "{}", scene.name);
        let (volume, report) = run(&scene);
        let pairs = || volume.voxels().iter().zip(on_cpu.voxels());
        let apart = |least| pairs().filter(|(a, b)| a.abs_diff(**b) >= least).count();
        eprintln!("{}: {} voxels differ, {} by more than 1", scene.name, apart(1), apart(2));
        assert!(apart(2) <= if exact { 0 } else { oracle.ambiguous }, "{}", scene.name);
        if exact {
            assert_eq!(report, report_on_cpu, "{}", scene.name);
        }
    }
}

#[test]
fn the_twin_differs_from_the_cpu_by_roundings_only() {
    assert_near_cpu(true, through_twin);
}

#[test]
fn the_gpu_differs_from_the_cpu_by_roundings_only() {
    on_each_adapter(|gpu| assert_near_cpu(is_exact(gpu), |scene| through_gpu(gpu, scene)));
}

#[test]
fn a_volume_that_is_too_long_for_the_kernels_is_refused() {
    let scene = scenes::half_at_rest();
    let grid = Grid { shape: [1, 65_536, 1], affine: scene.volume.grid().affine };
    let long = Volume::new(grid, vec![0; 65_536], 1.0, 0.0).unwrap();
    let found = twin::resample(&long, &scene.warp(), &ResamplerOptions::default()).unwrap_err();
    assert!(matches!(found, ResampleError::TooLarge { limit: 65_535, .. }), "{found}");
}
