//! Reads a CT volume of any format that the crate knows. The content decides, not the name.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::voxels::{Observer, Opened, require_file};
use crate::{Loaded, VolumeError, metaimage, nifti, nrrd, to_perpendicular_axes};

/// How to read a volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Number of the DICOM series to read (attribute SeriesNumber). `None` if there is only one.
    pub series: Option<u32>,
    /// Resample slices that are tilted or unevenly spaced to a regular grid with perpendicular
    /// axes.
    pub resample: bool,
}

/// Reads a volume: a NIfTI, NRRD or MetaImage file, or a DICOM series given by its folder or one of
/// its files.
///
/// DICOM needs the feature `dicom`.
///
/// # Errors
/// The errors of [`nifti::read`], [`nrrd::read`] and [`metaimage::read`], and, with the feature
/// `dicom`, `VolumeError::Dicom`. Each names the file. [`VolumeError::NotStacked`] if resampling is
/// asked for and not possible.
pub fn read(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Loaded, VolumeError> {
    read_files(path.as_ref(), options, None)
}

/// Reads a volume as [`read`] does, and passes the bytes of its files to `observe` on the way.
///
/// When the function succeeds, `observe` has received every byte of every file of the volume, in
/// order, as they are on the disk: first the header file of a pair, and the slices of a DICOM
/// series along their normal.
///
/// # Errors
/// The errors of [`read`].
pub fn read_observed(
    path: impl AsRef<Path>,
    options: &ReadOptions,
    mut observe: impl FnMut(&Path, &[u8]),
) -> Result<Loaded, VolumeError> {
    read_files(path.as_ref(), options, Some(&mut observe))
}

fn read_files(
    path: &Path,
    options: &ReadOptions,
    observer: Option<&mut Observer<'_>>,
) -> Result<Loaded, VolumeError> {
    if !path.is_dir() {
        require_file(path)?;
    }
    #[cfg(feature = "dicom")]
    if path.is_dir() || crate::dicom::is_dicom(path) {
        return crate::dicom::read_series(path, options, observer);
    }
    let mut loaded = if starts_with(path, nrrd::MAGIC) {
        nrrd::read_files(path, observer)?
    } else if metaimage::is_metaimage(path) {
        metaimage::read_files(path, observer)?
    } else {
        nifti::read_files(path, observer)?
    };
    if options.resample && loaded.volume.grid().affine.is_sheared() {
        loaded.volume = to_perpendicular_axes(loaded.volume)?;
        loaded.warnings.retain(|warning| !warning.contains("not perpendicular"));
        loaded
            .warnings
            .push("the axes were not perpendicular: the volume was resampled to perpendicular axes".into());
    }
    Ok(loaded)
}

/// Whether a file has the mark of DICOM, after a preamble of 128 bytes.
pub(crate) fn has_dicom_mark(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(132).read_to_end(&mut start));
    read.is_ok() && start.ends_with(b"DICM") && start.len() == 132
}

/// Opens a file of the format that its content has, and passes it on to `read`.
pub(crate) fn with_open<T>(
    path: &Path,
    read: impl FnOnce(Opened<'_>) -> Result<T, VolumeError>,
) -> Result<T, VolumeError> {
    if starts_with(path, nrrd::MAGIC) {
        nrrd::with_open(path, None, read)
    } else if metaimage::is_metaimage(path) {
        metaimage::with_open(path, None, read)
    } else {
        nifti::with_open(path, None, read)
    }
}

fn starts_with(path: &Path, magic: &[u8]) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(magic.len() as u64).read_to_end(&mut start));
    read.is_ok() && start == magic
}
