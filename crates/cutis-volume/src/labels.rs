//! Label maps: volumes whose values name segments, read and written as they are.

use std::path::Path;

use crate::voxels::{Opened, VoxelType, decode_raw, require_file};
use crate::{Format, Grid, VolumeError, metaimage, nifti, nrrd, read};

/// Part of the lines about segments that says where a segment is. It does not hold once the labels
/// have moved.
const EXTENT: &str = "_Extent:=";

/// A label map: one value per voxel, of the type that the file has. Values are never converted.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelMap {
    grid: Grid,
    dtype: VoxelType,
    /// The values, little-endian, index `i` fastest.
    bytes: Vec<u8>,
    /// Lines of an NRRD header with the names and colors of segments.
    segments: Vec<String>,
}

impl LabelMap {
    /// Reads a label map from a NIfTI, NRRD or MetaImage file. The content decides, not the name.
    /// Also returns what was unusual in the header.
    ///
    /// The names and colors of the segments of 3D Slicer (`.seg.nrrd`) are kept. A segmentation
    /// with overlapping segments has several layers and is refused.
    ///
    /// ```
    /// use cutis_volume::{Affine, Grid, LabelMap};
    /// # let folder = tempfile::tempdir()?;
    /// # let path = folder.path().join("organs.nii.gz");
    /// let grid = Grid { shape: [4, 3, 2], affine: Affine::from_spacing([1.0; 3], [0.0; 3])? };
    /// LabelMap::new(grid, vec![3; 24])?.write(&path)?;
    /// let (labels, warnings) = LabelMap::read(&path)?;
    /// assert_eq!((labels.dtype(), labels.bytes(), warnings.len()), ("uint8", &[3; 24][..], 0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`nifti::read`], [`nrrd::read`] and [`metaimage::read`] about the file and its
    /// header. [`VolumeError::Header`] for a NIfTI file whose values are scaled.
    pub fn read(path: impl AsRef<Path>) -> Result<(Self, Vec<String>), VolumeError> {
        let path = path.as_ref();
        if !path.is_dir() {
            require_file(path)?;
        }
        if path.is_dir() || read::has_dicom_mark(path) {
            let reason = "a label map must be a NIfTI, NRRD or MetaImage file, not DICOM";
            return Err(VolumeError::NotNifti { path: path.into(), reason });
        }
        read::with_open(path, Self::decode)
    }

    fn decode(opened: Opened<'_>) -> Result<(Self, Vec<String>), VolumeError> {
        let Opened { mut source, layout, mut warnings, segments } = opened;
        let [slope, intercept] = layout.scaling;
        for (field, value, neutral) in [("scl_slope", slope, 1.0), ("scl_inter", intercept, 0.0)] {
            if value != neutral {
                let (path, value) = (source.path.clone(), value.to_string());
                let expected = "slope 1 and intercept 0: labels are not scaled";
                return Err(VolumeError::Header { path, field, value, expected });
            }
        }
        let bytes = decode_raw(&mut source, &layout)?;
        source.check_tail(&mut warnings)?;
        let grid = Grid { shape: layout.shape.map(|n| n as usize), affine: layout.affine };
        let segments = segments.into_iter().filter(|line| !line.contains(EXTENT)).collect();
        Ok((Self { grid, dtype: layout.dtype, bytes, segments }, warnings))
    }

    /// A label map of the type `uint8`, with one value per point of the grid, index `i` fastest.
    ///
    /// # Errors
    /// [`VolumeError::VoxelCount`] if the number of values is not that of the grid.
    /// [`VolumeError::Shape`] for a grid without points.
    pub fn new(grid: Grid, labels: Vec<u8>) -> Result<Self, VolumeError> {
        let blank = Self { grid, dtype: VoxelType::U8, bytes: Vec::new(), segments: Vec::new() };
        blank.with_bytes(labels)
    }

    /// The same grid, type and segments with other values.
    ///
    /// # Errors
    /// [`VolumeError::VoxelCount`] if the number of bytes is not that of the grid and the type.
    /// [`VolumeError::Shape`] for a grid without points.
    pub fn with_bytes(self, bytes: Vec<u8>) -> Result<Self, VolumeError> {
        let (shape, size) = (self.grid.shape, self.voxel_bytes());
        let expected = self.grid.checked_len().ok_or(VolumeError::Shape { shape })?;
        if bytes.len() != expected.saturating_mul(size) {
            return Err(VolumeError::VoxelCount { shape, expected, found: bytes.len() / size });
        }
        Ok(Self { bytes, ..self })
    }

    /// The grid of the voxel centers.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The values, little-endian, index `i` fastest.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Bytes per voxel: 1, 2, 4 or 8.
    pub fn voxel_bytes(&self) -> usize {
        self.dtype.bytes()
    }

    /// The type of the values by its NumPy name, such as `uint8`.
    pub fn dtype(&self) -> &'static str {
        self.dtype.name()
    }

    /// Writes the label map with its type. The extension of `path` decides the format. Names and
    /// colors of segments are written to NRRD only.
    ///
    /// The file appears under its name when it is complete.
    ///
    /// # Errors
    /// [`VolumeError::Extension`], [`VolumeError::Sheared`], [`VolumeError::WriteShape`] or
    /// [`VolumeError::Io`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), VolumeError> {
        let (path, grid, dtype) = (path.as_ref(), &self.grid, self.dtype);
        let put = |sink: &mut dyn std::io::Write| sink.write_all(&self.bytes);
        match Format::of(path)? {
            Format::Nifti => nifti::write_voxels(path, grid, dtype, &put),
            Format::Nrrd => nrrd::write_voxels(path, grid, dtype.nrrd_name(), &self.segments, &put),
            Format::MetaImage => metaimage::write_voxels(path, grid, dtype.meta_name(), &put),
        }
    }
}
