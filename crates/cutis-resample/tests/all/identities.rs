//! Resampling compared with closed forms: identity, translation by whole voxels, affine maps,
//! folds, vacated tissue.

use cutis_resample::{ResampleReport, Warp, resample};
use cutis_test_kit::Random;
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Matrix3, Point3, Vector3};
use proptest::prelude::*;

use crate::bodies::{Mesh, lattice, noise, oblique};

fn warp<'a>(mesh: &'a Mesh, deformed: &'a [Point3<f32>]) -> Warp<'a> {
    Warp {
        origin_mm: mesh.origin_mm,
        rest: &mesh.rest,
        deformed,
        tets: &mesh.tets,
        body_tets: mesh.tets.len(),
        removed: &[],
    }
}

fn run(volume: &Volume, warp: &Warp<'_>) -> (Volume, ResampleReport) {
    resample(volume, warp, &|_, _| {}).unwrap()
}

fn moved(mesh: &Mesh, map: impl Fn(Point3<f64>) -> Point3<f64>) -> Vec<Point3<f32>> {
    mesh.rest.iter().map(|p| map(p.map(f64::from)).map(|c| c as f32)).collect()
}

fn full(shape: [usize; 3]) -> [f64; 3] {
    shape.map(|n| n as f64 - 1.0)
}

fn affines() -> Vec<Affine> {
    vec![
        Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap(),
        Affine::from_spacing([0.9765625, 0.1 + 0.2, 1.0 / 3.0], [-170.3, 55.1, 1e3 / 7.0]).unwrap(),
        oblique(),
    ]
}

#[test]
fn identity_returns_the_input_bit_for_bit() {
    for affine in affines() {
        let grid = Grid { shape: [23, 19, 17], affine };
        let volume = noise(grid, 1);
        for cells in [[22, 18, 16], [5, 7, 3]] {
            let mesh = lattice(&grid, cells, [0.0; 3], full(grid.shape));
            let (out, report) = run(&volume, &warp(&mesh, &mesh.rest));
            assert_eq!(out, volume);
            assert_eq!(report, ResampleReport::default());
        }
    }
}

#[test]
fn translation_by_whole_voxels_shifts_the_input() {
    let steps = [3_usize, 2, 1];
    for affine in affines() {
        let grid = Grid { shape: [23, 19, 17], affine };
        let volume = noise(grid, 2);
        let by = (0..3).map(|axis| affine.step_mm(axis) * steps[axis] as f64).sum::<Vector3<f64>>() / 1000.0;
        for cells in [[22, 18, 16], [5, 7, 3]] {
            let mesh = lattice(&grid, cells, [0.0; 3], full(grid.shape));
            let (out, report) = run(&volume, &warp(&mesh, &moved(&mesh, |p| p + by)));
            let mut covered = 0;
            for (index, &value) in out.voxels().iter().enumerate() {
                let point = grid.point(index);
                let inside = (0..3).all(|axis| point[axis] >= steps[axis]);
                let expected = if inside {
                    covered += 1;
                    volume.voxels()[grid.index(std::array::from_fn(|axis| point[axis] - steps[axis]))]
                } else {
                    -1024
                };
                assert_eq!(value, expected, "at {point:?}");
            }
            assert_eq!(report.moved_voxels, covered);
            assert_eq!(report.vacated_voxels, grid.len() - covered);
            assert_eq!((report.folds, report.inverted_tets), (0, 0));
        }
    }
}

/// Trilinear interpolation by the product formula in `f64`.
fn oracle(volume: &Volume, p: Point3<f64>) -> f64 {
    let shape = volume.grid().shape;
    let mut sum = 0.0;
    for corner in 0..8 {
        let mut weight = 1.0;
        let point = std::array::from_fn(|axis| {
            let x = p[axis].clamp(0.0, shape[axis] as f64 - 1.0);
            let low = (x.floor() as usize).min(shape[axis].saturating_sub(2));
            let up = corner >> axis & 1;
            weight *= if up == 1 { x - low as f64 } else { 1.0 - (x - low as f64) };
            (low + up).min(shape[axis] - 1)
        });
        sum += weight * f64::from(volume.voxels()[volume.grid().index(point)]);
    }
    sum
}

#[test]
fn affine_deformation_matches_the_closed_form() {
    for affine in affines() {
        let grid = Grid { shape: [23, 19, 17], affine };
        let volume = noise(grid, 3);
        let mesh = lattice(&grid, [6, 5, 4], [0.0; 3], full(grid.shape));
        let linear = Matrix3::new(0.8, 0.1, -0.05, 0.07, 0.9, 0.02, 0.03, -0.04, 0.85);
        let shift = Vector3::new(0.0011, 0.0007, 0.0013);
        let (out, report) = run(&volume, &warp(&mesh, &moved(&mesh, |p| linear * p + shift)));
        let inverse = linear.try_inverse().unwrap();
        let mut covered = 0;
        for (index, &value) in out.voxels().iter().enumerate() {
            let local = (grid.mm(grid.point(index)) - mesh.origin_mm) / 1000.0;
            let rest_mm = mesh.origin_mm + inverse * (local - shift) * 1000.0;
            let rest = affine.to_index(rest_mm);
            let last = full(grid.shape);
            let margin = (0..3).map(|axis| rest[axis].min(last[axis] - rest[axis])).fold(f64::MAX, f64::min);
            if margin.abs() < 1e-3 {
                continue;
            }
            let (expected, slack) = if margin > 0.0 {
                covered += 1;
                (oracle(&volume, rest), 0.5 + 0.2)
            } else {
                (-1024.0, 0.0)
            };
            assert!((f64::from(value) - expected).abs() <= slack, "{value} instead of {expected} at {rest}");
        }
        assert!(report.moved_voxels >= covered && covered > grid.len() / 3);
        assert_eq!(report.folds, 0);
    }
}

/// The shifts stay within a tile of the output, or lead out of it along each axis.
#[test]
fn voxels_outside_both_shapes_keep_their_value() {
    let grid = Grid { shape: [80, 50, 50], affine: oblique() };
    let volume = noise(grid, 4);
    let mesh = lattice(&grid, [3, 3, 3], [6.0; 3], [12.0; 3]);
    for shift in [[8, 0, 0], [60, 0, 0], [0, 34, 0], [0, 0, 30]] {
        let step = |axis: usize| grid.affine.step_mm(axis) * (shift[axis] as f64 / 1000.0);
        let by = (0..3).map(step).sum::<Vector3<f64>>();
        let (out, report) = run(&volume, &warp(&mesh, &moved(&mesh, |p| p + by)));
        let cube = |low: [usize; 3], point: [usize; 3]| {
            (0..3).all(|axis| (low[axis]..=low[axis] + 6).contains(&point[axis]))
        };
        for (index, &value) in out.voxels().iter().enumerate() {
            let point = grid.point(index);
            let expected = if cube(shift.map(|n| n + 6), point) {
                volume.voxels()[grid.index(std::array::from_fn(|axis| point[axis] - shift[axis]))]
            } else if cube([6; 3], point) {
                -1024
            } else {
                volume.voxels()[index]
            };
            assert_eq!(value, expected, "at {point:?}, shifted by {shift:?}");
        }
        assert_eq!((report.vacated_voxels, report.moved_voxels), (343, 343));
    }
}

#[test]
fn removed_tets_leave_air_and_only_there() {
    let grid = Grid { shape: [17, 17, 17], affine: Affine::from_spacing([0.7; 3], [5.0; 3]).unwrap() };
    let volume = noise(grid, 5);
    let mut mesh = lattice(&grid, [4, 4, 4], [0.0; 3], [16.0; 3]);
    let removed = mesh.tets.split_off(mesh.tets.len() / 2);
    let whole = warp(&mesh, &mesh.rest);
    let (out, report) = run(&volume, &Warp { removed: &removed, ..whole });
    for (index, &value) in out.voxels().iter().enumerate() {
        let expected = if grid.point(index)[2] > 8 { -1024 } else { volume.voxels()[index] };
        assert_eq!(value, expected);
    }
    assert_eq!(report.vacated_voxels, 17 * 17 * 8);
    assert_eq!(run(&volume, &whole).0, volume, "control: nothing is removed without the list");
}

#[test]
fn folds_and_inverted_tets_are_counted() {
    let grid = Grid { shape: [17, 9, 9], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
    let volume = noise(grid, 6);
    let mesh = lattice(&grid, [2, 1, 1], [0.5, 0.5, 0.5], [16.5, 8.5, 8.5]);
    // The second cell is folded back over the first one.
    let folded = moved(&mesh, |p| Point3::new(if p.x > 0.012 { -0.0002 } else { p.x }, p.y, p.z));
    let (_, report) = run(&volume, &warp(&mesh, &folded));
    assert_eq!(report.inverted_tets, 6);
    assert!(report.folds > 300, "{report:?}");
    let shell = Warp { body_tets: 6, ..warp(&mesh, &folded) };
    assert_eq!(run(&volume, &shell).1.folds, 0, "a shell may fold");
    // Each tet twice. Only those that move count.
    let twice = [&mesh.tets[..], &mesh.tets].concat();
    let folds = |deformed: &[Point3<f32>]| {
        let warp = Warp { tets: &twice, body_tets: twice.len(), ..warp(&mesh, deformed) };
        run(&volume, &warp).1.folds
    };
    let corner =
        moved(&mesh, |p| if p.coords.amax() > 0.016 && p.y > 0.008 && p.z > 0.008 { p * 0.99 } else { p });
    let [none, few, all] = [folds(&mesh.rest), folds(&corner), folds(&moved(&mesh, |p| p * 0.99))];
    assert!(none == 0 && few > 0 && few < all, "{none}, {few}, {all}");
    let flat = moved(&mesh, |p| Point3::new(p.x, p.y, 0.003));
    let (_, report) = run(&volume, &warp(&mesh, &flat));
    assert_eq!((report.inverted_tets, report.moved_voxels), (12, 0));
}

#[test]
fn the_lowest_tet_owns_a_voxel() {
    let grid = Grid { shape: [9, 9, 9], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
    let volume = noise(grid, 7);
    let mesh = lattice(&grid, [1, 1, 1], [0.25; 3], [7.75; 3]);
    let twice: Vec<[u32; 4]> =
        mesh.tets.iter().map(|t| t.map(|v| v + 8)).chain(mesh.tets.iter().copied()).collect();
    let rest: Vec<_> = mesh.rest.iter().chain(&mesh.rest).copied().collect();
    // The copy whose tets come first moves by one voxel, the other one stays.
    let deformed: Vec<_> =
        mesh.rest.iter().copied().chain(moved(&mesh, |p| p + Vector3::x() * 0.001)).collect();
    let both = Warp {
        origin_mm: mesh.origin_mm,
        rest: &rest,
        deformed: &deformed,
        tets: &twice,
        body_tets: twice.len(),
        removed: &[],
    };
    let (out, report) = run(&volume, &both);
    for (index, &value) in out.voxels().iter().enumerate() {
        let [i, j, k] = grid.point(index);
        let in_first = i >= 2 && [j, k].iter().all(|at| (1..8).contains(at));
        let from = if in_first { index - 1 } else { index };
        assert_eq!(value, volume.voxels()[from]);
    }
    assert!(report.folds > 0);
    let (reversed, _) = run(&volume, &Warp { tets: &twice[6..], ..Warp { body_tets: 6, ..both } });
    assert_eq!(reversed, volume, "control: the unmoved copy alone");
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let grid = Grid { shape: [40, 40, 70], affine: oblique() };
    let volume = noise(grid, 9);
    let mesh = lattice(&grid, [9, 9, 9], [2.0; 3], [37.0, 37.0, 66.0]);
    let bent = moved(&mesh, |p| p + Vector3::new(0.002, 0.001, 0.003) * (200.0 * p.y).sin());
    let results: Vec<_> = [1, 2, 3, 8]
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run(&volume, &warp(&mesh, &bent)))
        })
        .into();
    assert!(results.iter().all(|result| *result == results[0]));
    assert_ne!(results[0].0, volume, "control: the warp does something");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn values_stay_within_the_range_of_the_input(seed in any::<u64>(), strength in 0.0..0.02_f32, floor in -1024_i16..500) {
        let grid = Grid { shape: [15, 14, 13], affine: oblique() };
        let base = noise(grid, seed);
        let voxels: Vec<i16> = base.voxels().iter().map(|&v| v.max(floor)).collect();
        let volume = Volume::new(grid, voxels, 1.0, 0.0).unwrap();
        let mesh = lattice(&grid, [4, 4, 4], [-1.0; 3], [15.0, 14.0, 13.0]);
        let mut random = Random::new(!seed);
        let deformed: Vec<_> =
            mesh.rest.iter().map(|p| p + random.vector().cast::<f32>() * 1.5 * strength).collect();
        let (out, report) = run(&volume, &warp(&mesh, &deformed));
        let range = |v: &Volume| (*v.voxels().iter().min().unwrap(), *v.voxels().iter().max().unwrap());
        let (inner, outer) = (range(&out), range(&volume));
        prop_assert!(inner.0 >= outer.0 && inner.1 <= outer.1);
        prop_assert!(report.moved_voxels + report.vacated_voxels <= grid.len());
    }

    #[test]
    fn no_center_falls_between_tets(seed in any::<u64>(), cells in 1_usize..6) {
        let grid = Grid { shape: [15, 14, 13], affine: oblique() };
        let volume = noise(grid, seed);
        // The outer vertices stay on the box. The inner ones move by up to a fifth of a cell, so
        // that no tet inverts.
        let mesh = lattice(&grid, [cells; 3], [0.0; 3], full(grid.shape));
        let mut random = Random::new(!seed);
        let n = cells + 1;
        let deformed: Vec<_> = mesh.rest.iter().enumerate().map(|(v, p)| {
            let at = [v % n, v / n % n, v / (n * n)];
            let mut by = Vector3::zeros();
            if at.iter().all(|&x| x > 0 && x < cells) {
                let share = random.vector();
                for axis in 0..3 {
                    by += grid.affine.step_mm(axis) * share[axis] * (12.0 / cells as f64 / 5.0) / 1000.0;
                }
            }
            p + by.map(|c| c as f32)
        }).collect();
        let (_, report) = run(&volume, &warp(&mesh, &deformed));
        prop_assert_eq!((report.vacated_voxels, report.folds, report.inverted_tets), (0, 0, 0));
    }
}
