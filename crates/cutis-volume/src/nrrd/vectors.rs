//! Writes a field of vectors as NRRD: 32-bit real numbers, left-posterior-superior, gzip.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::write::{ENDING, geometry};
use crate::voxels::GzipWriter;
use crate::{Grid, PartialFile, VolumeError};

/// Writes one vector per point of a grid, portion by portion, so that the field need not be in
/// memory.
///
/// The axes of the file are those of the vector and of the grid (`kinds: vector domain domain
/// domain`). ITK reads it as an image of vectors, and 3D Slicer as a transform by a grid. The file
/// appears under its name at [`VectorWriter::finish`]. A writer that is dropped before that leaves
/// no file.
///
/// ```
/// use cutis_volume::{Affine, Grid, nrrd::VectorWriter};
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("shift.nrrd");
/// let grid = Grid { shape: [4, 3, 2], affine: Affine::from_spacing([1.0; 3], [0.0; 3])? };
/// let mut writer = VectorWriter::create(&path, &grid)?;
/// writer.push(&[[0.5, 0.0, -2.0]; 24])?;
/// writer.finish()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct VectorWriter {
    gzip: GzipWriter<PartialFile>,
    path: PathBuf,
    expected: usize,
    pushed: usize,
}

impl VectorWriter {
    /// Opens the file and writes its header.
    ///
    /// # Errors
    /// [`VolumeError::Extension`] if the name does not end in `.nrrd`. [`VolumeError::Sheared`] if
    /// the axes are not perpendicular. [`VolumeError::Shape`] for a grid without points.
    /// [`VolumeError::Io`].
    pub fn create(path: impl AsRef<Path>, grid: &Grid) -> Result<Self, VolumeError> {
        let path = path.as_ref();
        let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
        if extension.is_none_or(|extension| extension != "nrrd") {
            return Err(VolumeError::Extension { path: path.into(), expected: ".nrrd" });
        }
        if grid.affine.is_sheared() {
            return Err(VolumeError::Sheared { path: path.into(), cosine: grid.affine.shear() });
        }
        let expected = grid.checked_len().ok_or(VolumeError::Shape { shape: grid.shape })?;
        let [nx, ny, nz] = grid.shape;
        let (directions, origin) = geometry(&grid.affine);
        let header = format!(
            "NRRD0004\n# written by Cutis, vectors in mm\ntype: float\ndimension: 4\n\
             space: left-posterior-superior\nsizes: 3 {nx} {ny} {nz}\n\
             space directions: none {directions}\nkinds: vector domain domain domain\n\
             {ENDING}space origin: {origin}\n\n"
        );
        let failed = |source| VolumeError::Io { path: path.into(), action: "write", source };
        let mut file = PartialFile::create(path)?;
        file.write_all(header.as_bytes()).map_err(failed)?;
        let gzip = GzipWriter::new(file).map_err(failed)?;
        Ok(Self { gzip, path: path.into(), expected, pushed: 0 })
    }

    /// Appends vectors along R, A, S in flat order, index `i` fastest.
    ///
    /// # Errors
    /// [`VolumeError::Pushed`] if the file would have more vectors than the grid has points, or
    /// [`VolumeError::Io`].
    pub fn push(&mut self, vectors: &[[f32; 3]]) -> Result<(), VolumeError> {
        self.pushed = self.pushed.saturating_add(vectors.len());
        if self.pushed > self.expected {
            return Err(self.wrong_count());
        }
        let mut bytes = Vec::with_capacity(vectors.len() * 12);
        for [x, y, z] in vectors {
            // Adding zero removes the sign of a negative zero.
            bytes.extend([-x + 0.0, -y + 0.0, z + 0.0].into_iter().flat_map(f32::to_le_bytes));
        }
        let path = &self.path;
        let failed = |source| VolumeError::Io { path: path.clone(), action: "write", source };
        self.gzip.write_all(&bytes).map_err(failed)
    }

    /// Completes the file and moves it to its path.
    ///
    /// # Errors
    /// [`VolumeError::Pushed`] if vectors are missing, or [`VolumeError::Io`].
    pub fn finish(self) -> Result<(), VolumeError> {
        if self.pushed != self.expected {
            return Err(self.wrong_count());
        }
        let Self { gzip, path, .. } = self;
        gzip.finish().map_err(|source| VolumeError::Io { path, action: "write", source })?.commit()
    }

    fn wrong_count(&self) -> VolumeError {
        VolumeError::Pushed { path: self.path.clone(), expected: self.expected, found: self.pushed }
    }
}
