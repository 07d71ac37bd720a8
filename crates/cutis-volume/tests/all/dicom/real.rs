//! Real series, where the data folder is present. Other programs read the lossless ones with the
//! same sum of HU.

use std::fs;

use cutis_test_kit::scans;
use cutis_volume::{ReadOptions, VolumeError, dicom::DicomError};
use dicom_core::value::{PixelFragmentSequence, Value};
use dicom_core::{DataElement, VR};

const RESAMPLE: ReadOptions = ReadOptions { series: None, resample: true };
/// Sum of HU of the slice in `transfer_syntaxes`, as pydicom and GDCM read it.
const SUM: f64 = -248_794_693.0;
/// Sum of HU of `abdomen_j2k`, as pydicom and GDCM read it.
const SUM_ABDOMEN: f64 = -3_272_217_339.0;

fn refused(name: &str, options: &ReadOptions) -> Option<DicomError> {
    let folder = scans::find(&format!("dicom/{name}"))?;
    match cutis_volume::read(folder, options) {
        Err(VolumeError::Dicom(error)) => Some(*error),
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn bad_series_are_refused_by_name() {
    let plain = ReadOptions::default();
    let Some(error) = refused("bad_gantrytilting_001", &plain) else { return };
    assert!(matches!(error, DicomError::Tilted { tilt_deg, .. } if (tilt_deg - 14.0).abs() < 0.1), "{error}");
    let error = refused("bad_notavolume_001", &RESAMPLE).unwrap();
    assert!(matches!(error, DicomError::SamePosition { .. }), "{error}");
    let error = refused("bad_sliceincrement_001", &RESAMPLE).unwrap();
    assert!(matches!(error, DicomError::MissingSlices { count: 1, .. }), "{error}");
    let error = refused("head_tilt_variable_spacing", &plain).unwrap();
    assert!(matches!(error, DicomError::Tilted { tilt_deg, .. } if (tilt_deg - 18.5).abs() < 0.1), "{error}");
}

#[test]
fn tilted_heads_are_resampled() {
    let Some(folder) = scans::find("dicom/head_tilt_variable_spacing") else { return };
    let loaded = cutis_volume::read(folder, &RESAMPLE).unwrap();
    let grid = loaded.volume.grid();
    assert!(!grid.affine.is_sheared());
    // The top of the last slice, and the bottom of the first one, are within the new grid.
    let [nx, ny, nz] = grid.shape;
    assert!(nx == 512 && ny > 512 && nz == 113, "{grid:?}");
    assert!(loaded.volume.voxels().iter().all(|&hu| (-1024..=2121).contains(&hu)));
}

#[test]
fn transfer_syntaxes_are_read_with_equal_values_or_refused() {
    let Some(folder) = scans::find("dicom/transfer_syntaxes") else { return };
    let (mut exact, mut lossy, mut refused) = (0, 0, 0);
    for entry in fs::read_dir(folder).unwrap() {
        let file = entry.unwrap();
        let alone = tempfile::tempdir().unwrap();
        fs::copy(file.path(), alone.path().join("slice.dcm")).unwrap();
        match cutis_volume::read(alone.path(), &ReadOptions::default()) {
            Ok(loaded) if loaded.stats.sum == SUM => exact += 1,
            Ok(loaded) => {
                assert!((loaded.stats.sum / SUM - 1.0).abs() < 0.02, "{:?}: {:?}", file.path(), loaded.stats);
                assert!(
                    loaded.warnings.iter().any(|warning| warning.contains("with a loss")),
                    "{:?}",
                    file.path()
                );
                lossy += 1;
            }
            Err(VolumeError::Dicom(error)) => {
                let message = error.to_string();
                assert!(message.contains("slice.dcm") && message.contains("gdcmconv"), "{message}");
                refused += 1;
            }
            Err(error) => panic!("{error}"),
        }
    }
    let jpeg2000 = cfg!(feature = "dicom-jpeg2000");
    assert_eq!((exact, lossy, refused), if jpeg2000 { (9, 2, 5) } else { (8, 1, 7) });
}

#[test]
fn jpeg_2000_is_read_with_its_feature() {
    let Some(folder) = scans::find("dicom/abdomen_j2k") else { return };
    match cutis_volume::read(folder, &ReadOptions::default()) {
        Ok(loaded) if cfg!(feature = "dicom-jpeg2000") => {
            assert_eq!(loaded.volume.grid().shape, [512, 512, 20]);
            // The sum of pydicom with GDCM.
            assert_eq!(loaded.stats.sum, SUM_ABDOMEN);
            assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        }
        Err(error) if !cfg!(feature = "dicom-jpeg2000") => {
            assert!(error.to_string().contains("feature dicom-jpeg2000"), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_frame_in_several_fragments_is_read() {
    let name =
        "dicom/transfer_syntaxes/CTImage.dcm_JPEGProcess14SV1TransferSyntax_1.2.840.10008.1.2.4.70.dcm";
    let Some(file) = scans::find(name) else { return };
    let mut object = dicom_object::open_file(file).unwrap();
    let tag = dicom_core::Tag(0x7fe0, 0x0010);
    let stream = object.element(tag).unwrap().fragments().unwrap().concat();
    // Three fragments of even size.
    let fragments: Vec<Vec<u8>> = stream.chunks((stream.len() / 3) & !1).map(<[u8]>::to_vec).collect();
    assert!(fragments.len() > 2);
    let pixels = PixelFragmentSequence::new(Vec::<u32>::new(), fragments);
    object.put(DataElement::new(tag, VR::OB, Value::PixelSequence(pixels)));
    let folder = tempfile::tempdir().unwrap();
    object.write_to_file(folder.path().join("slice.dcm")).unwrap();
    let loaded = cutis_volume::read(folder.path(), &ReadOptions::default()).unwrap();
    assert_eq!(loaded.stats.sum, SUM);
}
