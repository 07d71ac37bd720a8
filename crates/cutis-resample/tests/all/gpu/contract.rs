//! The rules of resampling, tested on a GPU with closed forms, as `identities.rs` does on the CPU.

use cutis_gpu::Gpu;
use cutis_resample::{ResampleReport, Warp, resample_gpu};
use cutis_test_kit::Random;
use cutis_test_kit::gpu::on_each_adapter;
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Point3, Vector3};

use super::scenes::{self, Scene};
use crate::bodies::{lattice, noise, oblique};

fn run(gpu: &Gpu, scene: &Scene) -> (Volume, ResampleReport) {
    run_warp(gpu, &scene.volume, &scene.warp())
}

fn run_warp(gpu: &Gpu, volume: &Volume, warp: &Warp<'_>) -> (Volume, ResampleReport) {
    resample_gpu(gpu, volume, warp, &|_, _| {}).unwrap()
}

fn affines() -> [Affine; 3] {
    [
        Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap(),
        Affine::from_spacing([0.9765625, 0.1 + 0.2, 1.0 / 3.0], [-170.3, 55.1, 1e3 / 7.0]).unwrap(),
        oblique(),
    ]
}

/// A mesh that covers all voxel centers of its volume.
fn filled(affine: Affine, cells: [usize; 3], seed: u64) -> Scene {
    let grid = Grid { shape: [23, 19, 17], affine };
    let mesh = lattice(&grid, cells, [0.0; 3], grid.shape.map(|n| n as f64 - 1.0));
    Scene::new("filled", noise(grid, seed), mesh)
}

#[test]
fn identity_returns_the_input_bit_for_bit() {
    on_each_adapter(|gpu| {
        for affine in affines() {
            for cells in [[22, 18, 16], [5, 7, 3], [1, 1, 1]] {
                let scene = filled(affine, cells, 1);
                let (out, report) = run(gpu, &scene);
                assert_eq!(out, scene.volume);
                assert_eq!(report, ResampleReport::default());
            }
        }
    });
}

#[test]
fn without_a_mesh_nothing_changes() {
    on_each_adapter(|gpu| {
        let grid = Grid { shape: [3, 5, 7], affine: oblique() };
        let volume = noise(grid, 3);
        let origin_mm = Point3::origin();
        let warp = Warp { origin_mm, rest: &[], deformed: &[], tets: &[], body_tets: 0, removed: &[] };
        assert_eq!(run_warp(gpu, &volume, &warp), (volume, ResampleReport::default()));
    });
}

#[test]
fn translation_by_whole_voxels_shifts_the_input() {
    on_each_adapter(|gpu| {
        let steps = [3, 2, 1];
        for affine in affines() {
            let by =
                (0..3).map(|axis| affine.step_mm(axis) * steps[axis] as f64).sum::<Vector3<f64>>() / 1000.0;
            for cells in [[22, 18, 16], [5, 7, 3]] {
                let scene = filled(affine, cells, 2).moved(|p| p + by);
                let (out, report) = run(gpu, &scene);
                let grid = out.grid();
                let mut covered = 0;
                for (index, &value) in out.voxels().iter().enumerate() {
                    let point = grid.point(index);
                    let inside = (0..3).all(|axis| point[axis] >= steps[axis]);
                    covered += usize::from(inside);
                    let from = || std::array::from_fn(|axis| point[axis] - steps[axis]);
                    let expected = if inside { scene.volume.voxels()[grid.index(from())] } else { -1024 };
                    assert_eq!(value, expected, "at {point:?}");
                }
                let vacated_voxels = grid.len() - covered;
                let expected =
                    ResampleReport { moved_voxels: covered, vacated_voxels, ..ResampleReport::default() };
                assert_eq!(report, expected);
            }
        }
    });
}

#[test]
fn voxels_outside_both_shapes_keep_their_value_and_removed_tets_leave_air() {
    on_each_adapter(|gpu| {
        let grid = Grid { shape: [17, 17, 17], affine: Affine::from_spacing([0.7; 3], [5.0; 3]).unwrap() };
        let mut scene = Scene::new("removed", noise(grid, 5), lattice(&grid, [4; 3], [2.0; 3], [14.0; 3]));
        scene.removed = scene.mesh.tets.split_off(scene.mesh.tets.len() / 2);
        scene.body_tets = scene.mesh.tets.len();
        let (out, report) = run(gpu, &scene);
        for (index, &value) in out.voxels().iter().enumerate() {
            let [i, j, k] = grid.point(index);
            let removed = (2..=14).contains(&i) && (2..=14).contains(&j) && (9..=14).contains(&k);
            let expected = if removed { -1024 } else { scene.volume.voxels()[index] };
            assert_eq!(value, expected, "at {i} {j} {k}");
        }
        assert_eq!((report.vacated_voxels, report.moved_voxels), (13 * 13 * 6, 0));
        scene.removed.clear();
        assert_eq!(run(gpu, &scene).0, scene.volume, "control: nothing is removed without the list");
    });
}

#[test]
fn folds_are_the_bodys_only_and_flat_tets_hold_nothing() {
    on_each_adapter(|gpu| {
        let mut scene = scenes::large_folded();
        let (_, report) = run(gpu, &scene);
        assert!(report.folds > 1000 && report.inverted_tets == 12, "{report:?}");
        scene.body_tets = 6;
        assert_eq!(run(gpu, &scene).1.folds, 0, "a shell may fold");
        let flat = scene.moved(|p| Point3::new(p.x, p.y, 0.003));
        let (_, report) = run(gpu, &flat);
        assert_eq!((report.inverted_tets, report.moved_voxels), (24, 0));
    });
}

#[test]
fn the_lowest_tet_owns_a_voxel() {
    on_each_adapter(|gpu| {
        let grid = Grid { shape: [9, 9, 9], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
        let volume = noise(grid, 7);
        let mesh = lattice(&grid, [1, 1, 1], [0.25; 3], [7.75; 3]);
        let rest = [mesh.rest.as_slice(), &mesh.rest].concat();
        let mut deformed = rest.clone();
        // The copy whose tets come first moves by one voxel, the other one stays.
        deformed[8..].iter_mut().for_each(|p| p.x += 0.001);
        let tets: Vec<_> =
            mesh.tets.iter().map(|t| t.map(|v| v + 8)).chain(mesh.tets.iter().copied()).collect();
        let warp = Warp {
            origin_mm: mesh.origin_mm,
            rest: &rest,
            deformed: &deformed,
            tets: &tets,
            body_tets: tets.len(),
            removed: &[],
        };
        let (out, report) = run_warp(gpu, &volume, &warp);
        for (index, &value) in out.voxels().iter().enumerate() {
            let [i, j, k] = grid.point(index);
            let in_first = i >= 2 && [j, k].iter().all(|at| (1..8).contains(at));
            assert_eq!(value, volume.voxels()[if in_first { index - 1 } else { index }]);
        }
        assert!(report.folds > 0);
        let second = Warp { tets: &tets[6..], body_tets: 6, ..warp };
        assert_eq!(run_warp(gpu, &volume, &second).0, volume, "control: the unmoved copy alone");
    });
}

#[test]
fn padding_does_not_bleed_into_tissue() {
    on_each_adapter(|gpu| {
        let grid = Grid { shape: [8, 6, 6], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
        let voxels = (0..grid.len()).map(|n| if grid.point(n)[0] < 4 { -3024 } else { 40 }).collect();
        let volume = Volume::new(grid, voxels, 1.0, 0.0).unwrap();
        let mesh = lattice(&grid, [2; 3], [0.0; 3], [7.0, 5.0, 5.0]);
        let scene = Scene::new("padding", volume, mesh).moved(|p| Point3::new(p.x - 0.0005, p.y, p.z));
        let (out, _) = run(gpu, &scene);
        let row: Vec<i16> = (0..8).map(|i| out.voxels()[grid.index([i, 3, 3])]).collect();
        assert_eq!(row, [-3024, -3024, -3024, -492, 40, 40, 40, -1024], "as air where it meets tissue");
    });
}

#[test]
fn values_stay_within_the_range_of_the_input_and_no_center_falls_between_tets() {
    on_each_adapter(|gpu| {
        for (seed, cells) in [(1_u64, 1_usize), (2, 2), (3, 3), (4, 4), (5, 5), (6, 4), (7, 3), (8, 2)] {
            let grid = Grid { shape: [15, 14, 13], affine: oblique() };
            let volume = noise(grid, seed);
            // The outer vertices stay on the box. The inner ones move by up to a fifth of a cell,
            // so that no tet inverts.
            let mesh = lattice(&grid, [cells; 3], [0.0; 3], [14.0, 13.0, 12.0]);
            let mut random = Random::new(!seed);
            let mut scene = Scene::new("jitter", volume, mesh);
            for (v, p) in scene.deformed.iter_mut().enumerate() {
                let n = cells + 1;
                if [v % n, v / n % n, v / (n * n)].iter().any(|&x| x == 0 || x == cells) {
                    continue;
                }
                let share = random.vector();
                for axis in 0..3 {
                    let step = grid.affine.step_mm(axis) * share[axis] * (12.0 / cells as f64 / 5.0) / 1000.0;
                    *p += step.map(|c| c as f32);
                }
            }
            let (out, report) = run(gpu, &scene);
            assert_eq!((report.vacated_voxels, report.folds, report.inverted_tets), (0, 0, 0));
            let range = |v: &Volume| (*v.voxels().iter().min().unwrap(), *v.voxels().iter().max().unwrap());
            let (inner, outer) = (range(&out), range(&scene.volume));
            assert!(inner.0 >= outer.0 && inner.1 <= outer.1, "{inner:?} outside {outer:?}");
        }
    });
}
