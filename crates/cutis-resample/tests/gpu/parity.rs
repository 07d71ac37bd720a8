//! The GPU and its twin give the same bits on every adapter that computes as written; on any, each voxel and each count is one
//! that `f64` allows.

use cutis_gpu::{AdapterKind, Gpu};
use cutis_resample::{ResamplerGpu, ResamplerOptions, SlabState, resample, resample_gpu, twin};

use crate::gpu;
use crate::oracle::Oracle;
use crate::scenes::{self, Scene};

/// Slabs that no scene's slices fill evenly.
const SLAB: usize = 7;

fn options(scene: &Scene) -> ResamplerOptions {
    ResamplerOptions { slab_slices: Some(SLAB), ..ResamplerOptions::centred(&scene.warp()) }
}

/// State of every slab and number of inverted tets, by kernels with changed sources.
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
fn every_slab_is_the_twins_bit_for_bit() {
    let Some(gpu) = gpu() else { return };
    if gpu.adapter().kind != AdapterKind::Software {
        eprintln!("skipped: {} may contract products and sums", gpu.adapter().name);
        return;
    }
    for mut scene in scenes::all() {
        let (found, expected) = (on_gpu(&gpu, &scene, &|source| source), by_twin(&scene));
        assert!(found == expected, "{}", scene.name);
        let (_, report) = resample_gpu(&gpu, &scene.volume, &scene.warp(), &|_, _| {}).unwrap();
        let (_, of_twin) = twin::resample(&scene.volume, &scene.warp(), &options(&scene)).unwrap();
        assert_eq!(report, of_twin, "{}", scene.name);

        let extent = scene.mesh.rest.iter().fold(0.0, |most: f32, p| most.max(p.coords.amax()));
        for p in scene.deformed.iter_mut().step_by(3) {
            p.y += 16.0 * f32::EPSILON * extent;
        }
        assert!(by_twin(&scene) != expected, "control: {} with vertices off by 16 roundings", scene.name);
    }
}

/// A change of one operation each, in a part of a source that occurs once.
const MUTATIONS: &[(&str, &str)] = &[
    ("grid.yz * p.z", "grid.zy * p.z"),
    ("any(p != rest[v].xyz)", "all(p != rest[v].xyz)"),
    ("before < 0.0) <= 0.0", "before > 0.0) <= 0.0"),
    ("9.5367431640625e-7", "9.5367431640625e-4"),
    ("cross_3(ad, ab)", "cross_3(ab, ad)"),
    ("tolerance * vec4f(", "100.0 * tolerance * vec4f("),
    ("max(ceil(low) - region", "max(floor(low) - region"),
    ("vec3u(end) + vec3u(1u)", "vec3u(end)"),
    ("(span >> 16u) > slab.first", "(span >> 16u) > slab.first + 1u"),
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
fn every_mutation_of_the_kernels_is_seen() {
    let Some(gpu) = gpu() else { return };
    if gpu.adapter().kind != AdapterKind::Software {
        return;
    }
    let scenes: Vec<_> = scenes::all().into_iter().map(|scene| (by_twin(&scene), scene)).collect();
    for (from, to) in MUTATIONS {
        let used = std::cell::Cell::new(false);
        let change = |source: String| {
            used.set(used.get() || source.contains(from));
            source.replace(from, to)
        };
        let seen = scenes.iter().find(|(expected, scene)| on_gpu(&gpu, scene, &change) != *expected);
        eprintln!("{to}: {:?}", seen.map(|(_, scene)| scene.name));
        assert!(used.get(), "no kernel has {from}");
        assert!(seen.is_some(), "{from} → {to}");
    }
}

#[test]
fn every_voxel_and_count_is_one_that_f64_allows() {
    let Some(gpu) = gpu() else { return };
    for mut scene in scenes::all() {
        let oracle = Oracle::new(&scene);
        let run = |scene: &Scene| resample_gpu(&gpu, &scene.volume, &scene.warp(), &|_, _| {}).unwrap();
        let (volume, report) = run(&scene);
        eprintln!("{}: {} voxels, {} of them ambiguous", scene.name, volume.voxels().len(), oracle.ambiguous);
        assert_eq!(oracle.objection(&volume, &report), None, "{}", scene.name);

        for p in scene.deformed.iter_mut().step_by(3) {
            p.x += 2e-5;
        }
        let (volume, report) = run(&scene);
        let objection = oracle.objection(&volume, &report);
        assert!(objection.is_some(), "control: {} with vertices off by 0.02 mm", scene.name);
    }
}

#[test]
fn the_cpu_gives_nearly_the_same() {
    let Some(gpu) = gpu() else { return };
    for scene in scenes::near() {
        let (volume, report) = resample_gpu(&gpu, &scene.volume, &scene.warp(), &|_, _| {}).unwrap();
        let (of_cpu, report_of_cpu) = resample(&scene.volume, &scene.warp(), &|_, _| {}).unwrap();
        let oracle = Oracle::new(&scene);
        assert_eq!(oracle.objection(&of_cpu, &report_of_cpu), None, "{}", scene.name);
        let apart = |least| {
            volume.voxels().iter().zip(of_cpu.voxels()).filter(|(a, b)| a.abs_diff(**b) >= least).count()
        };
        eprintln!("{}: {} voxels differ, {} by more than 1; {report:?}", scene.name, apart(1), apart(2));
        assert!(apart(2) <= oracle.ambiguous, "{}", scene.name);
        assert_eq!(report.inverted_tets, report_of_cpu.inverted_tets, "{}", scene.name);
    }
}
