//! `cutis inspect`: the header and the HU range of a volume, and the series of a DICOM folder.

use std::path::{Path, PathBuf};

use cutis_volume::{Loaded, ReadOptions};
use serde::Serialize;

use crate::Error;
use crate::body::offset_warning;

/// Facts about a volume file.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// Voxels per axis.
    pub shape: [usize; 3],
    /// Voxel size, mm.
    pub spacing_mm: [f64; 3],
    /// Affine map from voxel index to RAS+ mm, four rows.
    pub affine: [[f64; 4]; 4],
    /// World directions of the index axes, for example `RAS`.
    pub orientation: String,
    /// Type of the voxels in the file, as numpy names it.
    pub dtype: String,
    /// Lowest HU; `null` if there is none.
    pub hu_min: f64,
    /// Highest HU; `null` if there is none.
    pub hu_max: f64,
    /// Sum of all HU except NaN.
    pub hu_sum: f64,
    /// Number of voxels that are NaN.
    pub nan_count: u64,
    /// Unusual properties of the file, and how they were read.
    pub warnings: Vec<String>,
}

/// Reads a volume and reports its shape, placement and HU range.
///
/// # Errors
/// [`Error::Volume`] if the path is not a CT volume that can be read.
pub fn inspect(path: &Path, options: &ReadOptions) -> Result<Inspection, Error> {
    Ok(describe(cutis_volume::read(path, options)?))
}

fn describe(mut loaded: Loaded) -> Inspection {
    loaded.warnings.extend(offset_warning(&loaded.volume));
    let grid = loaded.volume.grid();
    Inspection {
        shape: grid.shape,
        spacing_mm: grid.affine.spacing_mm(),
        affine: grid.affine.rows(),
        orientation: grid.affine.orientation().iter().collect(),
        dtype: loaded.dtype.into(),
        hu_min: loaded.stats.min,
        hu_max: loaded.stats.max,
        hu_sum: loaded.stats.sum,
        nan_count: loaded.stats.nan_count,
        warnings: loaded.warnings,
    }
}

/// The CT series in a folder of DICOM files.
#[derive(Clone, Debug, Serialize)]
pub struct FolderInspection {
    /// The series, ordered by number.
    pub series: Vec<Series>,
    /// Files that cannot be parsed, each with the reason. No series is read as long as they are in
    /// the folder.
    pub damaged: Vec<String>,
    /// What else is in the folder.
    pub notes: Vec<String>,
    /// The volume, if there is one series and it can be read.
    pub volume: Option<Inspection>,
}

/// A CT series.
#[derive(Clone, Debug, Serialize)]
pub struct Series {
    /// Its number, to be given as `volume.series`.
    pub number: Option<u32>,
    /// Its description.
    pub description: String,
    /// Number of slices. A file that cannot be read counts as one.
    pub slices: usize,
    /// The first file by name. As a path it names the series.
    pub file: PathBuf,
    /// Columns and rows.
    pub size: Option<[usize; 2]>,
    /// Distance of pixels along rows and columns, mm.
    pub spacing_mm: Option<[f64; 2]>,
    /// Smallest and largest distance of neighboring slices, mm.
    pub slice_distance_mm: Option<[f64; 2]>,
    /// Angle by which the slices are tilted, degrees.
    pub tilt_deg: Option<f64>,
    /// Lowest and highest HU of all slices that can be read.
    pub hu: Option<[f64; 2]>,
    /// True if it can be read with `volume.resample = true` only.
    pub needs_resampling: bool,
    /// Why it cannot be read as it is.
    pub problem: Option<String>,
}

/// Lists the CT series in a folder, and describes the volume if there is only one.
///
/// # Errors
/// [`Error::Volume`] if the folder cannot be read, has no CT series, or this build has no support
/// for DICOM.
pub fn inspect_folder(path: &Path, options: &ReadOptions) -> Result<FolderInspection, Error> {
    #[cfg(feature = "dicom")]
    {
        let listing = cutis_volume::dicom::list(path)?;
        if listing.series.is_empty() {
            // The same error as a run has.
            cutis_volume::read(path, options)?;
        }
        let volume = match &listing.series[..] {
            // A run would be refused.
            _ if !listing.damaged.is_empty() => None,
            [only] if only.problem.is_none() || (only.needs_resampling && options.resample) => {
                Some(inspect(path, options)?)
            }
            _ => None,
        };
        let series = listing.series.into_iter().map(Series::from).collect();
        Ok(FolderInspection { series, damaged: listing.damaged, notes: listing.notes, volume })
    }
    #[cfg(not(feature = "dicom"))]
    {
        let volume = Some(inspect(path, options)?);
        Ok(FolderInspection { series: Vec::new(), damaged: Vec::new(), notes: Vec::new(), volume })
    }
}

#[cfg(feature = "dicom")]
impl From<cutis_volume::dicom::SeriesInfo> for Series {
    fn from(info: cutis_volume::dicom::SeriesInfo) -> Self {
        Self {
            number: info.number,
            description: info.description,
            slices: info.slices,
            file: info.file,
            size: info.size,
            spacing_mm: info.spacing_mm,
            slice_distance_mm: info.slice_distance_mm,
            tilt_deg: info.tilt_deg,
            hu: info.hu,
            needs_resampling: info.needs_resampling,
            problem: info.problem,
        }
    }
}
