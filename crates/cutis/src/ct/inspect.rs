//! What is in a volume file, for people and for machines.

use std::path::Path;

use cutis_volume::nifti;
use serde::Serialize;

use crate::Error;

/// What `cutis inspect` prints.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// Voxels per axis.
    pub shape: [usize; 3],
    /// Voxel size, mm.
    pub spacing_mm: [f64; 3],
    /// Index → RAS+ mm, four rows.
    pub affine: [[f64; 4]; 4],
    /// World directions to which the index axes run, for example `RAS`.
    pub orientation: String,
    /// Type of the voxels in the file, by numpy's name.
    pub dtype: String,
    /// Lowest HU; `null` if there is none.
    pub hu_min: f64,
    /// Highest HU; `null` if there is none.
    pub hu_max: f64,
    /// Sum of all HU but NaN.
    pub hu_sum: f64,
    /// Voxels that are not a number.
    pub nan_count: u64,
    /// What was unusual about the file, and how it was taken.
    pub warnings: Vec<String>,
}

/// Reads a volume file and tells what is in it.
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
