//! Lists the series of a folder, for a user who has to choose one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dicom_object::DefaultDicomObject;
use rayon::prelude::*;

use super::read::{decode_slice, stack};
use super::series::{Folder, Series};
use super::slice::Slice;
use super::{DicomError, file};
use crate::VolumeError;

/// The CT series in a folder.
#[derive(Clone, Debug)]
pub struct Listing {
    /// The series, ordered by number.
    pub series: Vec<SeriesInfo>,
    /// Files that cannot be parsed, each with the reason. No series of the folder can be read as
    /// long as they are in it, because each may be a slice of any series.
    pub damaged: Vec<String>,
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
    /// Number of slices. A file that cannot be read counts as one.
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
    /// Lowest and highest HU without padding, of all slices that can be read.
    pub hu: Option<[f64; 2]>,
    /// True if `resample` makes the series readable.
    pub needs_resampling: bool,
    /// Why the series cannot be read as it is.
    pub problem: Option<String>,
}

/// Lists the series of a folder and its subfolders. All slices are decoded for their range of HU,
/// on all threads.
///
/// # Errors
/// [`VolumeError::Io`] or [`DicomError::TooManyFiles`]. A damaged file, and a series that cannot be
/// read, are listed with the reason.
pub fn list(path: impl AsRef<Path>) -> Result<Listing, VolumeError> {
    let path = path.as_ref();
    let folder = Folder::scan(path)?;
    let mut notes = Vec::new();
    if !folder.others.is_empty() {
        notes.push(format!("other files: {}", folder.describe_others()));
    }
    let damaged = folder.damaged.iter().map(VolumeError::to_string).collect();
    let series = folder.series.into_iter().map(|series| describe(path, series)).collect();
    Ok(Listing { series, damaged, notes })
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
    let (hu, failures) = hu_range(&series.slices);
    info.hu = hu;
    match stack(series) {
        Err(error) => info.problem = Some(error.to_string()),
        Ok(stack) => {
            info.slice_distance_mm = stack.gap_range_mm();
            info.tilt_deg = Some(stack.tilt_deg());
            if let Err(error) = stack.require_regular(path, &mut Vec::new()) {
                info.needs_resampling = failures.is_empty()
                    && matches!(error, DicomError::Tilted { .. } | DicomError::UnevenSlices { .. });
                info.problem = Some(error.to_string());
            }
        }
    }
    if let [first, others @ ..] = &failures[..] {
        let more = match others.len() {
            0 => String::new(),
            1 => " (1 more slice cannot be decoded)".into(),
            count => format!(" ({count} more slices cannot be decoded)"),
        };
        info.problem = Some(format!("{first}{more}"));
    }
    info
}

/// The range of HU of the slices that can be decoded, and why others cannot.
fn hu_range(slices: &[Slice]) -> (Option<[f64; 2]>, Vec<VolumeError>) {
    let mut files: BTreeMap<&Path, Vec<&Slice>> = BTreeMap::new();
    for slice in slices {
        files.entry(&slice.source.path).or_default().push(slice);
    }
    let decoded: Vec<Result<[f64; 2], VolumeError>> = files
        .into_par_iter()
        .flat_map(|(path, slices)| {
            let object = file::bytes(path).and_then(|bytes| Ok(file::parse(path, &bytes, true)?));
            match object {
                Ok(object) => slices.par_iter().map(|slice| one_range(slice, &object)).collect(),
                Err(error) => vec![Err(error)],
            }
        })
        .collect();
    let mut range: Option<[f64; 2]> = None;
    let mut failures = Vec::new();
    for slice in decoded {
        match slice {
            // A slice of padding has no range.
            Ok([min, max]) if min <= max => {
                range = Some(range.map_or([min, max], |[low, high]| [low.min(min), high.max(max)]));
            }
            Ok(_) => {}
            Err(error) => failures.push(error),
        }
    }
    (range, failures)
}

fn one_range(slice: &Slice, object: &DefaultDicomObject) -> Result<[f64; 2], VolumeError> {
    let pixels = decode_slice(slice, object)?;
    Ok([pixels.min, pixels.max])
}
