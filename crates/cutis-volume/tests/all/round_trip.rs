//! Written files are read back exactly by this crate, and equally by the independent `nifti` crate.

use std::fs;
use std::path::Path;

use ::nifti::{NiftiObject, NiftiVolume, RandomAccessNiftiVolume};
use cutis_volume::{Affine, Grid, Volume, VolumeError, nifti};
use proptest::prelude::*;

fn rotation(angles: [f64; 3], spacing: [f64; 3], mirrored: bool, origin: [f64; 3]) -> Affine {
    let [a, b, c] = angles;
    let rotation = nalgebra::Rotation3::from_euler_angles(a, b, c);
    let sign = [1.0, 1.0, if mirrored { -1.0 } else { 1.0 }];
    let rows: [[f64; 4]; 3] = std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let value = if c < 3 { rotation[(r, c)] * spacing[c] * sign[c] } else { origin[r] };
            // A header holds f32 values.
            f64::from(value as f32)
        })
    });
    Affine::from_rows([rows[0], rows[1], rows[2], [0.0, 0.0, 0.0, 1.0]]).unwrap()
}

fn ramp(shape: [usize; 3]) -> Volume {
    let affine = rotation([0.1, 0.2, 3.0], [0.7, 0.8, 2.5], false, [-120.0, 33.0, 900.0]);
    let grid = Grid { shape, affine };
    let voxels = (0..grid.len()).map(|n| (n * 37 % 4096) as i16 - 1024).collect();
    Volume::new(grid, voxels, 1.0, 0.0).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn every_volume_is_read_back_exactly(
        shape in [1usize..9, 1usize..9, 1usize..9],
        angles in [-3.2f64..3.2, -1.6f64..1.6, -3.2f64..3.2],
        spacing in [0.05f64..9.0, 0.05f64..9.0, 0.05f64..9.0],
        origin in [-900.0f64..900.0, -900.0f64..900.0, -900.0f64..900.0],
        mirrored: bool,
        seed: u16,
        gz: bool,
        scaling in prop::sample::select(vec![(1.0f32, 0.0f32), (1.0, -1024.0), (0.5, 3.0), (-2.0, 10.0), (0.3, 0.0)]),
    ) {
        let grid = Grid { shape, affine: rotation(angles, spacing, mirrored, origin) };
        let voxels: Vec<i16> = (0..grid.len()).map(|n| (n as u16).wrapping_mul(seed) as i16).collect();
        let volume = Volume::new(grid, voxels, scaling.0, scaling.1).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(if gz { "v.nii.gz" } else { "v.nii" });
        nifti::write(&path, &volume).unwrap();
        let back = nifti::read(&path).unwrap();
        // There are no warnings. In particular the qform equals the sform.
        prop_assert_eq!(&back.warnings, &Vec::<String>::new());
        prop_assert_eq!(back.volume.grid(), volume.grid());
        let hu = |volume: &Volume| volume.voxels().iter().map(|&stored| volume.hu(stored)).collect::<Vec<_>>();
        prop_assert_eq!(hu(&back.volume), hu(&volume));
        if hu(&volume).iter().all(|hu| hu.fract() == 0.0 && hu.abs() < 32768.0) {
            prop_assert_eq!((back.volume.slope(), back.volume.intercept()), (1.0, 0.0));
        }
        // With the qform only, the voxels have the same positions.
        let mut bytes = fs::read(&path).unwrap();
        if !gz {
            bytes[254] = 0;
            fs::write(&path, bytes).unwrap();
            let by_qform = nifti::read(&path).unwrap();
            let corner = shape.map(|n| n - 1);
            let moved = by_qform.volume.grid().mm(corner) - volume.grid().mm(corner);
            prop_assert!(moved.norm() < 1e-3 * 9.0 * 9.0, "{:?}", moved);
        }
    }
}

#[test]
fn the_nifti_crate_reads_the_same_voxels_and_positions() {
    let volume = ramp([7, 6, 5]);
    let folder = tempfile::tempdir().unwrap();
    for name in ["v.nii", "v.nii.gz"] {
        let path = folder.path().join(name);
        nifti::write(&path, &volume).unwrap();
        let object = ::nifti::ReaderOptions::new().read_file(&path).unwrap();
        let header = object.header();
        assert_eq!((header.qform_code, header.sform_code, header.xyzt_units & 7), (1, 1, 2));
        for (row, ours) in
            [header.srow_x, header.srow_y, header.srow_z].iter().zip(volume.grid().affine.rows())
        {
            assert_eq!(row.map(f64::from), ours);
        }
        for (n, &voxel) in volume.voxels().iter().enumerate() {
            let at = volume.grid().point(n).map(|index| index as u16);
            assert_eq!(object.volume().get_f64(&at).unwrap(), f64::from(voxel), "{name} at {at:?}");
        }
        assert_eq!(object.volume().dim(), [7, 6, 5]);
    }
}

#[test]
fn rounding_of_the_header_to_f32_moves_the_volume_very_little() {
    let grid = Grid {
        shape: [3, 3, 3],
        affine: Affine::from_spacing([0.1, 0.7, 1.0 / 3.0], [1e3, -0.3, 0.0]).unwrap(),
    };
    let volume = Volume::new(grid, vec![0; 27], 1.0, 0.0).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.nii");
    nifti::write(&path, &volume).unwrap();
    let difference = nifti::read(&path).unwrap().volume.grid().mm([2; 3]) - grid.mm([2; 3]);
    assert!(difference.norm() < 1e-4 && difference.norm() > 0.0);
}

#[test]
fn volumes_of_many_portions_are_read_back_with_their_statistics() {
    let volume = ramp([70, 65, 61]);
    let folder = tempfile::tempdir().unwrap();
    for name in ["v.nii", "v.nii.gz"] {
        let path = folder.path().join(name);
        nifti::write(&path, &volume).unwrap();
        let back = nifti::read(&path).unwrap();
        assert!(back.volume == volume);
        let sum: i64 = volume.voxels().iter().map(|&stored| i64::from(stored)).sum();
        assert_eq!((back.stats.min, back.stats.max, back.stats.sum), (-1024.0, 3071.0, sum as f64));
    }
}

#[test]
fn refused_writes_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let volume = ramp([4, 3, 2]);
    let at = |name: &str| folder.path().join(name);
    let error = nifti::write(at("v.png"), &volume).unwrap_err();
    assert!(matches!(error, VolumeError::Extension { .. }) && error.to_string().contains("v.png"), "{error}");

    let mut rows = volume.grid().affine.rows();
    rows[1][2] += 0.02;
    let sheared = Grid { affine: Affine::from_rows(rows).unwrap(), ..*volume.grid() };
    let error = nifti::Writer::create(at("v.nii"), sheared).err().unwrap();
    assert!(matches!(error, VolumeError::Sheared { cosine, .. } if cosine > 1e-3), "{error}");

    let long = Grid { shape: [32768, 1, 1], ..*volume.grid() };
    assert!(matches!(nifti::Writer::create(at("v.nii"), long).err(), Some(VolumeError::WriteShape { .. })));

    let error = nifti::write(at("missing/v.nii.gz"), &volume).unwrap_err();
    assert!(
        matches!(error, VolumeError::Io { .. }) && error.to_string().contains("missing/v.nii.gz"),
        "{error}"
    );

    fs::create_dir(at("folder.nii")).unwrap();
    let error = nifti::write(at("folder.nii"), &volume).unwrap_err();
    assert!(matches!(error, VolumeError::Io { .. }), "{error}");
    assert_eq!(names(folder.path()), ["folder.nii"]);
}

#[test]
fn writers_count_voxels_and_keep_the_old_file_until_they_finish() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.nii.gz");
    let volume = ramp([4, 3, 2]);
    fs::write(&path, b"old").unwrap();

    let mut writer = nifti::Writer::create(&path, *volume.grid()).unwrap();
    writer.push_slices(&volume.voxels()[..12]).unwrap();
    assert!(matches!(writer.finish(), Err(VolumeError::Pushed { expected: 24, found: 12, .. })));
    let mut writer = nifti::Writer::create(&path, *volume.grid()).unwrap();
    assert!(matches!(writer.push_slices(&[0; 25]), Err(VolumeError::Pushed { expected: 24, found: 25, .. })));
    drop(writer);
    assert_eq!(fs::read(&path).unwrap(), b"old");

    let mut writer = nifti::Writer::create(&path, *volume.grid()).unwrap();
    volume.voxels().chunks(5).for_each(|part| writer.push_slices(part).unwrap());
    writer.finish().unwrap();
    assert_eq!(nifti::read(&path).unwrap().volume, volume);
    assert_eq!(names(folder.path()), ["v.nii.gz"]);
}
