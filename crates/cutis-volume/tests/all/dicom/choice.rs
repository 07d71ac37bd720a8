//! One series of a folder is chosen, and other files are left out.

use std::fs;

use cutis_volume::{ReadOptions, dicom, dicom::DicomError};
use dicom_core::VR;

use super::file::{Folder, Slice, hu, shows_no_patient};

fn series(number: &str, uid: &str, value: u16) -> [Slice; 2] {
    [0.0, 2.0].map(|z| {
        Slice::at(z).text(0x0020_0011, VR::IS, number).text(0x0020_000e, VR::UI, uid).pixels(&[value; 12])
    })
}

fn number(series: u32) -> ReadOptions {
    ReadOptions { series: Some(series), resample: false }
}

#[test]
fn several_series_are_listed_and_one_is_chosen_by_number_or_file() {
    let slices = [series("3", "1.2.3.424242.5", 1000), series("12", "1.2.3.424242.6", 2000)].concat();
    let folder = Folder::of(&slices);
    let error = folder.refused();
    let message = error.to_string();
    assert!(matches!(error, DicomError::SeveralSeries { .. }), "{message}");
    for part in ["series 3: \"thin slices\", 2 slices of 4 x 3 pixels", "series 12", "volume.series"] {
        assert!(message.contains(part), "{message}");
    }
    assert_eq!(hu(&folder.read_with(&number(12)).unwrap()), [976.0; 24]);
    assert_eq!(hu(&folder.read_with(&number(3)).unwrap()), [-24.0; 24]);
    let read = cutis_volume::read(folder.path("3.dcm"), &ReadOptions::default()).unwrap();
    assert_eq!(hu(&read), [976.0; 24]);
    let error = folder.read_with(&number(4)).unwrap_err().to_string();
    assert!(error.contains("no series with the number 4") && error.contains("series 12"), "{error}");
}

#[test]
fn two_series_with_one_number_are_chosen_by_a_file() {
    let slices = [series("3", "1.2.3.424242.5", 1000), series("3", "1.2.3.424242.6", 2000)].concat();
    let folder = Folder::of(&slices);
    let error = folder.read_with(&number(3)).unwrap_err().to_string();
    assert!(error.contains("2 series with the number 3") && error.contains("2.dcm"), "{error}");
    let read = cutis_volume::read(folder.path("2.dcm"), &ReadOptions::default()).unwrap();
    assert_eq!(hu(&read), [976.0; 24]);
}

#[test]
fn localizers_reports_and_other_files_are_left_out() {
    let folder = Folder::of(&Slice::stack(&[0.0, 2.0]));
    Slice::at(1.0).text(0x0008_0008, VR::CS, "ORIGINAL\\PRIMARY\\LOCALIZER").write(folder.path("a.dcm"));
    Slice::at(1.0).text(0x0008_0060, VR::CS, "SR").without(0x7fe0_0010).write(folder.path("b.dcm"));
    Slice::at(1.0).text(0x0008_0016, VR::UI, "1.2.840.10008.5.1.4.1.1.7").write(folder.path("c.dcm"));
    fs::write(folder.path("notes.txt"), "notes").unwrap();
    let loaded = folder.read().unwrap();
    assert_eq!(loaded.volume.grid().shape, [4, 3, 2]);
    for part in ["1 localizer file", "modality SR", "picture of a screen", "not in DICOM format"] {
        assert!(loaded.warnings[0].contains(part), "{:?}", loaded.warnings);
    }
    for n in 0..2 {
        fs::remove_file(folder.path(&format!("{n}.dcm"))).unwrap();
    }
    let error = folder.refused().to_string();
    assert!(error.contains("no CT series") && error.contains("modality SR"), "{error}");
    let empty = Folder::new().refused().to_string();
    assert!(empty.contains("the folder is empty"), "{empty}");
}

#[test]
fn subfolders_belong_to_the_folder() {
    let folder = Folder::of(&[Slice::at(0.0)]);
    fs::create_dir(folder.path("sub")).unwrap();
    Slice::at(2.0).write(folder.path("sub/x"));
    assert_eq!(folder.read().unwrap().volume.grid().shape, [4, 3, 2]);
}

#[test]
fn a_listing_has_every_series_and_why_one_cannot_be_read() {
    let tilted = |z: f64| Slice::at(z).text(0x0020_0037, VR::DS, "1\\0\\0\\0\\0.8\\-0.6");
    let mut slices = Vec::from(series("3", "1.2.3.424242.5", 1000));
    slices.extend([tilted(0.0), tilted(2.0)]);
    slices.push(Slice::at(0.0).text(0x0020_0011, VR::IS, "9").without(0x0028_1052));
    let folder = Folder::of(&slices);
    let listing = dicom::list(folder.0.path()).unwrap();
    shows_no_patient(&format!("{listing:?}"));
    let [a, b, c] = &listing.series[..] else { panic!("{listing:?}") };
    assert_eq!((a.number, a.slices, a.hu, a.problem.is_none()), (Some(3), 2, Some([-24.0, -24.0]), true));
    assert_eq!(
        (a.size, a.spacing_mm, a.slice_distance_mm),
        (Some([4, 3]), Some([1.5, 2.0]), Some([2.0, 2.0]))
    );
    assert_eq!((b.number, b.needs_resampling, b.hu), (Some(7), true, Some([-24.0, -13.0])));
    assert!((b.tilt_deg.unwrap() - 36.87).abs() < 0.01, "{b:?}");
    assert!(c.problem.as_ref().unwrap().contains("RescaleIntercept") && !c.needs_resampling, "{c:?}");
}

#[test]
fn damaged_files_are_listed_and_the_other_series_described() {
    let mut slices = Vec::from(series("3", "1.2.3.424242.5", 1000));
    // Pixels of a slice that end early.
    slices.extend([Slice::at(0.0), Slice::at(2.0).pixels(&[1; 11]), Slice::at(4.0).pixels(&[1; 11])]);
    let folder = Folder::of(&slices);
    let listing = dicom::list(folder.0.path()).unwrap();
    let [a, b] = &listing.series[..] else { panic!("{listing:?}") };
    assert_eq!((a.hu, &a.problem, listing.damaged.len()), (Some([-24.0, -24.0]), &None, 0));
    let problem = b.problem.as_ref().unwrap();
    assert!(problem.contains("3.dcm") && problem.contains("1 more slice"), "{problem}");
    assert_eq!((b.slices, b.hu, b.needs_resampling), (3, Some([-24.0, -13.0]), false));
    // A file whose series is unknown.
    let whole = fs::read(folder.path("0.dcm")).unwrap();
    fs::write(folder.path("5.dcm"), &whole[..400]).unwrap();
    fs::write(folder.path("6.dcm"), &whole[..300]).unwrap();
    let listing = dicom::list(folder.0.path()).unwrap();
    shows_no_patient(&format!("{listing:?}"));
    let [first, second] = &listing.damaged[..] else { panic!("{listing:?}") };
    assert!(first.contains("5.dcm") && second.contains("6.dcm"), "{listing:?}");
    assert_eq!((listing.series.len(), listing.series[0].hu), (2, Some([-24.0, -24.0])));
    // A run is refused by the name of the file.
    let error = folder.read_with(&ReadOptions { series: Some(3), ..ReadOptions::default() }).unwrap_err();
    assert!(error.to_string().contains("5.dcm"), "{error}");
}

#[test]
fn every_byte_of_the_series_is_observed_in_the_order_of_the_slices() {
    let folder = Folder::of(&Slice::stack(&[2.0, 0.0]));
    let mut bytes: Vec<u8> = Vec::new();
    let options = ReadOptions::default();
    cutis_volume::read_observed(folder.0.path(), &options, |_, part| bytes.extend(part)).unwrap();
    let expected =
        [fs::read(folder.path("1.dcm")).unwrap(), fs::read(folder.path("0.dcm")).unwrap()].concat();
    assert!(bytes == expected);
}
