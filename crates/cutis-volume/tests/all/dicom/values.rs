//! Stored values become the right HU.

use cutis_volume::{VolumeError, dicom::DicomError};
use dicom_core::{DataElement, PrimitiveValue, VR, value::DataSetSequence};

use super::file::{Folder, SIZE, Slice, hu};

const PIXELS: usize = SIZE[0] * SIZE[1];

#[test]
fn values_are_hu_in_the_order_of_rows() {
    let loaded = Folder::of(&Slice::stack(&[0.0, 2.0])).read().unwrap();
    let slice: Vec<f32> = (0..12).map(|n| (n - 24) as f32).collect();
    assert_eq!(hu(&loaded), [&slice[..], &slice[..]].concat());
    assert_eq!((loaded.stats.min, loaded.stats.max, loaded.dtype), (-24.0, -13.0, "uint16"));
    assert_eq!(loaded.warnings, Vec::<String>::new());
}

#[test]
fn unused_high_bits_are_not_part_of_the_value() {
    let stored: Vec<u16> = (0..12).map(|n| (1000 + n) | 0xb000).collect();
    let loaded = Folder::of(&[Slice::at(0.0).pixels(&stored), Slice::at(2.0)]).read().unwrap();
    assert_eq!(hu(&loaded)[..PIXELS], hu(&loaded)[PIXELS..]);
    // Control: they are, where the header says that all bits are used.
    let all = |slice: Slice| slice.number(0x0028_0101, 16).number(0x0028_0102, 15);
    let loaded = Folder::of(&[all(Slice::at(0.0).pixels(&stored)), all(Slice::at(2.0))]).read();
    assert!(matches!(loaded, Err(VolumeError::Range { .. })), "{loaded:?}");
}

#[test]
fn the_sign_is_that_of_the_highest_stored_bit() {
    let slice = |z| Slice::at(z).pixels(&[0x0fff; 12]).number(0x0028_0103, 1);
    let loaded = Folder::of(&[slice(0.0), slice(2.0)]).read().unwrap();
    assert_eq!(hu(&loaded), [-1025.0; 24]);
    // The value in bits 15 to 4.
    let slice = |z| Slice::at(z).pixels(&[0xfff5; 12]).number(0x0028_0103, 1).number(0x0028_0102, 15);
    assert_eq!(hu(&Folder::of(&[slice(0.0), slice(2.0)]).read().unwrap()), [-1025.0; 24]);
    // Control: unsigned.
    let slice = |z| Slice::at(z).pixels(&[0x0fff; 12]);
    assert_eq!(hu(&Folder::of(&[slice(0.0), slice(2.0)]).read().unwrap()), [3071.0; 24]);
}

#[test]
fn every_slice_has_its_own_slope_and_intercept() {
    let other = Slice::at(2.0).text(0x0028_1053, VR::DS, "2").text(0x0028_1052, VR::DS, "-2000");
    let loaded = Folder::of(&[Slice::at(0.0), other]).read().unwrap();
    assert_eq!((hu(&loaded)[1], hu(&loaded)[PIXELS + 1]), (-23.0, 2.0));
    let fraction = Slice::at(2.0).text(0x0028_1053, VR::DS, "0.3");
    let loaded = Folder::of(&[Slice::at(0.0), fraction]).read().unwrap();
    assert_eq!(hu(&loaded)[PIXELS + 1], (0.3f32 * 1001.0 - 1024.0).round());
    assert!(loaded.warnings[0].contains("rounded"), "{:?}", loaded.warnings);
    let wide = Slice::at(2.0).text(0x0028_1053, VR::DS, "40");
    let error = Folder::of(&[Slice::at(0.0), wide]).read().unwrap_err();
    assert!(matches!(error, VolumeError::Range { max, .. } if max == 40.0 * 1011.0 - 1024.0), "{error}");
}

#[test]
fn padding_is_air_and_no_part_of_the_statistics() {
    let signed = |padding: PrimitiveValue, vr| {
        let mut stored = [100u16; 12];
        stored[3] = -2000i16 as u16;
        let slice = |z| {
            Slice::at(z)
                .pixels(&stored)
                .number(0x0028_0101, 16)
                .number(0x0028_0102, 15)
                .number(0x0028_0103, 1)
                .text(0x0028_1052, VR::DS, "0")
                .element(0x0028_0120, vr, padding.clone())
        };
        Folder::of(&[slice(0.0), slice(2.0)]).read().unwrap()
    };
    // Some files write the signed value as an unsigned one.
    for (padding, vr) in [(PrimitiveValue::from(-2000i16), VR::SS), (PrimitiveValue::from(63536u16), VR::US)]
    {
        let loaded = signed(padding, vr);
        assert_eq!((hu(&loaded)[3], hu(&loaded)[4]), (-1024.0, 100.0));
        assert_eq!((loaded.stats.min, loaded.stats.sum), (100.0, 2200.0));
        assert!(
            loaded.warnings[0].starts_with("2 voxels have the PixelPaddingValue"),
            "{:?}",
            loaded.warnings
        );
    }
    // Control: another padding value.
    assert_eq!(hu(&signed(PrimitiveValue::from(-1999i16), VR::SS))[3], -2000.0);
    // Padding over all 16 bits of a 12-bit value, and a range of padding.
    let slice =
        |z| Slice::at(z).pixels(&[0xf830, 5, 6, 7, 8, 9, 9, 9, 9, 9, 9, 9]).number(0x0028_0120, 0xf830);
    let loaded = Folder::of(&[slice(0.0), slice(2.0)]).read().unwrap();
    assert_eq!(hu(&loaded)[..2], [-1024.0, -1019.0]);
    let slice = |z| Slice::at(z).pixels(&[4, 5, 6, 7, 8, 9, 9, 9, 9, 9, 9, 9]);
    let slice = |z| slice(z).number(0x0028_0120, 5).number(0x0028_0121, 7).text(0x0028_1052, VR::DS, "0");
    let loaded = Folder::of(&[slice(0.0), slice(2.0)]).read().unwrap();
    assert_eq!(hu(&loaded)[..5], [4.0, -1024.0, -1024.0, -1024.0, 8.0]);
}

#[test]
fn transfer_syntaxes_hold_the_same_values() {
    let expected = hu(&Folder::of(&Slice::stack(&[0.0, 2.0])).read().unwrap());
    for syntax in ["1.2.840.10008.1.2", "1.2.840.10008.1.2.2", "1.2.840.10008.1.2.1.99"] {
        let slices = Slice::stack(&[0.0, 2.0]).into_iter().map(|slice| Slice { syntax, ..slice });
        let loaded = Folder::of(&slices.collect::<Vec<_>>()).read().unwrap();
        assert_eq!(hu(&loaded), expected, "{syntax}");
    }
}

#[test]
fn eight_bit_pixels_are_read() {
    let slice = |z| {
        Slice::at(z)
            .element(0x7fe0_0010, VR::OB, PrimitiveValue::from((200..212).collect::<Vec<u8>>()))
            .number(0x0028_0100, 8)
            .number(0x0028_0101, 8)
            .number(0x0028_0102, 7)
    };
    let loaded = Folder::of(&[slice(0.0), slice(2.0)]).read().unwrap();
    assert_eq!((hu(&loaded)[11], loaded.dtype), (211.0 - 1024.0, "uint8"));
}

#[test]
fn what_has_no_hu_is_refused_by_name() {
    type Change = fn(Slice) -> Slice;
    let refused = |change: Change| {
        let error = Folder::of(&[Slice::at(0.0), change(Slice::at(2.0))]).refused();
        assert!(error.to_string().contains("1.dcm"), "{error}");
        error.to_string()
    };
    let cases: [(&str, Change); 12] = [
        ("RescaleIntercept", |slice| slice.without(0x0028_1052)),
        ("RescaleSlope is 0", |slice| slice.text(0x0028_1053, VR::DS, "0")),
        ("RescaleSlope is many", |slice| slice.text(0x0028_1053, VR::DS, "many")),
        ("ModalityLUTSequence", |mut slice| {
            let items = vec![dicom_object::InMemDicomObject::new_empty()];
            slice.object.put(DataElement::new(
                dicom_core::Tag(0x0028, 0x3000),
                VR::SQ,
                DataSetSequence::from(items),
            ));
            slice
        }),
        ("color", |slice| slice.number(0x0028_0002, 3)),
        ("PerFrameFunctionalGroupsSequence", |slice| slice.text(0x0028_0008, VR::IS, "2")),
        ("PerFrameFunctionalGroupsSequence", |slice| {
            slice.text(0x0008_0016, VR::UI, "1.2.840.10008.5.1.4.1.1.2.1")
        }),
        ("BitsAllocated is 32", |slice| slice.number(0x0028_0100, 32)),
        ("BitsStored is 17", |slice| slice.number(0x0028_0101, 17)),
        ("HighBit is 9", |slice| slice.number(0x0028_0102, 9)),
        ("not Columns x Rows", |slice| slice.pixels(&[1; 11])),
        ("PixelData", |slice| slice.without(0x7fe0_0010)),
    ];
    for (word, change) in cases {
        let message = refused(change);
        assert!(message.contains(word), "{word}: {message}");
    }
    let missing = Folder::of(&[Slice::at(0.0).without(0x0028_0030)]).refused();
    assert!(matches!(missing, DicomError::Missing { tag: "PixelSpacing", .. }), "{missing}");
}
