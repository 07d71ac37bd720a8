//! The displacement field of a body as files for ITK and 3D Slicer.

use std::path::Path;

use cutis_resample::{Coverage, Displacement, ResampleError};
use cutis_volume::nrrd::VectorWriter;
use cutis_volume::{Grid, LabelMap, VolumeError};

use super::report::Resample;
use super::warp::BodyWarp;
use crate::{Error, Progress};

/// Where a displacement field leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldDirection {
    /// From the deformed shape to the place at rest, as resampling in ITK needs it.
    ToRest,
    /// From a place at rest to the deformed shape, for points and models.
    FromRest,
}

/// A field that has been written.
pub(super) struct WrittenField {
    pub(super) report: Resample,
    /// What covers each point of the grid.
    pub(super) coverage: LabelMap,
}

/// Writes the displacement field of a body on a grid to a `.nrrd` file.
///
/// # Errors
/// The errors of [`Displacement`] and [`VectorWriter`].
pub(super) fn write_field(
    path: &Path,
    grid: &Grid,
    warp: &BodyWarp,
    direction: FieldDirection,
    progress: &dyn Progress,
) -> Result<WrittenField, Error> {
    let warp = warp.warp();
    let field = match direction {
        FieldDirection::ToRest => Displacement::to_rest(grid, &warp),
        FieldDirection::FromRest => Displacement::from_rest(grid, &warp),
    }?;
    let mut writer = VectorWriter::create(path, grid)?;
    let mut coverage: Vec<u8> = Vec::new();
    coverage.try_reserve_exact(grid.len()).map_err(|_| VolumeError::Shape { shape: grid.shape })?;
    let mut moved_voxels = 0;
    field.for_each::<ResampleError>(
        &|done, total| progress.advance_of(done as u64, total as u64),
        |slab| {
            moved_voxels += slab.vectors_mm.iter().filter(|&&vector| vector != [0.0; 3]).count() as u64;
            coverage.extend(slab.coverage.iter().map(|&of| of as u8));
            Ok(writer.push(&slab.vectors_mm)?)
        },
    )?;
    writer.finish()?;
    let vacated = coverage.iter().filter(|&&value| value == Coverage::Vacated as u8);
    let report = Resample { moved_voxels, folds: 0, vacated_voxels: vacated.count() as u64 };
    Ok(WrittenField { report, coverage: LabelMap::new(*grid, coverage)? })
}
