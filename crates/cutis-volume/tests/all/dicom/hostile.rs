//! Damaged files give a typed error that names them. Nothing panics, and nothing allocates more
//! than the files can hold.

use std::fs;

use cutis_volume::{VolumeError, dicom::DicomError};
use dicom_core::value::{PixelFragmentSequence, Value};
use dicom_core::{DataElement, Tag, VR};
use proptest::prelude::*;

use super::file::{Folder, Slice};

fn bytes_of(slice: &Slice) -> Vec<u8> {
    let folder = Folder::of(std::slice::from_ref(slice));
    fs::read(folder.path("0.dcm")).unwrap()
}

fn read(bytes: &[u8]) -> Result<cutis_volume::Loaded, VolumeError> {
    let folder = Folder::new();
    fs::write(folder.path("0.dcm"), bytes).unwrap();
    folder.read()
}

#[test]
fn a_file_that_ends_anywhere_is_refused() {
    for syntax in ["1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2"] {
        let bytes = bytes_of(&Slice { syntax, ..Slice::at(0.0) });
        assert!(read(&bytes).is_ok());
        for end in 0..bytes.len() {
            let error = read(&bytes[..end]).unwrap_err();
            assert!(matches!(error, VolumeError::Dicom(_)), "{end}: {error}");
        }
    }
}

#[test]
fn lengths_beyond_the_file_are_refused() {
    let mut bytes = bytes_of(&Slice::at(0.0));
    let pixels = bytes.windows(6).position(|six| six == b"\xe0\x7f\x10\x00OW").unwrap();
    bytes[pixels + 8..pixels + 12].copy_from_slice(&0xfffffff0u32.to_le_bytes());
    let error = read(&bytes).unwrap_err();
    assert!(error.to_string().contains("longer than the rest"), "{error}");
    let huge = Slice::at(0.0).number(0x0028_0010, 65535).number(0x0028_0011, 65535);
    let error = Folder::of(&[huge]).refused();
    assert!(matches!(error, DicomError::Pixels { .. }), "{error}");
}

/// The parser takes the length of an element of unknown type from another place. It allocated 775
/// MB for this file of 1 KB.
#[test]
fn file_meta_information_is_read_as_the_parser_reads_it() {
    let good = bytes_of(&Slice::at(0.0));
    let find = |mark: &[u8]| good.windows(mark.len()).position(|part| part == mark).unwrap();
    let mut unknown = good.clone();
    let at = find(b"\x02\x00\x10\x00UI") + 4;
    unknown[at..at + 2].copy_from_slice(b"zz");
    let error = read(&unknown).unwrap_err().to_string();
    assert!(error.contains("file meta information is incomplete"), "{error}");
    // The length of the group reaches into the data set, whose lengths have another form.
    let mut long = good.clone();
    let at = find(b"\x02\x00\x00\x00UL\x04\x00") + 8;
    let length = u32::from_le_bytes(good[at..at + 4].try_into().unwrap());
    long[at..at + 4].copy_from_slice(&(length + 40).to_le_bytes());
    let error = read(&long).unwrap_err().to_string();
    assert!(error.contains("ends before the length"), "{error}");
}

/// A slice whose pixels are the fragment of a compressed stream.
fn compressed(syntax: &'static str, stream: Vec<u8>) -> Slice {
    let mut slice = Slice { syntax, ..Slice::at(0.0) };
    let sequence = PixelFragmentSequence::new(Vec::<u32>::new(), vec![stream]);
    slice.object.put(DataElement::new(Tag(0x7fe0, 0x0010), VR::OB, Value::PixelSequence(sequence)));
    slice
}

/// Twelve pixels of value 0x3e8 in run length encoding.
fn runs() -> Vec<u8> {
    let mut stream = vec![0u8; 64];
    stream[..12].copy_from_slice(&[2, 0, 0, 0, 64, 0, 0, 0, 66, 0, 0, 0]);
    stream.extend([245, 0x03, 245, 0xe8]);
    stream
}

#[test]
fn run_length_encoding_is_read_and_short_runs_are_refused() {
    let loaded = Folder::of(&[compressed("1.2.840.10008.1.2.5", runs())]).read().unwrap();
    assert_eq!(super::file::hu(&loaded), [-24.0; 12]);
    for change in [(66, 250), (64, 250), (8, 70), (0, 3), (4, 255)] {
        let mut stream = runs();
        stream[change.0] = change.1;
        let error = Folder::of(&[compressed("1.2.840.10008.1.2.5", stream)]).refused();
        assert!(matches!(error, DicomError::Pixels { .. }), "{error}");
    }
}

#[test]
fn compressions_that_are_not_read_are_refused_by_name_and_with_a_remedy() {
    for (uid, words) in [
        ("1.2.840.10008.1.2.4.80", ["JPEG-LS", "dcmdjpls"]),
        ("1.2.840.10008.1.2.4.81", ["JPEG-LS", "gdcmconv"]),
    ] {
        let error = Folder::of(&[compressed(uid, vec![0; 8])]).refused();
        assert!(matches!(error, DicomError::Compression { .. }), "{error}");
        assert!(words.iter().all(|word| error.to_string().contains(word)), "{error}");
    }
    // The library writes no file with a syntax that it does not know.
    let bytes = bytes_of(&compressed("1.2.840.10008.1.2.4.80", vec![0; 8]));
    let at = bytes.windows(22).position(|part| part == b"1.2.840.10008.1.2.4.80").unwrap();
    for (uid, word) in [(b"1.2.840.10008.1.2.4.55", "retired"), (b"1.2.840.10008.1.2.4.99", "does not know")]
    {
        let mut bytes = bytes.clone();
        bytes[at..at + 22].copy_from_slice(uid);
        let error = read(&bytes).unwrap_err();
        assert!(
            matches!(&error, VolumeError::Dicom(e) if matches!(**e, DicomError::Compression { .. })),
            "{error}"
        );
        assert!(error.to_string().contains(word), "{error}");
    }
}

#[test]
fn jpeg_of_another_size_is_refused() {
    let stream = vec![0xff, 0xd8, 0xff, 0xc3, 0, 11, 12, 0, 200, 0, 200, 1, 1, 0x11, 0, 0xff, 0xd9, 0];
    let error = Folder::of(&[compressed("1.2.840.10008.1.2.4.70", stream)]).refused();
    assert!(error.to_string().contains("Columns x Rows"), "{error}");
    let stream = vec![0xff, 0xd8, 0xff, 0xc3, 0, 11, 12, 0, 3, 0, 4, 1, 1, 0x11, 0, 0xff, 0xd9, 0];
    let error = Folder::of(&[compressed("1.2.840.10008.1.2.4.70", stream)]).refused();
    assert!(matches!(error, DicomError::Pixels { .. }), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn changed_bytes_never_panic(changes in prop::collection::vec((132usize..1200, any::<u8>()), 1..6), rle: bool) {
        let mut bytes = match rle {
            true => bytes_of(&compressed("1.2.840.10008.1.2.5", runs())),
            false => bytes_of(&Slice::at(0.0)),
        };
        for (at, value) in changes {
            let at = 132 + (at - 132) % (bytes.len() - 132);
            bytes[at] = value;
        }
        if let Err(error) = read(&bytes) {
            prop_assert!(!error.to_string().is_empty());
        }
    }
}
