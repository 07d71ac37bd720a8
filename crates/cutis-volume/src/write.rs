//! Writes a volume in the format that the name of the file asks for.

use std::path::Path;

use crate::{Volume, VolumeError, metaimage, nifti, nrrd};

/// A file format for volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// NIfTI-1, `.nii` or `.nii.gz`.
    Nifti,
    /// NRRD, `.nrrd` or `.nhdr`.
    Nrrd,
    /// MetaImage, `.mha` or `.mhd`.
    MetaImage,
}

impl Format {
    /// The format that the extension of a path to write asks for.
    ///
    /// # Errors
    /// [`VolumeError::Extension`] for another extension.
    pub fn of(path: impl AsRef<Path>) -> Result<Self, VolumeError> {
        let path = path.as_ref();
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match name.rsplit_once('.') {
            Some((_, "nii")) => Ok(Self::Nifti),
            Some((_, "nrrd" | "nhdr")) => Ok(Self::Nrrd),
            Some((_, "mha" | "mhd")) => Ok(Self::MetaImage),
            Some((stem, "gz")) if stem.ends_with(".nii") => Ok(Self::Nifti),
            _ => {
                let expected = ".nii, .nii.gz, .nrrd, .nhdr, .mha or .mhd";
                Err(VolumeError::Extension { path: path.into(), expected })
            }
        }
    }
}

/// Writes a volume. The extension of `path` decides the format.
///
/// The file appears under its name when it is complete.
///
/// # Errors
/// [`VolumeError::Extension`], or the errors of [`nifti::write`], [`nrrd::write`] or
/// [`metaimage::write`].
pub fn write(path: impl AsRef<Path>, volume: &Volume) -> Result<(), VolumeError> {
    let path = path.as_ref();
    match Format::of(path)? {
        Format::Nifti => nifti::write(path, volume),
        Format::Nrrd => nrrd::write(path, volume),
        Format::MetaImage => metaimage::write(path, volume),
    }
}
