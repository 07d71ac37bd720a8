//! The crate's error type.

use std::path::PathBuf;

/// Errors of volumes, their files, HU tables, lattices and phantoms.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// The number of values does not match the shape.
    #[error("shape {shape:?} needs {expected} values, but {found} were given")]
    VoxelCount {
        /// Voxels or lattice points per axis.
        shape: [usize; 3],
        /// Product of the shape.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// The matrix of an affine map is not finite or not invertible.
    #[error("affine {rows:?} is not invertible: it must map voxel indices to distinct millimeter positions")]
    SingularAffine {
        /// The four rows of the matrix.
        rows: Box<[[f64; 4]; 4]>,
    },
    /// The operating system reported an error, or a gzip stream is damaged.
    #[error("cannot {action} {path}: {source}")]
    Io {
        /// Path given by the user.
        path: PathBuf,
        /// The failed action: `read`, `write` or `create`.
        action: &'static str,
        /// The error of the operating system or the decoder.
        source: std::io::Error,
    },
    /// The file name does not end in a NIfTI extension.
    #[error("{path}: expected a file name that ends in {expected}")]
    Extension {
        /// Path given by the user.
        path: PathBuf,
        /// The accepted extensions.
        expected: &'static str,
    },
    /// A `.hdr` file has no `.img` file next to it, or the other way round.
    #[error("{path} is one half of a NIfTI pair, but the other half {partner} is missing")]
    MissingPartner {
        /// Path given by the user.
        path: PathBuf,
        /// Path of the missing file.
        partner: PathBuf,
    },
    /// The file does not begin with a NIfTI header.
    #[error("{path} is not a NIfTI file: {reason}")]
    NotNifti {
        /// Path of the file.
        path: PathBuf,
        /// Why the file is not NIfTI.
        reason: &'static str,
    },
    /// A header field holds an invalid value.
    #[error("{path}: header field {field} is {value}, expected {expected}")]
    Header {
        /// Path of the file.
        path: PathBuf,
        /// Name of the field in the NIfTI standard.
        field: &'static str,
        /// Value of the field.
        value: String,
        /// The values that are valid.
        expected: &'static str,
    },
    /// A voxel is not one real number: color, complex or an unknown type.
    #[error(
        "{path}: voxel type {dtype} (code {code}) is not a CT: expected one integer or real number per voxel"
    )]
    VoxelType {
        /// Path of the file.
        path: PathBuf,
        /// Name of the voxel type.
        dtype: &'static str,
        /// Value of `datatype` in the header.
        code: i16,
    },
    /// The file holds a time series or several channels.
    #[error("{path} holds {count} volumes (dim {dim:?}): expected one; extract the one to use first")]
    SeveralVolumes {
        /// Path of the file.
        path: PathBuf,
        /// Number of volumes.
        count: u64,
        /// Sizes of all axes of the file.
        dim: Vec<u64>,
    },
    /// The file ends before its last voxel.
    #[error(
        "{path} is truncated: the header promises {expected_bytes} bytes of voxels, but the file has {found_bytes}"
    )]
    Truncated {
        /// Path of the file.
        path: PathBuf,
        /// Number of voxels times bytes per voxel.
        expected_bytes: u64,
        /// Bytes found after the header, or an upper bound of them for a compressed file.
        found_bytes: u64,
    },
    /// A small compressed file unpacks to more than any scan does.
    #[error(
        "{path} has {file_bytes} bytes and unpacks to {bytes}, more than {times} times as many and more than 1 GiB, as a file that is \
         made to fill the memory: if you trust it, unpack it first"
    )]
    Expansion {
        /// Path of the file.
        path: PathBuf,
        /// Bytes on the disk.
        file_bytes: u64,
        /// Bytes that the header promises.
        bytes: u64,
        /// The largest expansion of a large volume.
        times: u64,
    },
    /// The volume does not fit into the memory of this machine.
    #[error("{path}: {shape:?} voxels are more than this machine can hold")]
    TooLarge {
        /// Path of the file.
        path: PathBuf,
        /// Voxels per axis.
        shape: [u64; 3],
    },
    /// The HU do not fit into int16.
    #[error(
        "{path}: values from {min} to {max} HU do not fit into int16 (-32768 to 32767 HU); is this a CT in Hounsfield units?"
    )]
    Range {
        /// Path of the file.
        path: PathBuf,
        /// Lowest value in HU.
        min: f64,
        /// Highest value in HU.
        max: f64,
    },
    /// A voxel is plus or minus infinity.
    #[error("{path}: voxel {index:?} is {value}: expected finite values (NaN counts as air)")]
    Infinite {
        /// Path of the file.
        path: PathBuf,
        /// Index of the first infinite voxel.
        index: [usize; 3],
        /// Plus or minus infinity.
        value: f64,
    },
    /// The first two axes of a volume are not perpendicular, or its slices are shifted too far.
    #[error(
        "the volume cannot be resampled to perpendicular axes (the largest cosine between two of its axes is {cosine:.6}): its \
         first two axes must be perpendicular, and its slices may be shifted by at most four times their size"
    )]
    NotStacked {
        /// Largest |cosine| between two index axes.
        cosine: f64,
    },
    /// The HU of a volume to resample do not fit into int16.
    #[error("{hu} HU do not fit into int16 (-32768 to 32767 HU); is this a CT in Hounsfield units?")]
    ResampledRange {
        /// The first such value.
        hu: f32,
    },
    /// DICOM files are not a CT volume.
    #[cfg(feature = "dicom")]
    #[error(transparent)]
    Dicom(#[from] Box<crate::dicom::DicomError>),
    /// NIfTI-1 cannot hold this shape.
    #[error("{path}: shape {shape:?} cannot be written: NIfTI-1 holds 1 to 32767 voxels per axis")]
    WriteShape {
        /// Path of the file to write.
        path: PathBuf,
        /// Voxels per axis.
        shape: [usize; 3],
    },
    /// The affine has a shear. A qform cannot represent it, and ITK refuses it.
    #[error(
        "{path}: the voxel axes are not perpendicular (the largest cosine between two of them is {cosine:.6}). A NIfTI qform and a \
         MetaImage cannot hold that; read it with volume.resample = true or --resample, which resamples to perpendicular axes"
    )]
    Sheared {
        /// Path of the file to write.
        path: PathBuf,
        /// Largest |cosine| between two index axes.
        cosine: f64,
    },
    /// A [`nifti::Writer`](crate::nifti::Writer) received more or fewer voxels than its grid has.
    #[error("{path}: the grid has {expected} voxels, but {found} were written")]
    Pushed {
        /// Path of the file to write.
        path: PathBuf,
        /// Number of voxels of the grid.
        expected: usize,
        /// Number of voxels received.
        found: usize,
    },
    /// A phantom has no voxels along an axis, too many along an axis, or too many for the memory.
    #[error(
        "a phantom of shape {shape:?} is not possible: expected 1 to {most} voxels per axis, and memory for all of them"
    )]
    PhantomShape {
        /// Voxels per axis.
        shape: [usize; 3],
        /// Largest number of voxels per axis.
        most: usize,
    },
    /// An angle by which a phantom is to be turned is not finite.
    #[error("turn_deg = {turn_deg:?} is not possible: expected three finite angles in degrees")]
    PhantomTurn {
        /// Angles about x, y and z in degrees.
        turn_deg: [f64; 3],
    },
    /// A range of slices is not within the volume.
    #[error("slices {start}..{end} do not exist: the volume has {count}")]
    SliceRange {
        /// First requested slice.
        start: usize,
        /// One past the last requested slice.
        end: usize,
        /// Number of slices of the volume.
        count: usize,
    },
    /// The radii of concentric spheres are not finite, not positive, or do not decrease inwards.
    #[error(
        "sphere radii {radii_mm:?} mm: expected finite positive values that decrease from the outermost inwards"
    )]
    SphereRadii {
        /// The radii in mm.
        radii_mm: Vec<f64>,
    },
    /// A shape has no points, or more than memory can address.
    #[error(
        "shape {shape:?} is not possible: expected at least 1 point per axis, and fewer than {} in total",
        usize::MAX
    )]
    Shape {
        /// Points per axis.
        shape: [usize; 3],
    },
    /// The map from stored values to HU is not finite or not invertible.
    #[error("HU = {slope} × stored + {intercept}: expected finite numbers and a slope that is not 0")]
    Scaling {
        /// HU per stored unit.
        slope: f32,
        /// HU of the stored value 0.
        intercept: f32,
    },
    /// A table has no points, a value that is not finite, or HU that do not increase.
    #[error(
        "table in {unit}: {count} points, point {point} is {value:?}: expected finite numbers and HU that increase from point to point"
    )]
    Table {
        /// Unit of the values.
        unit: String,
        /// Number of points given; at least one is needed.
        count: usize,
        /// Position of the first wrong point.
        point: usize,
        /// HU and value of that point, if there is one.
        value: Option<(f32, f32)>,
    },
    /// No table has this name.
    #[error("no {kind} table is called {name:?}: expected {expected}")]
    Preset {
        /// The property that the table gives.
        kind: &'static str,
        /// The requested name.
        name: String,
        /// The existing names.
        expected: String,
    },
    /// A text is not a lattice size.
    #[error(
        "lattice {text:?}: expected native, a spacing in mm (4.0) or vertices along the axes (129,107,118)"
    )]
    LatticeText {
        /// The given text.
        text: String,
    },
    /// A lattice has fewer than two vertices along an axis, or too many for 32-bit indices.
    #[error(
        "a lattice of {} vertices over {shape:?} voxels is not possible: expected at least 2 vertices and 2 voxels \
         along each axis, and at most {most} vertices in total",
        counts(vertices)
    )]
    LatticeSize {
        /// Vertices along each axis, rounded. Very small spacings give very large numbers.
        vertices: [f64; 3],
        /// Voxels along each axis.
        shape: [usize; 3],
        /// Largest number of vertices of a lattice.
        most: u64,
    },
    /// A lattice spacing is not a positive length.
    #[error("lattice spacing {spacing_mm} mm: expected a positive number")]
    LatticeSpacing {
        /// The given spacing in mm.
        spacing_mm: f64,
    },
    /// The axes of a grid to sample are not those of the volume.
    #[error(
        "axis {axis} of the grid drifts by {drift_voxels:.3} voxels along axis {other} of the volume: the axes must be the \
         same, as in a grid from sample::lattice_grid"
    )]
    NotAligned {
        /// Axis of the grid.
        axis: usize,
        /// Axis of the volume.
        other: usize,
        /// Largest drift along that axis, in voxels.
        drift_voxels: f64,
    },
}

#[cfg(feature = "dicom")]
impl From<crate::dicom::DicomError> for VolumeError {
    fn from(error: crate::dicom::DicomError) -> Self {
        Self::Dicom(Box::new(error))
    }
}

/// Numbers of vertices as text: `[401, 301, 201]`, or `1e300` for one that is very large.
fn counts(vertices: &[f64; 3]) -> String {
    let text = |&n: &f64| if n < 1e15 { format!("{n:.0}") } else { format!("{n:e}") };
    format!("[{}]", vertices.each_ref().map(text).join(", "))
}
