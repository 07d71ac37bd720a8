//! The slices of a file: one, or the frames of an enhanced CT. Each frame has its own position,
//! orientation and scaling to HU, in its functional groups (PS3.3, section C.7.6.16).

use std::path::Path;

use dicom_core::DataElement;
use dicom_core::value::{PixelFragmentSequence, PrimitiveValue, Value};
use dicom_object::{DefaultDicomObject, InMemDicomObject, Tag};

use super::error::DicomError;
use super::slice::Slice;
use super::tags::{self, Attribute, Attributes};

/// The functional groups that make a slice of a frame.
const GROUPS: [Attribute; 4] =
    [tags::PLANE_POSITION, tags::PLANE_ORIENTATION, tags::PIXEL_MEASURES, tags::PIXEL_VALUES];
const ENHANCED: [&str; 2] = ["1.2.840.10008.5.1.4.1.1.2.1", "1.2.840.10008.5.1.4.1.1.2.2"];
const PIXEL_DATA: Tag = Tag(0x7fe0, 0x0010);
/// The group of the attributes that describe pixels.
const IMAGE_GROUP: u16 = 0x0028;
/// Bytes before the data of a fragment: its tag and its length (PS3.5, section A.4).
const ITEM_HEADER: usize = 8;

/// The slices of a file, in the order of their frames.
///
/// # Errors
/// An attribute that is missing or not valid. The error names the frame.
pub(super) fn slices(path: &Path, object: &DefaultDicomObject) -> Result<Vec<Slice>, DicomError> {
    let file = Attributes { path, frame: None, objects: vec![object] };
    let count = file.whole(tags::FRAMES, 1..=65_535, "1 to 65535")?;
    let enhanced = ENHANCED.contains(&file.text(tags::SOP_CLASS).as_str());
    if !enhanced && count.unwrap_or(1) == 1 {
        return Ok(vec![Slice::read(&file)?]);
    }
    let frames = items(object, tags::FRAME_GROUPS).ok_or_else(|| DicomError::Missing {
        slice: file.source(),
        tag: tags::FRAME_GROUPS.1,
        expected: "the positions of the frames; if the file has none, convert it with dcm2niix",
    })?;
    if count != Some(frames.len() as i64) {
        return Err(file.invalid(tags::FRAMES, "the number of items of PerFrameFunctionalGroupsSequence"));
    }
    let shared = items(object, tags::SHARED_GROUPS).and_then(<[_]>::first);
    let frame = |(frame, own): (u32, &InMemDicomObject)| {
        // A group belongs to one frame, or all frames share it.
        let of = |groups| GROUPS.into_iter().filter_map(move |group| items(groups, group)?.first());
        let mut objects: Vec<&InMemDicomObject> = of(own).chain(shared.into_iter().flat_map(of)).collect();
        objects.push(object);
        Slice::read(&Attributes { path, frame: Some(frame), objects })
    };
    (1..).zip(frames).map(frame).collect()
}

fn items(object: &InMemDicomObject, sequence: Attribute) -> Option<&[InMemDicomObject]> {
    object.get(sequence.0)?.items()
}

/// A data set with the pixels of one frame, as in a file with one slice.
///
/// # Errors
/// [`DicomError::Pixels`] if the frame has no pixels.
pub(super) fn single(slice: &Slice, object: &DefaultDicomObject) -> Result<DefaultDicomObject, DicomError> {
    let damaged = |reason| DicomError::Pixels { slice: slice.source.clone(), reason };
    let element = object.get(PIXEL_DATA).ok_or(damaged("the attribute PixelData is missing"))?;
    let frame = slice.source.frame.map_or(0, |frame| frame as usize - 1);
    let value = match element.value() {
        Value::Primitive(all) => Value::Primitive(
            part_of(slice, all, frame)
                .ok_or(damaged("there are fewer than Columns x Rows values for each frame"))?,
        ),
        Value::PixelSequence(all) => {
            let frames = items(object, tags::FRAME_GROUPS).map_or(1, <[_]>::len);
            let fragments = fragments(all.offset_table(), all.fragments(), frame, frames)
                .ok_or(damaged("their fragments cannot be assigned to frames"))?;
            Value::PixelSequence(PixelFragmentSequence::new_fragments(fragments.to_vec()))
        }
        Value::Sequence(_) => return Err(damaged("they are a sequence of data sets")),
    };
    let image = object.iter().filter(|element| element.header().tag.group() == IMAGE_GROUP).cloned();
    let mut single =
        InMemDicomObject::from_element_iter(image.filter(|element| element.header().tag != tags::FRAMES.0));
    single.put(DataElement::new(PIXEL_DATA, element.header().vr, value));
    Ok(single.with_exact_meta(object.meta().clone()))
}

/// The values of a frame among those of all frames.
fn part_of(slice: &Slice, all: &PrimitiveValue, frame: usize) -> Option<PrimitiveValue> {
    let count = slice.size[0] * slice.size[1];
    let bytes = count * slice.format.bits_allocated as usize / 8;
    match all {
        PrimitiveValue::U8(all) => {
            Some(PrimitiveValue::U8(all.get(frame * bytes..(frame + 1) * bytes)?.into()))
        }
        PrimitiveValue::U16(all) if slice.format.bits_allocated == 16 => {
            Some(PrimitiveValue::U16(all.get(frame * count..(frame + 1) * count)?.into()))
        }
        // Two values of 8 bits in each word. A frame may begin in the middle of one.
        PrimitiveValue::U16(all) => {
            let (first, end) = (frame * bytes, (frame + 1) * bytes);
            let words = all.get(first / 2..end.div_ceil(2))?;
            let part = words.iter().flat_map(|word| word.to_le_bytes()).skip(first % 2).take(bytes);
            Some(PrimitiveValue::U8(part.collect()))
        }
        _ => None,
    }
}

/// The fragments of a frame. Each frame has one, or a table gives the position of its first one,
/// bytes from the first fragment.
fn fragments<'a>(offsets: &[u32], all: &'a [Vec<u8>], frame: usize, frames: usize) -> Option<&'a [Vec<u8>]> {
    if frames == 1 {
        return Some(all);
    }
    if all.len() == frames {
        return all.get(frame..=frame);
    }
    if offsets.len() != frames {
        return None;
    }
    let mut starts = all.iter().scan(0, |at, fragment| {
        let start = *at;
        *at += ITEM_HEADER + fragment.len();
        Some(start)
    });
    let first = starts.by_ref().position(|start| start == offsets[frame] as usize)?;
    let end = match offsets.get(frame + 1) {
        Some(&next) => first + 1 + starts.position(|start| start == next as usize)?,
        None => all.len(),
    };
    all.get(first..end)
}

#[cfg(test)]
mod tests {
    use super::fragments;

    #[test]
    fn a_table_of_offsets_divides_fragments_into_frames() {
        let all: Vec<Vec<u8>> =
            [4, 2, 6, 8].into_iter().map(|length| vec![length; length as usize]).collect();
        let of = |offsets: &[u32], frame, frames| {
            fragments(offsets, &all, frame, frames)
                .map(|found| found.iter().map(Vec::len).collect::<Vec<_>>())
        };
        assert_eq!(of(&[], 2, 4), Some(vec![6]));
        assert_eq!(of(&[], 0, 1), Some(vec![4, 2, 6, 8]));
        assert_eq!(of(&[0, 22], 0, 2), Some(vec![4, 2]));
        assert_eq!(of(&[0, 22], 1, 2), Some(vec![6, 8]));
        // Without a table, with a wrong one, and with one that goes backwards.
        assert_eq!(of(&[], 1, 2), None);
        assert_eq!(of(&[0, 23], 1, 2), None);
        assert_eq!(of(&[22, 0], 0, 2), None);
    }
}
