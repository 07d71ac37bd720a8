//! Values of the attributes that make a CT slice (PS3.3, sections C.7.6.2, C.7.6.3 and C.8.2.1).

use std::path::Path;

use dicom_object::mem::InMemElement;
use dicom_object::{InMemDicomObject, Tag};

use super::error::{DicomError, SliceSource};

/// An attribute: its tag and its keyword.
#[derive(Clone, Copy)]
pub(super) struct Attribute(pub(super) Tag, pub(super) &'static str);

macro_rules! attributes {
    ($($name:ident = $group:literal $element:literal $keyword:literal;)*) => {
        $(pub(super) const $name: Attribute = Attribute(Tag($group, $element), $keyword);)*
    };
}

attributes! {
    IMAGE_TYPE = 0x0008 0x0008 "ImageType";
    SOP_CLASS = 0x0008 0x0016 "SOPClassUID";
    MODALITY = 0x0008 0x0060 "Modality";
    SERIES_DESCRIPTION = 0x0008 0x103e "SeriesDescription";
    SLICE_THICKNESS = 0x0018 0x0050 "SliceThickness";
    SERIES_UID = 0x0020 0x000e "SeriesInstanceUID";
    SERIES_NUMBER = 0x0020 0x0011 "SeriesNumber";
    POSITION = 0x0020 0x0032 "ImagePositionPatient";
    ORIENTATION = 0x0020 0x0037 "ImageOrientationPatient";
    SAMPLES = 0x0028 0x0002 "SamplesPerPixel";
    FRAMES = 0x0028 0x0008 "NumberOfFrames";
    ROWS = 0x0028 0x0010 "Rows";
    COLUMNS = 0x0028 0x0011 "Columns";
    PIXEL_SPACING = 0x0028 0x0030 "PixelSpacing";
    BITS_ALLOCATED = 0x0028 0x0100 "BitsAllocated";
    BITS_STORED = 0x0028 0x0101 "BitsStored";
    HIGH_BIT = 0x0028 0x0102 "HighBit";
    PIXEL_REPRESENTATION = 0x0028 0x0103 "PixelRepresentation";
    PADDING = 0x0028 0x0120 "PixelPaddingValue";
    PADDING_LIMIT = 0x0028 0x0121 "PixelPaddingRangeLimit";
    INTERCEPT = 0x0028 0x1052 "RescaleIntercept";
    SLOPE = 0x0028 0x1053 "RescaleSlope";
    LOSSY = 0x0028 0x2110 "LossyImageCompression";
    PLANE_POSITION = 0x0020 0x9113 "PlanePositionSequence";
    PLANE_ORIENTATION = 0x0020 0x9116 "PlaneOrientationSequence";
    PIXEL_MEASURES = 0x0028 0x9110 "PixelMeasuresSequence";
    PIXEL_VALUES = 0x0028 0x9145 "PixelValueTransformationSequence";
    SHARED_GROUPS = 0x5200 0x9229 "SharedFunctionalGroupsSequence";
    FRAME_GROUPS = 0x5200 0x9230 "PerFrameFunctionalGroupsSequence";
    MODALITY_LUT = 0x0028 0x3000 "ModalityLUTSequence";
}

/// The attributes of one file, or of one frame of a file.
pub(super) struct Attributes<'a> {
    pub(super) path: &'a Path,
    /// Number of the frame from 1.
    pub(super) frame: Option<u32>,
    /// The data sets that may have an attribute. The first one that has it counts.
    pub(super) objects: Vec<&'a InMemDicomObject>,
}

impl Attributes<'_> {
    /// The element of an attribute.
    pub(super) fn element(&self, attribute: Attribute) -> Option<&InMemElement> {
        self.objects.iter().find_map(|object| object.get(attribute.0))
    }

    /// The file, with the frame.
    pub(super) fn source(&self) -> SliceSource {
        SliceSource { path: self.path.into(), frame: self.frame }
    }

    /// True if the attribute is there and not empty.
    pub(super) fn has(&self, attribute: Attribute) -> bool {
        self.element(attribute)
            .is_some_and(|element| !element.value().to_str().is_ok_and(|text| text.trim().is_empty()))
    }

    /// The text of an attribute, without padding. Empty if there is none.
    pub(super) fn text(&self, attribute: Attribute) -> String {
        let element = self.element(attribute);
        let text = element.and_then(|element| Some(element.value().to_str().ok()?.into_owned()));
        text.unwrap_or_default().trim_matches(['\0', ' ']).to_owned()
    }

    /// The numbers of an attribute. `None` if it is missing.
    pub(super) fn numbers<const N: usize>(
        &self,
        attribute: Attribute,
        expected: &'static str,
    ) -> Result<Option<[f64; N]>, DicomError> {
        let Some(element) = self.element(attribute).filter(|_| self.has(attribute)) else {
            return Ok(None);
        };
        let numbers = element.value().to_multi_float64().unwrap_or_default();
        match <[f64; N]>::try_from(numbers) {
            Ok(numbers) if numbers.iter().all(|number| number.is_finite()) => Ok(Some(numbers)),
            _ => Err(self.invalid(attribute, expected)),
        }
    }

    /// The numbers of an attribute that must be there.
    pub(super) fn required<const N: usize>(
        &self,
        attribute: Attribute,
        expected: &'static str,
    ) -> Result<[f64; N], DicomError> {
        let missing = || DicomError::Missing { slice: self.source(), tag: attribute.1, expected };
        self.numbers(attribute, expected)?.ok_or_else(missing)
    }

    /// A whole number within a range. `None` if the attribute is missing.
    pub(super) fn whole(
        &self,
        attribute: Attribute,
        range: std::ops::RangeInclusive<i64>,
        expected: &'static str,
    ) -> Result<Option<i64>, DicomError> {
        let Some([number]) = self.numbers::<1>(attribute, expected)? else { return Ok(None) };
        match number.fract() == 0.0 && range.contains(&(number as i64)) {
            true => Ok(Some(number as i64)),
            false => Err(self.invalid(attribute, expected)),
        }
    }

    /// A whole number that must be there.
    pub(super) fn required_whole(
        &self,
        attribute: Attribute,
        range: std::ops::RangeInclusive<i64>,
        expected: &'static str,
    ) -> Result<i64, DicomError> {
        let missing = || DicomError::Missing { slice: self.source(), tag: attribute.1, expected };
        self.whole(attribute, range, expected)?.ok_or_else(missing)
    }

    /// The error for a value that cannot be used.
    pub(super) fn invalid(&self, attribute: Attribute, expected: &'static str) -> DicomError {
        let value = plain(&self.text(attribute), 80);
        let value = if value.is_empty() { "empty".to_owned() } else { value };
        DicomError::Invalid { slice: self.source(), tag: attribute.1, value, expected }
    }
}

/// A text of at most `most` characters without control characters.
pub(super) fn plain(text: &str, most: usize) -> String {
    text.chars().filter(|c| !c.is_control()).take(most).collect::<String>().trim().to_owned()
}
