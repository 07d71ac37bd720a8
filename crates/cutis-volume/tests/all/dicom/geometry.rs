//! Slices are in the right place and order, or the series is refused.

use cutis_volume::{Loaded, ReadOptions, dicom::DicomError};
use dicom_core::VR;
use nalgebra::Point3;

use super::file::{Folder, SIZE, Slice, hu};

const RESAMPLE: ReadOptions = ReadOptions { series: None, resample: true };

/// Slices tilted about the x axis by 3-4-5 triangles: cosine 0.8, sine 0.6. They lie along z.
fn tilted(z_mm: &[f64], stored: impl Fn([f64; 3]) -> u16) -> Vec<Slice> {
    let slice = |&z: &f64| {
        let place = |n: usize| {
            let (column, row) = ((n % SIZE[0]) as f64 * 1.5, (n / SIZE[0]) as f64 * 2.0);
            [10.0 + column, 20.0 + 0.8 * row, z - 0.6 * row]
        };
        let pixels: Vec<u16> = (0..SIZE[0] * SIZE[1]).map(|n| stored(place(n))).collect();
        Slice::at(z).text(0x0020_0037, VR::DS, "1\\0\\0\\0\\0.8\\-0.6").pixels(&pixels)
    };
    z_mm.iter().map(slice).collect()
}

fn near(found: Point3<f64>, expected: [f64; 3]) {
    assert!((found - Point3::from(expected)).norm() < 1e-9, "{found:?} is not {expected:?}");
}

#[test]
fn positions_become_ras() {
    let loaded = Folder::of(&Slice::stack(&[30.0, 32.0, 34.0])).read().unwrap();
    let grid = loaded.volume.grid();
    assert_eq!(grid.shape, [4, 3, 3]);
    assert_eq!(grid.affine.orientation(), ['L', 'P', 'S']);
    near(grid.mm([0, 0, 0]), [-10.0, -20.0, 30.0]);
    // Columns are 1.5 mm apart, rows 2 mm.
    near(grid.mm([3, 2, 1]), [-14.5, -24.0, 32.0]);
}

#[test]
fn coronal_slices_are_stacked_along_their_normal() {
    // Rows to the left, columns downwards: the normal is to the back.
    let slice =
        |y: f64| Slice::at(0.0).text(0x0020_0037, VR::DS, "1\\0\\0\\0\\0\\-1").position([0.0, y, 0.0]);
    let loaded = Folder::of(&[slice(3.0), slice(0.0)]).read().unwrap();
    assert_eq!(loaded.volume.grid().affine.orientation(), ['L', 'I', 'P']);
    near(loaded.volume.grid().mm([0, 0, 1]), [0.0, -3.0, 0.0]);
}

#[test]
fn slices_are_sorted_by_position_and_not_by_name() {
    let values = |z: f64| Slice::at(z).pixels(&[z as u16; 12]);
    let loaded = Folder::of(&[values(34.0), values(30.0), values(32.0)]).read().unwrap();
    let first: Vec<f32> = hu(&loaded).iter().step_by(12).copied().collect();
    assert_eq!(first, [-994.0, -992.0, -990.0]);
    near(loaded.volume.grid().mm([0, 0, 2]), [-10.0, -20.0, 34.0]);
}

#[test]
fn two_slices_at_one_position_are_refused_by_name() {
    let error = Folder::of(&Slice::stack(&[0.0, 2.0, 4.0, 2.0])).refused();
    let DicomError::SamePosition { first, second, .. } = &error else { panic!("{error}") };
    assert!(first.path.ends_with("1.dcm") && second.path.ends_with("3.dcm"), "{error}");
    assert!(Folder::of(&Slice::stack(&[0.0, 2.0, 4.0])).read().is_ok());
}

#[test]
fn missing_slices_are_refused_by_name() {
    let folder = Folder::of(&Slice::stack(&[0.0, 2.0, 4.0, 10.0, 12.0]));
    let error = folder.refused();
    let DicomError::MissingSlices { before, after, count: 2, .. } = &error else { panic!("{error}") };
    assert!(before.path.ends_with("2.dcm") && after.path.ends_with("3.dcm"), "{error}");
    // Nothing invents the tissue of a missing slice.
    assert!(folder.read_with(&RESAMPLE).is_err());
}

#[test]
fn small_differences_of_the_distance_warn_and_large_ones_are_refused() {
    let read = |z: &[f64]| Folder::of(&Slice::stack(z)).read();
    assert_eq!(read(&[0.0, 2.0, 4.01, 6.0]).unwrap().warnings, Vec::<String>::new());
    let loaded = read(&[0.0, 2.0, 4.1, 6.1]).unwrap();
    assert!(loaded.warnings[0].contains("2.000 to 2.100 mm"), "{:?}", loaded.warnings);
    near(loaded.volume.grid().mm([0, 0, 3]), [-10.0, -20.0, 6.1]);
    let error = Folder::of(&Slice::stack(&[0.0, 2.0, 4.0, 7.1])).refused();
    assert!(matches!(error, DicomError::UnevenSlices { .. }), "{error}");
    assert!(error.to_string().contains("volume.resample = true"), "{error}");
}

#[test]
fn tilt_comes_from_positions_and_never_from_its_attribute() {
    let error = Folder::of(&tilted(&[0.0, 2.0, 4.0], |_| 1000)).refused();
    let DicomError::Tilted { tilt_deg, .. } = &error else { panic!("{error}") };
    assert!((tilt_deg - 0.6f64.asin().to_degrees()).abs() < 1e-9, "{error}");
    assert!(error.to_string().contains("--resample"), "{error}");
    // The attribute alone tilts nothing.
    let upright: Vec<Slice> =
        Slice::stack(&[0.0, 2.0]).into_iter().map(|slice| slice.text(0x0018_1120, VR::DS, "20")).collect();
    assert!(!Folder::of(&upright).read().unwrap().volume.grid().affine.is_sheared());
}

/// Whether a place lies within both of the tilted slices next to it.
fn inside(z_mm: &[f64], [_, y, z]: [f64; 3]) -> bool {
    // The normal of the slices is (0, 0.6, 0.8), and their columns run along (0, 0.8, -0.6).
    let along = 0.6 * (y - 20.0) + 0.8 * z;
    let above = z_mm.iter().position(|z| 0.8 * z >= along - 1e-6).unwrap_or(z_mm.len() - 1);
    let within = |&slice: &f64| (-1e-6..=4.0 + 1e-6).contains(&(0.8 * (y - 20.0) - 0.6 * (z - slice)));
    z_mm[above.saturating_sub(1)..=above].iter().all(within)
}

/// Largest difference of the volume from a field, over the voxels within the slices, and their
/// number.
fn difference(loaded: &Loaded, z_mm: &[f64], field: impl Fn([f64; 3]) -> f64) -> (f64, usize) {
    let grid = loaded.volume.grid();
    let (mut largest, mut count) = (0.0f64, 0);
    for (n, hu) in hu(loaded).into_iter().enumerate() {
        let ras = grid.mm(grid.point(n));
        let at = [-ras.x, -ras.y, ras.z];
        if inside(z_mm, at) {
            largest = largest.max((f64::from(hu) - field(at)).abs());
            count += 1;
        }
    }
    (largest, count)
}

#[test]
fn a_resampled_scan_has_each_value_in_its_place() {
    let field = |[x, y, z]: [f64; 3]| 10.0 * (x - 10.0) + 20.0 * (y - 20.0) + 30.0 * z;
    let stored = |at: [f64; 3]| (field(at) + 1024.0).round() as u16;
    // Tilted with equal distances, and with uneven ones.
    for z_mm in [&[0.0, 2.0, 4.0, 6.0, 8.0][..], &[0.0, 2.0, 5.0, 6.5, 7.0]] {
        let loaded = Folder::of(&tilted(z_mm, stored)).read_with(&RESAMPLE).unwrap();
        let grid = loaded.volume.grid();
        assert!(!grid.affine.is_sheared() && grid.shape[1] > SIZE[1], "{grid:?}");
        let (largest, count) = difference(&loaded, z_mm, field);
        assert!(largest <= 1.0 && count >= 16, "{largest} HU in {count} voxels");
        // Control: in another place the values differ.
        assert!(difference(&loaded, z_mm, |[x, y, z]| field([x, y, z + 0.5])).0 > 10.0);
        let tilt = |warning: &String| warning.contains("36.9 degrees");
        assert!(loaded.warnings.iter().any(tilt), "{:?}", loaded.warnings);
    }
    // Without a tilt and with equal distances nothing is resampled.
    let slices = Slice::stack(&[0.0, 2.0, 4.0]);
    let folder = Folder::of(&slices);
    assert_eq!(folder.read_with(&RESAMPLE).unwrap().volume, folder.read().unwrap().volume);
}

#[test]
fn padding_is_not_averaged_into_tissue() {
    let stored = |[_, y, _]: [f64; 3]| if y > 20.5 { 1064 } else { 0 };
    let slices: Vec<Slice> = tilted(&[0.0, 2.0, 4.0], stored)
        .into_iter()
        .map(|slice| {
            slice.number(0x0028_0120, 0).text(0x0028_1052, VR::DS, "-1024").text(0x0028_1053, VR::DS, "1")
        })
        .collect();
    let loaded = Folder::of(&slices).read_with(&RESAMPLE).unwrap();
    let lowest = hu(&loaded).into_iter().fold(f32::INFINITY, f32::min);
    assert_eq!(lowest, -1024.0);
}

#[test]
fn slices_of_another_size_or_orientation_are_another_series() {
    let other = Slice::at(4.0).number(0x0028_0010, 2).pixels(&[7; 8]);
    let error = Folder::of(&[Slice::at(0.0), Slice::at(2.0), other]).refused();
    assert!(matches!(&error, DicomError::SeveralSeries { series, .. } if series.len() == 2), "{error}");
    let turned = Slice::at(4.0).text(0x0020_0037, VR::DS, "0\\1\\0\\-1\\0\\0");
    assert!(matches!(Folder::of(&[Slice::at(0.0), turned]).refused(), DicomError::SeveralSeries { .. }));
}

#[test]
fn invalid_geometry_is_refused_by_name() {
    for (word, tag, text) in [
        ("ImagePositionPatient", 0x0020_0032, "1\\2"),
        ("ImagePositionPatient", 0x0020_0032, "1\\2\\inf"),
        ("ImageOrientationPatient", 0x0020_0037, "1\\0\\0\\1\\0\\0"),
        ("ImageOrientationPatient", 0x0020_0037, "2\\0\\0\\0\\1\\0"),
        ("PixelSpacing", 0x0028_0030, "0\\1"),
        ("PixelSpacing", 0x0028_0030, "-1\\1"),
    ] {
        let error = Folder::of(&[Slice::at(0.0).text(tag, VR::DS, text)]).refused();
        assert!(error.to_string().contains(word) && error.to_string().contains("0.dcm"), "{error}");
    }
}

#[test]
fn one_slice_has_its_thickness() {
    let loaded = Folder::of(&[Slice::at(5.0)]).read().unwrap();
    assert_eq!(loaded.volume.grid().affine.spacing_mm(), [1.5, 2.0, 2.0]);
    assert!(loaded.warnings[0].contains("one slice"), "{:?}", loaded.warnings);
}
