//! Tests of the synthetic torso and the test solids: reproducible bits, plausible tissue,
//! connectivity, closed forms and invalid input.

use std::sync::Mutex;

use cutis_volume::phantom::{MAX_VOXELS_PER_AXIS, Phantom, nested_spheres, sphere};
use cutis_volume::{Grid, Volume, VolumeError, nifti};
use proptest::prelude::*;

/// Voxels above this value in HU are tissue.
const TISSUE_HU: i16 = -449;

fn with_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a small thread pool").install(work)
}

fn volume(shape: [usize; 3], seed: u64) -> Volume {
    Phantom::new(shape, seed).and_then(|phantom| phantom.volume()).expect("a small phantom")
}

fn turned(shape: [usize; 3], seed: u64, turn_deg: [f64; 3]) -> Volume {
    let phantom = Phantom::new(shape, seed).and_then(|phantom| phantom.turned(turn_deg));
    phantom.and_then(|phantom| phantom.volume()).expect("a small phantom")
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    for turn_deg in [[0.0; 3], [20.0, 10.0, -30.0]] {
        let one = with_threads(1, || turned([37, 41, 19], 5, turn_deg));
        for threads in [2, 3, 8] {
            assert_eq!(with_threads(threads, || turned([37, 41, 19], 5, turn_deg)), one, "{threads} threads");
        }
        assert_ne!(turned([37, 41, 19], 6, turn_deg), one);
    }
}

/// Published figures use the phantom as a data set, so its bits may change only on purpose.
#[test]
fn bits_are_the_recorded_ones() {
    // FNV-1a hash of the little-endian voxels.
    let hash = |volume: Volume| {
        volume
            .voxels()
            .iter()
            .flat_map(|hu| hu.to_le_bytes())
            .fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
            })
    };
    let upright = hash(volume([40, 32, 24], 1));
    assert_eq!(upright, 0x0F7F_2BDD_66CD_0203, "{upright:#018X}");
    assert_eq!(hash(turned([40, 32, 24], 1, [0.0, 360.0, 0.0])), upright);
    let turned = hash(turned([40, 32, 24], 1, [15.0, 0.0, 30.0]));
    assert_eq!(turned, 0x83F0_55BF_092E_D21F, "{turned:#018X}");
}

/// A quarter turn moves every voxel of a cubic grid to the place of another one. Only the noise
/// differs.
#[test]
fn a_quarter_turn_permutes_the_voxels() {
    const N: usize = 40;
    let upright = volume([N; 3], 2);
    let at = |[i, j, k]: [usize; 3]| f64::from(upright.voxels()[upright.grid().index([i, j, k])]);
    let last = N - 1;
    type Source = fn([usize; 3], usize) -> [usize; 3];
    let turns: [([f64; 3], Source); 3] = [
        ([90.0, 0.0, 0.0], |[i, j, k], last| [i, k, last - j]),
        ([0.0, 90.0, 0.0], |[i, j, k], last| [last - k, j, i]),
        ([0.0, 0.0, 90.0], |[i, j, k], last| [j, last - i, k]),
    ];
    for (turn_deg, source) in turns {
        let turned = turned([N; 3], 2, turn_deg);
        let difference = |source: &dyn Fn([usize; 3]) -> [usize; 3]| {
            let each = turned
                .voxels()
                .iter()
                .enumerate()
                .map(|(index, &hu)| (f64::from(hu) - at(source(turned.grid().point(index)))).abs());
            each.sum::<f64>() / turned.voxels().len() as f64
        };
        let [own, other] = [difference(&|point| source(point, last)), difference(&|point| point)];
        assert!(own < 15.0 && other > 100.0, "{turn_deg:?}: {own} HU, without the turn {other} HU");
    }
}

/// Tissue and air of a turned person are at the turned places.
#[test]
fn a_turn_moves_the_tissue_with_it() -> Result<(), VolumeError> {
    let shape = [80; 3];
    let upright = volume(shape, 1);
    let phantom = Phantom::new(shape, 1)?.turned([25.0, -35.0, 50.0])?;
    let turned = phantom.volume()?;
    let is_tissue = |volume: &Volume, mm: [f64; 3]| {
        let point: [f64; 3] = volume.grid().affine.to_index(mm.into()).into();
        volume.voxels()[volume.grid().index(point.map(|c| c.round() as usize))] > TISSUE_HU
    };
    let (mut count, mut same, mut same_without) = (0.0, 0.0, 0.0);
    for index in 0..upright.grid().len() {
        let mm = upright.grid().mm(upright.grid().point(index));
        if mm.coords.norm() < 190.0 {
            let here = is_tissue(&upright, mm.into());
            count += 1.0;
            same += f64::from(u8::from(here == is_tissue(&turned, phantom.place(mm.into()))));
            same_without += f64::from(u8::from(here == is_tissue(&turned, mm.into())));
        }
    }
    assert!(same / count > 0.95 && same_without / count < 0.9, "{} {}", same / count, same_without / count);
    let (from, to) = phantom.incision_site();
    let (upright_from, _) = Phantom::new(shape, 1)?.incision_site();
    assert_eq!(from, phantom.place(upright_from));
    assert!((0..3).map(|c| (to[c] - from[c]).powi(2)).sum::<f64>().sqrt() > 98.0);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn any_range_of_slices_equals_the_slices_of_the_whole_volume(seed in 0_u64..4, cuts in proptest::collection::vec(0_usize..=13, 0..5)) {
        let phantom = Phantom::new([24, 30, 13], seed).expect("a small phantom");
        let whole = phantom.volume().expect("a small phantom");
        let mut ends = cuts;
        ends.extend([0, 13]);
        ends.sort_unstable();
        for pair in ends.windows(2) {
            let mut slices = vec![i16::MAX; 24 * 30 * (pair[1] - pair[0])];
            phantom.fill_slices(pair[0]..pair[1], &mut slices).expect("slices of the phantom");
            prop_assert_eq!(&slices[..], &whole.voxels()[24 * 30 * pair[0]..24 * 30 * pair[1]]);
        }
    }
}

#[test]
fn the_written_file_equals_the_volume() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let phantom = Phantom::new([33, 29, 21], 3)?;
    for name in ["torso.nii", "torso.nii.gz"] {
        let path = folder.path().join(name);
        let calls = Mutex::new(Vec::new());
        phantom.write(&path, &|done, total| {
            calls.lock().expect("the lock is not poisoned").push((done, total))
        })?;
        let loaded = nifti::read(&path)?.volume;
        assert_eq!(loaded.voxels(), phantom.volume()?.voxels());
        for corner in [[0, 0, 0], [32, 28, 20]] {
            assert!((loaded.grid().mm(corner) - phantom.grid().mm(corner)).norm() < 1e-3);
        }
        assert_eq!(calls.into_inner()?.last(), Some(&(21, 21)));
    }
    Ok(())
}

#[test]
fn spacing_follows_the_documented_rule() -> Result<(), VolumeError> {
    let cases = [
        ([512, 512, 300], [0.781_25, 0.781_25, 1.0]),
        ([512, 512, 544], [0.781_25, 0.781_25, 0.781_25]),
        ([512, 512, 1152], [0.781_25, 0.781_25, 600.0 / 1152.0]),
        ([100, 200, 200], [4.0, 2.0, 2.0]),
        ([1, 1, 1], [400.0, 400.0, 400.0]),
    ];
    for (shape, expected) in cases {
        let grid = *Phantom::new(shape, 0)?.grid();
        for (found, expected) in grid.affine.spacing_mm().into_iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-12, "{shape:?}: {found} not {expected}");
        }
        let ends = grid.mm([0; 3]).coords + grid.mm(shape.map(|n| n - 1)).coords;
        assert!(ends.norm() < 1e-9, "{shape:?}: the middle is not the origin");
    }
    Ok(())
}

#[test]
fn hounsfield_units_are_plausible_for_a_torso() {
    for seed in 0..3 {
        let torso = volume([96, 96, 72], seed);
        let hu = torso.voxels();
        assert!(hu.iter().all(|hu| (-1024..=1600).contains(hu)));
        // Mean and noise of the air in the corners.
        let corner: Vec<f64> = (0..72)
            .flat_map(|k| (0..8).map(move |i| [i, 95, k]))
            .map(|p| f64::from(hu[torso.grid().index(p)]))
            .collect();
        let mean = corner.iter().sum::<f64>() / corner.len() as f64;
        let deviation = (corner.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / corner.len() as f64).sqrt();
        assert!((mean + 1000.0).abs() < 1.5 && (4.0..9.0).contains(&deviation), "{mean} ± {deviation}");
        // Share of each tissue in percent of the voxels above −900 HU.
        let count = |low: i16, high: i16| hu.iter().filter(|hu| (low..high).contains(hu)).count() as f64;
        let body = count(-900, 3000);
        let shares = [(-900, -750), (-150, -50), (0, 110), (180, 1600)]
            .map(|(low, high)| 100.0 * count(low, high) / body);
        let plausible = [4.0..20.0, 15.0..55.0, 20.0..55.0, 1.5..8.0];
        for (share, range) in shares.into_iter().zip(plausible) {
            assert!(range.contains(&share), "seed {seed}: lung, fat, soft tissue, bone {shares:?}");
        }
    }
}

/// Removes from `open` the voxels that are face-connected to `seeds`, and returns them.
fn flood(grid: &Grid, seeds: impl Iterator<Item = usize>, open: &mut [bool]) -> Vec<usize> {
    let mut reached: Vec<usize> = seeds.filter(|&seed| std::mem::take(&mut open[seed])).collect();
    let mut next = 0;
    while let Some(&index) = reached.get(next) {
        next += 1;
        let point = grid.point(index);
        for axis in 0..3 {
            for step in [-1, 1] {
                let mut neighbor = point;
                neighbor[axis] = neighbor[axis].wrapping_add_signed(step);
                if neighbor[axis] < grid.shape[axis] && std::mem::take(&mut open[grid.index(neighbor)]) {
                    reached.push(grid.index(neighbor));
                }
            }
        }
    }
    reached
}

#[test]
fn body_and_table_are_separate_components() {
    for seed in 0..3 {
        let torso = volume([128, 128, 96], seed);
        let grid = *torso.grid();
        let mut tissue: Vec<bool> = torso.voxels().iter().map(|&hu| hu > TISSUE_HU).collect();
        let total = tissue.iter().filter(|&&tissue| tissue).count();
        let components = (0..grid.len()).map(|start| flood(&grid, std::iter::once(start), &mut tissue));
        let mut components: Vec<Vec<usize>> = components.filter(|members| !members.is_empty()).collect();
        components.sort_by_key(|members| std::cmp::Reverse(members.len()));
        let [body, table, rest @ ..] = &components[..] else { panic!("{} components", components.len()) };
        let heights = |members: &[usize]| {
            let ys = members.iter().map(|&index| grid.mm(grid.point(index)).y);
            ys.fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)))
        };
        let ((back, belly), (_, edge)) = (heights(body), heights(table));
        assert!(
            body.len() > 300_000 && belly > 80.0 && back > -105.0,
            "body of {}: {back} to {belly}",
            body.len()
        );
        assert!(table.len() > 15_000 && edge < -75.0, "table of {}, up to {edge} mm", table.len());
        // The remaining components are ends of lung vessels.
        assert!(total - body.len() - table.len() < total / 200, "stray: {:?}", rest.iter().map(Vec::len));
    }
}

#[test]
fn lungs_and_bowel_gas_are_closed_at_the_sides() {
    // The scan is 500 mm long, so that the windpipe and the lungs reach the last slice.
    let torso = volume([96, 96, 120], 4);
    let grid = *torso.grid();
    let air: Vec<bool> = torso.voxels().iter().map(|&hu| hu <= TISSUE_HU).collect();
    let unreached_from = |axes: &[usize]| {
        let mut left = air.clone();
        let on_a_face = |&index: &usize| {
            let point = grid.point(index);
            axes.iter().any(|&axis| point[axis] == 0 || point[axis] == grid.shape[axis] - 1)
        };
        flood(&grid, (0..grid.len()).filter(on_a_face), &mut left);
        left
    };
    let liters = |voxels: &[bool], low_mm: f64, high_mm: f64| {
        let counted =
            (0..grid.len()).filter(|&n| voxels[n] && (low_mm..high_mm).contains(&grid.mm(grid.point(n)).z));
        counted.count() as f64 * grid.affine.voxel_volume_mm3() * 1e-6
    };
    let from_the_sides = unreached_from(&[0, 1]);
    let (lungs, gas) = (liters(&from_the_sides, 80.0, 300.0), liters(&from_the_sides, -300.0, 80.0));
    assert!((2.0..7.0).contains(&lungs), "{lungs} liters of lung");
    assert!((0.1..2.0).contains(&gas), "{gas} liters below the lungs");
    // Control: a fill that also starts at the end slices enters the lungs.
    let open_to_the_ends = liters(&unreached_from(&[0, 1, 2]), 80.0, 300.0);
    assert!(open_to_the_ends < 0.3 * lungs, "{open_to_the_ends} of {lungs} liters");
}

#[test]
fn the_incision_site_lies_on_the_belly() -> Result<(), VolumeError> {
    for seed in 0..8 {
        let phantom = Phantom::new([256, 256, 192], seed)?;
        let (from, to) = phantom.incision_site();
        let length = (0..3).map(|c| (to[c] - from[c]).powi(2)).sum::<f64>().sqrt();
        assert!((length - 100.0).abs() < 2.0, "{length} mm long");
        for end in [from, to] {
            let index = phantom.grid().affine.to_index(end.into());
            let [i, k] = [index.x.round() as usize, index.z.round() as usize];
            let mut slice = vec![0; 256 * 256];
            phantom.fill_slices(k..k + 1, &mut slice)?;
            let at = |offset_mm: f64| {
                let j = phantom.grid().affine.to_index([end[0], end[1] + offset_mm, end[2]].into()).y.round();
                slice[i + 256 * j as usize]
            };
            assert!(at(3.5) < -900, "outside: {} HU", at(3.5));
            assert!(at(-1.6) > -449, "in the skin: {} HU", at(-1.6));
            assert!((-180..-50).contains(&at(-7.0)), "below the skin: {} HU", at(-7.0));
        }
    }
    Ok(())
}

/// Volume of the tissue in mm³, computed from the gray values.
fn tissue_mm3(volume: &Volume, hu_inside: f64) -> f64 {
    let share = |&hu: &i16| (f64::from(hu) + 1024.0) / (hu_inside + 1024.0);
    volume.voxels().iter().map(share).sum::<f64>() * volume.grid().affine.voxel_volume_mm3()
}

fn ball_mm3(radius: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * radius.powi(3)
}

#[test]
fn spheres_have_the_volume_of_their_closed_forms() -> Result<(), VolumeError> {
    let ball = sphere([64, 50, 40], [1.0, 1.3, 1.6], 28.0, 60)?;
    assert!((tissue_mm3(&ball, 60.0) / ball_mm3(28.0) - 1.0).abs() < 2e-3);
    assert!(
        (tissue_mm3(&ball, 60.0) / ball_mm3(28.3) - 1.0).abs() > 2e-2,
        "the tolerance does not detect an error of 1 % in the radius"
    );
    let nested = nested_spheres([72; 3], [1.0; 3], [32.0, 24.0, 12.0], 60)?;
    let exact = ball_mm3(32.0) - ball_mm3(24.0) + ball_mm3(12.0);
    assert!((tissue_mm3(&nested, 60.0) / exact - 1.0).abs() < 2e-3);
    let along_x: Vec<i16> = (36..72).map(|i| nested.voxels()[nested.grid().index([i, 36, 36])]).collect();
    assert_eq!([along_x[2], along_x[18], along_x[28], along_x[35]], [60, -1024, 60, -1024]);
    Ok(())
}

#[test]
fn invalid_requests_are_refused() -> Result<(), VolumeError> {
    let bad = [[0, 5, 5], [5, 5, 0], [MAX_VOXELS_PER_AXIS + 1, 1, 1], [usize::MAX; 3], [1 << 32, 1 << 32, 1]];
    for shape in bad {
        for result in [Phantom::new(shape, 0).map(|_| ()), sphere(shape, [1.0; 3], 5.0, 0).map(|_| ())] {
            assert!(
                matches!(result, Err(VolumeError::PhantomShape { shape: named, .. }) if named == shape),
                "{shape:?}"
            );
        }
    }
    for radii in
        [[3.0, 2.0, 2.0], [f64::NAN, 2.0, 1.0], [f64::INFINITY, 2.0, 1.0], [3.0, 2.0, -1.0], [1.0, 2.0, 3.0]]
    {
        assert!(
            matches!(nested_spheres([8; 3], [1.0; 3], radii, 0), Err(VolumeError::SphereRadii { .. })),
            "{radii:?}"
        );
    }
    for spacing in [[0.0, 1.0, 1.0], [1.0, f64::NAN, 1.0], [1.0, 1.0, f64::INFINITY]] {
        assert!(
            matches!(sphere([8; 3], spacing, 3.0, 0), Err(VolumeError::SingularAffine { .. })),
            "{spacing:?}"
        );
    }
    for angle in [f64::NAN, f64::INFINITY] {
        let refused = Phantom::new([8; 3], 0)?.turned([0.0, angle, 0.0]).err();
        assert!(matches!(refused, Some(VolumeError::PhantomTurn { .. })), "{angle}");
    }
    let phantom = Phantom::new([8, 8, 8], 0)?;
    let mut buffer = vec![0; 64 * 2];
    for (slices, wrong_range) in
        [(7..9, true), (usize::MAX - 1..usize::MAX, true), (2..3, false), (2..5, false)]
    {
        match phantom.fill_slices(slices.clone(), &mut buffer) {
            Err(VolumeError::SliceRange { .. }) => assert!(wrong_range, "{slices:?}"),
            Err(VolumeError::VoxelCount { .. }) => assert!(!wrong_range, "{slices:?}"),
            other => panic!("{slices:?}: {other:?}"),
        }
    }
    phantom.fill_slices(2..4, &mut buffer)
}
