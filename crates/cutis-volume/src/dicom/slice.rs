//! The header of one slice: geometry, pixel format and scaling to HU, checked.

use std::path::Path;

use nalgebra::Vector3;

use super::error::{DicomError, SliceSource};
use super::frames;
use super::tags::{self, Attributes, plain};

/// Largest deviation of a direction from unit length, and of two from a right angle. Files have
/// six digits or more.
const DIRECTION_TOLERANCE: f64 = 1e-3;
/// Prefix of the SOP classes of secondary captures: pictures of a screen, such as dose reports.
const SECONDARY_CAPTURE: &str = "1.2.840.10008.5.1.4.1.1.7";

/// A file that is not part of a CT volume.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Other {
    NotDicom,
    Localizer,
    Capture,
    /// Another modality, such as `MR` or `SR` (reports).
    Modality(String),
}

impl Other {
    /// Names `count` files.
    pub(super) fn describe(&self, count: usize) -> String {
        let files = if count == 1 { "file" } else { "files" };
        match self {
            Self::NotDicom => format!("{count} {files} not in DICOM format"),
            Self::Localizer => format!("{count} localizer {files}"),
            Self::Capture => format!("{count} {files} with a picture of a screen"),
            Self::Modality(name) => format!("{count} {files} of modality {name}"),
        }
    }
}

/// The series to which a file says it belongs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Identity {
    /// Never shown.
    pub(super) uid: String,
    pub(super) number: Option<u32>,
    pub(super) description: String,
}

impl Identity {
    /// The series, or why the file is not an image of a CT series.
    pub(super) fn read(attributes: &Attributes<'_>) -> Result<Self, Other> {
        let sop_class = attributes.text(tags::SOP_CLASS);
        let modality = attributes.text(tags::MODALITY);
        if sop_class.starts_with(SECONDARY_CAPTURE) {
            return Err(Other::Capture);
        }
        if modality != "CT" {
            // Only code strings are shown: capital letters (PS3.3, section C.7.3.1.1.1).
            let code = !modality.is_empty()
                && modality.len() <= 16
                && modality.chars().all(|c| c.is_ascii_uppercase());
            return Err(Other::Modality(if code { modality } else { "unknown".into() }));
        }
        if attributes.text(tags::IMAGE_TYPE).split('\\').any(|part| part.trim() == "LOCALIZER") {
            return Err(Other::Localizer);
        }
        Ok(Self {
            uid: attributes.text(tags::SERIES_UID),
            number: attributes.text(tags::SERIES_NUMBER).parse().ok(),
            description: plain(&attributes.text(tags::SERIES_DESCRIPTION), 64),
        })
    }
}

/// How pixels are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PixelFormat {
    pub(super) bits_allocated: u32,
    pub(super) bits_stored: u32,
    pub(super) high_bit: u32,
    pub(super) signed: bool,
}

/// One slice.
#[derive(Clone, Debug)]
pub(super) struct Slice {
    pub(super) source: SliceSource,
    /// Columns and rows.
    pub(super) size: [usize; 2],
    /// Distance of neighboring columns and of neighboring rows, mm.
    pub(super) spacing_mm: [f64; 2],
    /// Unit vectors along a row and along a column, LPS.
    pub(super) axes: [Vector3<f64>; 2],
    /// Center of the first pixel, LPS mm.
    pub(super) position_mm: Vector3<f64>,
    pub(super) thickness_mm: Option<f64>,
    pub(super) format: PixelFormat,
    /// Slope and intercept of HU.
    pub(super) rescale: [f64; 2],
    /// Lowest and highest stored value that is padding.
    pub(super) padding: Option<[i64; 2]>,
    /// Whether the pixels were ever compressed with a loss.
    pub(super) lossy: bool,
}

impl Slice {
    /// Reads and checks the header.
    pub(super) fn read(attributes: &Attributes<'_>) -> Result<Self, DicomError> {
        supported(attributes)?;
        let rows = attributes.required_whole(tags::ROWS, 1..=65535, "1 to 65535")?;
        let columns = attributes.required_whole(tags::COLUMNS, 1..=65535, "1 to 65535")?;
        let [between_rows, between_columns] =
            attributes.required::<2>(tags::PIXEL_SPACING, "two positive distances in mm")?;
        if between_rows <= 0.0 || between_columns <= 0.0 {
            return Err(attributes.invalid(tags::PIXEL_SPACING, "two positive distances in mm"));
        }
        let format = format(attributes)?;
        Ok(Self {
            source: attributes.source(),
            size: [columns as usize, rows as usize],
            spacing_mm: [between_columns, between_rows],
            axes: axes(attributes)?,
            position_mm: attributes.required::<3>(tags::POSITION, "three coordinates in mm")?.into(),
            thickness_mm: attributes
                .numbers::<1>(tags::SLICE_THICKNESS, "a length in mm")?
                .map(|[t]| t)
                .filter(|&t| t > 0.0),
            padding: padding(attributes, format)?,
            format,
            rescale: rescale(attributes)?,
            lossy: attributes.text(tags::LOSSY) == "01",
        })
    }

    /// The normal of the slice, LPS.
    pub(super) fn normal(&self) -> Vector3<f64> {
        self.axes[0].cross(&self.axes[1])
    }

    /// True if both slices can be in one volume: equal size, spacing and orientation.
    pub(super) fn matches(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-4 * a.abs();
        self.size == other.size
            && (0..2).all(|axis| near(self.spacing_mm[axis], other.spacing_mm[axis]))
            && (0..2).all(|axis| (self.axes[axis] - other.axes[axis]).norm() <= 1e-3)
    }
}

fn supported(attributes: &Attributes<'_>) -> Result<(), DicomError> {
    let unsupported =
        |what, remedy| Err(DicomError::Unsupported { path: attributes.path.into(), what, remedy });
    if attributes.element(tags::MODALITY_LUT).is_some() {
        return unsupported(
            "a table of HU (ModalityLUTSequence)",
            "export the scan with RescaleSlope and RescaleIntercept",
        );
    }
    if attributes.whole(tags::SAMPLES, 1..=4, "1")?.unwrap_or(1) != 1 {
        return unsupported("a color image", "expected one value per pixel, in HU");
    }
    Ok(())
}

fn axes(attributes: &Attributes<'_>) -> Result<[Vector3<f64>; 2], DicomError> {
    const EXPECTED: &str = "two perpendicular unit vectors";
    let [a, b, c, d, e, f] = attributes.required::<6>(tags::ORIENTATION, EXPECTED)?;
    let (row, column) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
    let unit = |v: Vector3<f64>| (v.norm() - 1.0).abs() <= DIRECTION_TOLERANCE;
    if !unit(row) || !unit(column) || row.dot(&column).abs() > DIRECTION_TOLERANCE {
        return Err(attributes.invalid(tags::ORIENTATION, EXPECTED));
    }
    let row = row.normalize();
    Ok([row, (column - row * row.dot(&column)).normalize()])
}

fn format(attributes: &Attributes<'_>) -> Result<PixelFormat, DicomError> {
    let bits_allocated = attributes.required_whole(tags::BITS_ALLOCATED, 8..=16, "8 or 16")?;
    if bits_allocated % 8 != 0 {
        return Err(attributes.invalid(tags::BITS_ALLOCATED, "8 or 16"));
    }
    let expected = "1 to BitsAllocated";
    let bits_stored = attributes.required_whole(tags::BITS_STORED, 1..=bits_allocated, expected)?;
    let expected = "BitsStored - 1 or more, and below BitsAllocated";
    let high_bit =
        attributes.required_whole(tags::HIGH_BIT, bits_stored - 1..=bits_allocated - 1, expected)?;
    let signed =
        attributes.required_whole(tags::PIXEL_REPRESENTATION, 0..=1, "0 (unsigned) or 1 (signed)")?;
    Ok(PixelFormat {
        bits_allocated: bits_allocated as u32,
        bits_stored: bits_stored as u32,
        high_bit: high_bit as u32,
        signed: signed == 1,
    })
}

fn rescale(attributes: &Attributes<'_>) -> Result<[f64; 2], DicomError> {
    let expected = "a number: without it the pixels are not HU";
    let [intercept] = attributes.required(tags::INTERCEPT, expected)?;
    let [slope] = attributes.required(tags::SLOPE, expected)?;
    match slope != 0.0 {
        true => Ok([slope, intercept]),
        false => Err(attributes.invalid(tags::SLOPE, "a number other than 0")),
    }
}

/// The range of stored values that are padding. A value that is written without its sign, or with
/// a wrong one, has the meaning that the pixels' format gives to its bits.
fn padding(attributes: &Attributes<'_>, format: PixelFormat) -> Result<Option<[i64; 2]>, DicomError> {
    let all = -32768..=65535;
    let Some(value) = attributes.whole(tags::PADDING, all.clone(), "a stored value")? else {
        return Ok(None);
    };
    let limit = attributes.whole(tags::PADDING_LIMIT, all, "a stored value")?.unwrap_or(value);
    let [a, b] = [value, limit].map(|value| match format.signed {
        true => i64::from(value as u16 as i16),
        false => i64::from(value as u16),
    });
    Ok(Some([a.min(b), a.max(b)]))
}

/// What is in a file.
pub(super) enum Found {
    /// The slices of one series in the order of the file, or why it cannot be read.
    Slices {
        identity: Identity,
        slices: Result<Vec<Slice>, DicomError>,
    },
    Other(Other),
}

/// Reads the header of a file.
///
/// # Errors
/// A file that cannot be read or parsed.
pub(super) fn read(path: &Path) -> Result<Found, crate::VolumeError> {
    if !super::file::is_dicom(path) {
        return Ok(Found::Other(Other::NotDicom));
    }
    let object = super::file::parse(path, &super::file::bytes(path)?, false)?;
    let attributes = Attributes { path, frame: None, objects: vec![&object] };
    Ok(match Identity::read(&attributes) {
        Err(other) => Found::Other(other),
        Ok(identity) => Found::Slices { identity, slices: frames::slices(path, &object) },
    })
}
