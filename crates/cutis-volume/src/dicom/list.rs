//! Lists the series of a folder, for a user who has to choose one.

use std::path::{Path, PathBuf};

use super::read::{Total, decode_slice, stack};
use super::series::{Folder, Series};
use super::stack::Stack;
use super::{DicomError, file};
use crate::VolumeError;

/// The CT series in a folder.
#[derive(Clone, Debug)]
pub struct Listing {
    /// The series, ordered by number.
    pub series: Vec<SeriesInfo>,
    /// What else is in the folder.
    pub notes: Vec<String>,
}

/// A CT series: slices of equal size and orientation.
#[derive(Clone, Debug)]
pub struct SeriesInfo {
    /// SeriesNumber, if there is one.
    pub number: Option<u32>,
    /// SeriesDescription.
    pub description: String,
    /// Number of files.
    pub slices: usize,
    /// The first file by name, which names the series where its number does not.
    pub file: PathBuf,
    /// Columns and rows.
    pub size: Option<[usize; 2]>,
    /// Distance of pixels along rows and columns, mm.
    pub spacing_mm: Option<[f64; 2]>,
    /// Smallest and largest distance of neighboring slices, mm.
    pub slice_distance_mm: Option<[f64; 2]>,
    /// Angle between the normal of the slices and the line along which they lie, degrees.
    pub tilt_deg: Option<f64>,
    /// Lowest and highest HU without padding.
    pub hu: Option<[f64; 2]>,
    /// True if `resample` makes the series readable.
    pub needs_resampling: bool,
    /// Why the series cannot be read as it is.
    pub problem: Option<String>,
}

/// Lists the series of a folder and its subfolders. All slices are decoded for their range of HU.
///
/// # Errors
/// [`VolumeError::Io`] or [`DicomError::TooManyFiles`]. A series that cannot be read is listed with
/// the reason.
pub fn list(path: impl AsRef<Path>) -> Result<Listing, VolumeError> {
    let path = path.as_ref();
    let folder = Folder::scan(path)?;
    let mut notes = Vec::new();
    if let Some(error) = &folder.damaged {
        notes.push(format!("no series can be read as long as this file is in the folder: {error}"));
    }
    if !folder.others.is_empty() {
        notes.push(format!("other files: {}", folder.describe_others()));
    }
    let series = folder.series.into_iter().map(|series| describe(path, series)).collect();
    Ok(Listing { series, notes })
}

fn describe(path: &Path, series: Series) -> SeriesInfo {
    let first = series.slices.first();
    let mut info = SeriesInfo {
        number: series.identity.number,
        description: series.identity.description.clone(),
        slices: series.len(),
        file: series.first_file().into(),
        size: first.map(|slice| slice.size),
        spacing_mm: first.map(|slice| slice.spacing_mm),
        slice_distance_mm: None,
        tilt_deg: None,
        hu: None,
        needs_resampling: false,
        problem: None,
    };
    match stack(series) {
        Err(error) => info.problem = Some(error.to_string()),
        Ok(stack) => {
            info.slice_distance_mm = stack.gap_range_mm();
            info.tilt_deg = Some(stack.tilt_deg());
            match hu_range(&stack) {
                Ok(range) => info.hu = Some(range),
                Err(error) => info.problem = Some(error.to_string()),
            }
            if let (None, Err(error)) = (&info.problem, stack.require_regular(path, &mut Vec::new())) {
                info.needs_resampling =
                    matches!(error, DicomError::Tilted { .. } | DicomError::UnevenSlices { .. });
                info.problem = Some(error.to_string());
            }
        }
    }
    info
}

fn hu_range(stack: &Stack) -> Result<[f64; 2], VolumeError> {
    let mut total = Total::default();
    for slice in &stack.slices {
        total.add(&decode_slice(slice, &file::bytes(&slice.path)?)?);
    }
    let stats = total.stats();
    Ok([stats.min, stats.max])
}
