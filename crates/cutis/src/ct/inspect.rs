//! `cutis inspect`: the header and the HU range of a volume file.

use std::path::Path;

use cutis_volume::nifti;
use serde::Serialize;

use crate::Error;

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

/// Reads a volume file and reports its shape, placement and HU range.
///
/// # Errors
/// [`Error::Volume`] if the file is not a CT volume that can be read.
pub fn inspect(path: &Path) -> Result<Inspection, Error> {
    let loaded = nifti::read(path)?;
    let grid = loaded.volume.grid();
    Ok(Inspection {
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
    })
}
