//! Writes NIfTI-1 files: int16 voxels, millimeters, equal qform and sform with code 1.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::encode::encode;
use crate::voxels::{GzipWriter, PutVoxels, VoxelType, fits_int16};
use crate::{Grid, PartialFile, Volume, VolumeError};

/// Number of voxels converted to bytes at a time.
const PORTION: usize = 1 << 16;

/// Writes `volume` to a `.nii` or `.nii.gz` file.
///
/// If all HU are whole numbers within int16, the file holds the HU with slope 1 and intercept 0.
/// Otherwise it holds the stored values with the slope and intercept of the volume. The file
/// appears under its name when it is complete.
///
/// # Errors
/// The errors of [`Writer::create`] and [`Writer::push_slices`].
pub fn write(path: impl AsRef<Path>, volume: &Volume) -> Result<(), VolumeError> {
    let path = path.as_ref();
    if volume.slope() == 1.0 && volume.intercept() == 0.0 {
        let mut writer = Writer::create(path, *volume.grid())?;
        writer.push_slices(volume.voxels())?;
        writer.finish()
    } else if fits_int16(volume) {
        let mut writer = Writer::create(path, *volume.grid())?;
        for portion in volume.voxels().chunks(PORTION) {
            let hu: Vec<i16> = portion.iter().map(|&stored| volume.hu(stored) as i16).collect();
            writer.push_slices(&hu)?;
        }
        writer.finish()
    } else {
        let mut writer = Writer::create_scaled(path, *volume.grid(), volume.slope(), volume.intercept())?;
        writer.push_slices(volume.voxels())?;
        writer.finish()
    }
}

/// Writes a volume slice by slice, so that the whole volume need not be in memory.
///
/// A `.nii.gz` file is compressed in parallel into one gzip member. Its bytes do not depend on the
/// number of threads. The file appears under its name at [`Writer::finish`]. A writer that is
/// dropped before that leaves no file.
///
/// ```
/// use cutis_volume::{Affine, Grid, nifti};
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("ramp.nii.gz");
/// let affine = Affine::from_spacing([1.0, 1.0, 2.5], [0.0; 3])?;
/// let mut writer = nifti::Writer::create(&path, Grid { shape: [4, 3, 2], affine })?;
/// writer.push_slices(&[-1000; 12])?;
/// writer.push_slices(&[40; 12])?;
/// writer.finish()?;
/// assert_eq!(nifti::read(&path)?.stats.sum, 12.0 * (40.0 - 1000.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Writer {
    sink: Sink,
    path: PathBuf,
    expected: usize,
    pushed: usize,
}

enum Sink {
    Plain(BufWriter<PartialFile>),
    Gzip(GzipWriter<PartialFile>),
}

/// Writes the voxels of a type that `put` gives, little-endian, with slope 1.
pub(crate) fn write_voxels(
    path: &Path,
    grid: &Grid,
    dtype: VoxelType,
    put: &PutVoxels<'_>,
) -> Result<(), VolumeError> {
    let mut sink = Sink::open(path, grid, dtype, [1.0, 0.0])?;
    put(sink.as_write()).map_err(|source| VolumeError::Io { path: path.into(), action: "write", source })?;
    sink.finish(path)
}

impl Sink {
    /// Creates the file and writes its header.
    fn open(path: &Path, grid: &Grid, dtype: VoxelType, scaling: [f32; 2]) -> Result<Self, VolumeError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let gzip = name.ends_with(".nii.gz");
        if !gzip && !name.ends_with(".nii") {
            return Err(VolumeError::Extension { path: path.into(), expected: ".nii or .nii.gz" });
        }
        let header = encode(path, grid, dtype, scaling)?;
        let file = PartialFile::create(path)?;
        let failed = |source| VolumeError::Io { path: path.into(), action: "write", source };
        let mut sink = match gzip {
            true => Self::Gzip(GzipWriter::new(file).map_err(failed)?),
            false => Self::Plain(BufWriter::with_capacity(1 << 20, file)),
        };
        sink.as_write().write_all(&header).map_err(failed)?;
        Ok(sink)
    }

    fn finish(self, path: &Path) -> Result<(), VolumeError> {
        let file = match self {
            Self::Plain(buffer) => buffer.into_inner().map_err(io::IntoInnerError::into_error),
            Self::Gzip(gzip) => gzip.finish(),
        };
        file.map_err(|source| VolumeError::Io { path: path.into(), action: "write", source })?.commit()
    }

    fn as_write(&mut self) -> &mut dyn Write {
        match self {
            Self::Plain(file) => file,
            Self::Gzip(file) => file,
        }
    }
}

impl Writer {
    /// Opens the file and writes a header with slope 1 and intercept 0.
    ///
    /// # Errors
    /// [`VolumeError::Extension`] if the name does not end in `.nii` or `.nii.gz`.
    /// [`VolumeError::WriteShape`] if NIfTI-1 cannot hold the shape. [`VolumeError::Sheared`] if
    /// the axes are not perpendicular. [`VolumeError::Io`].
    pub fn create(path: impl AsRef<Path>, grid: Grid) -> Result<Self, VolumeError> {
        Self::create_scaled(path, grid, 1.0, 0.0)
    }

    /// Opens the file and writes a header for stored values with `HU = slope · stored + intercept`.
    ///
    /// # Errors
    /// The errors of [`Writer::create`].
    pub fn create_scaled(
        path: impl AsRef<Path>,
        grid: Grid,
        slope: f32,
        intercept: f32,
    ) -> Result<Self, VolumeError> {
        let path = path.as_ref();
        let sink = Sink::open(path, &grid, VoxelType::I16, [slope, intercept])?;
        Ok(Self { sink, path: path.into(), expected: grid.len(), pushed: 0 })
    }

    /// Appends voxels in flat order, index `i` fastest: whole slices or any other portion.
    ///
    /// # Errors
    /// [`VolumeError::Pushed`] if the file would have more voxels than the grid, or
    /// [`VolumeError::Io`].
    pub fn push_slices(&mut self, voxels: &[i16]) -> Result<(), VolumeError> {
        self.pushed = self.pushed.saturating_add(voxels.len());
        if self.pushed > self.expected {
            return Err(self.wrong_count());
        }
        let mut bytes = Vec::with_capacity(2 * PORTION.min(voxels.len()));
        for portion in voxels.chunks(PORTION) {
            bytes.clear();
            bytes.extend(portion.iter().flat_map(|voxel| voxel.to_le_bytes()));
            self.sink.as_write().write_all(&bytes).map_err(|source| self.failed(source))?;
        }
        Ok(())
    }

    /// Completes the file and moves it to its path.
    ///
    /// # Errors
    /// [`VolumeError::Pushed`] if voxels are missing, or [`VolumeError::Io`].
    pub fn finish(self) -> Result<(), VolumeError> {
        if self.pushed != self.expected {
            return Err(self.wrong_count());
        }
        self.sink.finish(&self.path)
    }

    fn wrong_count(&self) -> VolumeError {
        VolumeError::Pushed { path: self.path.clone(), expected: self.expected, found: self.pushed }
    }

    fn failed(&self, source: io::Error) -> VolumeError {
        VolumeError::Io { path: self.path.clone(), action: "write", source }
    }
}
