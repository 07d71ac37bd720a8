//! Enhanced CT: several slices in one file, each with its own position and scaling.

use dicom_core::value::{DataSetSequence, PixelFragmentSequence, Value};
use dicom_core::{DataElement, PrimitiveValue, Tag, VR};
use dicom_object::InMemDicomObject;

use cutis_volume::dicom::{self, DicomError};

use super::file::{Folder, Slice, hu};

const ENHANCED: &str = "1.2.840.10008.5.1.4.1.1.2.1";
const RLE: &str = "1.2.840.10008.1.2.5";

fn data_set(elements: &[(u32, VR, &str)]) -> InMemDicomObject {
    InMemDicomObject::from_element_iter(elements.iter().map(|&(tag, vr, text)| {
        DataElement::new(Tag((tag >> 16) as u16, tag as u16), vr, PrimitiveValue::from(text))
    }))
}

fn sequence(items: Vec<InMemDicomObject>) -> Value<InMemDicomObject> {
    Value::Sequence(DataSetSequence::from(items))
}

/// A functional group: a sequence with one item.
fn group(tag: u32, elements: &[(u32, VR, &str)]) -> DataElement<InMemDicomObject> {
    DataElement::new(Tag((tag >> 16) as u16, tag as u16), VR::SQ, sequence(vec![data_set(elements)]))
}

/// A frame: its height and its intercept.
struct Frame(f64, i32);

/// An enhanced CT. Orientation and size of pixels are shared, position and scaling are those of the
/// frames. The stored values of a frame are `1000 + 100 * frame` and above.
fn enhanced(frames: &[Frame]) -> Slice {
    let mut slice = Slice::at(0.0).text(0x0008_0016, VR::UI, ENHANCED);
    for tag in [0x0020_0032, 0x0020_0037, 0x0028_0030, 0x0018_0050, 0x0028_1052, 0x0028_1053] {
        slice = slice.without(tag);
    }
    let own = |&Frame(z, intercept): &Frame| {
        InMemDicomObject::from_element_iter([
            group(0x0020_9113, &[(0x0020_0032, VR::DS, &format!("10\\20\\{z:.3}"))]),
            group(0x0028_9145, &[(0x0028_1052, VR::DS, &intercept.to_string()), (0x0028_1053, VR::DS, "1")]),
        ])
    };
    let shared = InMemDicomObject::from_element_iter([
        group(0x0020_9116, &[(0x0020_0037, VR::DS, "1\\0\\0\\0\\1\\0")]),
        group(0x0028_9110, &[(0x0028_0030, VR::DS, "2\\1.5"), (0x0018_0050, VR::DS, "2")]),
    ]);
    let groups = frames.iter().map(own).collect();
    slice.object.put(DataElement::new(Tag(0x5200, 0x9229), VR::SQ, sequence(vec![shared])));
    slice.object.put(DataElement::new(Tag(0x5200, 0x9230), VR::SQ, sequence(groups)));
    let stored: Vec<u16> =
        (0..frames.len() as u16).flat_map(|n| (0..12).map(move |at| 1000 + 100 * n + at)).collect();
    slice.text(0x0028_0008, VR::IS, &frames.len().to_string()).pixels(&stored)
}

#[test]
fn frames_are_slices_with_their_own_position_and_scaling() {
    let loaded =
        Folder::of(&[enhanced(&[Frame(34.0, -1000), Frame(30.0, -1200), Frame(32.0, 0)])]).read().unwrap();
    let grid = loaded.volume.grid();
    assert_eq!((grid.shape, grid.affine.spacing_mm()), ([4, 3, 3], [1.5, 2.0, 2.0]));
    assert_eq!(grid.mm([0, 0, 0]).coords.as_slice(), [-10.0, -20.0, 30.0]);
    let first: Vec<f32> = hu(&loaded).iter().step_by(12).copied().collect();
    assert_eq!(first, [-100.0, 1200.0, 0.0]);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    // Several files make one volume too.
    let files = [enhanced(&[Frame(0.0, -1000), Frame(2.0, -1000)]), enhanced(&[Frame(4.0, -1000)])];
    assert_eq!(Folder::of(&files).read().unwrap().volume.grid().shape, [4, 3, 3]);
}

#[test]
fn a_listing_counts_frames() {
    let folder = Folder::of(&[enhanced(&[Frame(0.0, -1000), Frame(2.0, -1000)])]);
    let listing = dicom::list(folder.0.path()).unwrap();
    let [series] = &listing.series[..] else { panic!("{listing:?}") };
    assert_eq!((series.slices, series.hu, &series.problem), (2, Some([0.0, 111.0]), &None));
}

#[test]
fn the_file_is_observed_once() {
    let frames: Vec<Frame> = (0..40).map(|n| Frame(f64::from(n), -1000)).collect();
    let folder = Folder::of(&[enhanced(&frames)]);
    let mut bytes: Vec<u8> = Vec::new();
    cutis_volume::read_observed(folder.0.path(), &Default::default(), |_, part| bytes.extend(part)).unwrap();
    assert!(bytes == std::fs::read(folder.path("0.dcm")).unwrap());
}

#[test]
fn a_bad_frame_is_refused_by_its_number() {
    let same = Folder::of(&[enhanced(&[Frame(0.0, -1000), Frame(2.0, -1000), Frame(2.0, -1000)])]).refused();
    let DicomError::SamePosition { first, second, .. } = &same else { panic!("{same}") };
    assert_eq!((first.frame, second.frame), (Some(2), Some(3)), "{same}");
    let change = |change: &dyn Fn(&mut InMemDicomObject)| {
        let mut slice = enhanced(&[Frame(0.0, -1000), Frame(2.0, -1000)]);
        change(&mut slice.object);
        Folder::of(&[slice]).refused().to_string()
    };
    let frame_groups = |object: &mut InMemDicomObject, change: &dyn Fn(&mut Vec<InMemDicomObject>)| {
        let mut items = object.get(Tag(0x5200, 0x9230)).unwrap().items().unwrap().to_vec();
        change(&mut items);
        object.put(DataElement::new(Tag(0x5200, 0x9230), VR::SQ, sequence(items)));
    };
    let no_position = change(&|object| {
        frame_groups(object, &|items| {
            items[1].remove_element(Tag(0x0020, 0x9113));
        })
    });
    assert!(
        no_position.contains("0.dcm (frame 2): the attribute ImagePositionPatient is missing"),
        "{no_position}"
    );
    let one_item = change(&|object| frame_groups(object, &|items| items.truncate(1)));
    assert!(one_item.contains("NumberOfFrames is 2: expected the number of items"), "{one_item}");
    let short = change(&|object| {
        let stored = PrimitiveValue::U16(vec![1000; 23].into());
        object.put(DataElement::new(Tag(0x7fe0, 0x0010), VR::OW, stored));
    });
    assert!(short.contains("0.dcm (frame 2): the pixels cannot be decoded: there are fewer"), "{short}");
}

/// Twelve pixels of one value in run length encoding (PS3.5, annex G).
fn runs(value: u16) -> Vec<u8> {
    let mut stream = vec![0u8; 64];
    stream[..12].copy_from_slice(&[2, 0, 0, 0, 64, 0, 0, 0, 66, 0, 0, 0]);
    stream.extend([245, (value >> 8) as u8, 245, value as u8]);
    stream
}

#[test]
fn compressed_frames_are_read() {
    let compressed = |fragments: Vec<Vec<u8>>| {
        let mut slice = enhanced(&[Frame(0.0, -1000), Frame(2.0, -1000)]);
        slice.syntax = RLE;
        let fragments = PixelFragmentSequence::new_fragments(fragments);
        slice.object.put(DataElement::new(Tag(0x7fe0, 0x0010), VR::OB, Value::PixelSequence(fragments)));
        Folder::of(&[slice])
    };
    let loaded = compressed(vec![runs(1001), runs(1300)]).read().unwrap();
    assert_eq!(hu(&loaded), [[1.0f32; 12], [300.0; 12]].concat());
    let error = compressed(vec![runs(1001), runs(1300), runs(1300)]).refused().to_string();
    assert!(error.contains("cannot be assigned to frames"), "{error}");
}
