//! Writes a volume in the format that the name of the file asks for.

use std::path::Path;

use crate::{Volume, VolumeError, nifti};

/// A file format for volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// NIfTI-1, `.nii` or `.nii.gz`.
    Nifti,
}

impl Format {
    /// The format that the extension of a path to write asks for.
    ///
    /// # Errors
    /// [`VolumeError::Extension`] for another extension.
    pub fn of(path: impl AsRef<Path>) -> Result<Self, VolumeError> {
        let path = path.as_ref();
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match name.rsplit_once('.').map(|(stem, extension)| (stem, extension)) {
            Some((_, "nii")) => Ok(Self::Nifti),
            Some((stem, "gz")) if stem.ends_with(".nii") => Ok(Self::Nifti),
            _ => Err(VolumeError::Extension { path: path.into(), expected: ".nii or .nii.gz" }),
        }
    }
}

/// Writes a volume. The extension of `path` decides the format.
///
/// The file appears under its name when it is complete.
///
/// # Errors
/// [`VolumeError::Extension`], or the errors of [`nifti::write`].
pub fn write(path: impl AsRef<Path>, volume: &Volume) -> Result<(), VolumeError> {
    let path = path.as_ref();
    match Format::of(path)? {
        Format::Nifti => nifti::write(path, volume),
    }
}
