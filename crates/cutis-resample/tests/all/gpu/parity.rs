//! The GPU and its twin give the same bits on every adapter that computes as written; on any, each voxel and each count is one
//! that `f64` allows.

use cutis_gpu::{AdapterKind, Gpu};
use cutis_resample::{
    ResampleError, ResampleReport, ResamplerGpu, ResamplerOptions, SlabDifference, SlabState, resample,
    resample_gpu, twin,
};
use cutis_volume::{Grid, Volume};

use crate::gpu;
use crate::oracle::Oracle;
use crate::scenes::{self, Scene};

/// Slabs that no scene's slices fill evenly.
const SLAB: usize = 7;

fn options(scene: &Scene) -> ResamplerOptions {
    ResamplerOptions { slab_slices: Some(SLAB), ..ResamplerOptions::centerd(&scene.warp()) }
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

/// Through the twin, and through the GPU where there is one.
fn results(gpu: Option<&Gpu>, scene: &Scene) -> Vec<(&'static str, Volume, ResampleReport)> {
    let (volume, report) = twin::resample(&scene.volume, &scene.warp(), &options(scene)).unwrap();
    let mut results = vec![("twin", volume, report)];
    if let Some(gpu) = gpu {
        let (volume, report) = resample_gpu(gpu, &scene.volume, &scene.warp(), &|_, _| {}).unwrap();
        results.push(("GPU", volume, report));
    }
    results
}

#[test]
fn every_voxel_and_count_is_one_that_f64_allows() {
    let gpu = gpu();
    for mut scene in scenes::all() {
        let oracle = Oracle::new(&scene);
        let voxels = scene.volume.voxels().len();
        eprintln!("{}: {voxels} voxels, {} of them ambiguous", scene.name, oracle.ambiguous);
        for (what, volume, report) in results(gpu.as_ref(), &scene) {
            assert_eq!(oracle.objection(&volume, &report), None, "{what}: {}", scene.name);
        }
        for p in scene.deformed.iter_mut().step_by(3) {
            p.x += 2e-5;
        }
        for (what, volume, report) in results(gpu.as_ref(), &scene) {
            let objection = oracle.objection(&volume, &report);
            assert!(objection.is_some(), "control: {what}: {}, vertices off by 0.02 mm", scene.name);
        }
    }
}

#[test]
fn the_cpu_gives_the_same_but_for_roundings() {
    let gpu = gpu();
    for scene in scenes::near() {
        let (of_cpu, report_of_cpu) = resample(&scene.volume, &scene.warp(), &|_, _| {}).unwrap();
        let oracle = Oracle::new(&scene);
        assert_eq!(oracle.objection(&of_cpu, &report_of_cpu), None, "{}", scene.name);
        for (what, volume, report) in results(gpu.as_ref(), &scene) {
            let pairs = || volume.voxels().iter().zip(of_cpu.voxels());
            let apart = |least| pairs().filter(|(a, b)| a.abs_diff(**b) >= least).count();
            eprintln!("{what}: {}: {} voxels differ, {} by more than 1", scene.name, apart(1), apart(2));
            // None does in these scenes where products and sums are not contracted.
            let exact = gpu.as_ref().is_none_or(|gpu| gpu.adapter().kind == AdapterKind::Software);
            assert!(apart(2) <= if exact { 0 } else { oracle.ambiguous }, "{what}: {}", scene.name);
            if exact {
                assert_eq!(report, report_of_cpu, "{what}: {}", scene.name);
            }
        }
    }
}

#[test]
fn differences_are_told_apart() {
    let states = by_twin(&scenes::half_at_rest()).0;
    let same = states[0].difference(&states[0]);
    assert_eq!(same, SlabDifference::default());
    let mut other = states[0].clone();
    other.owners[7] ^= 1 << 31;
    other.values[7] += 3;
    other.owners[9] ^= 1;
    other.values[9] -= 5;
    let found = states[0].difference(&other);
    assert_eq!(found, SlabDifference { owners: 1, values: 1, largest: 3, largest_elsewhere: 5 });
}

#[test]
fn the_twin_refuses_what_cannot_be_numbered() {
    let scene = scenes::half_at_rest();
    let slab = |slices| twin::resample_slab(&scene.volume, &scene.warp(), &options(&scene), slices);
    assert!(matches!(slab(5..5), Err(ResampleError::Region { .. })));
    assert!(matches!(slab(0..20), Err(ResampleError::Region { .. })));
    assert!(slab(18..19).is_ok(), "control");
    let grid = Grid { shape: [1, 65_536, 1], affine: scene.volume.grid().affine };
    let long = Volume::new(grid, vec![0; 65_536], 1.0, 0.0).unwrap();
    let found = twin::resample(&long, &scene.warp(), &ResamplerOptions::default()).unwrap_err();
    assert!(matches!(found, ResampleError::TooLarge { limit: 65_535, .. }), "{found}");
}
