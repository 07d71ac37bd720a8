//! The crate's error type.

use std::path::PathBuf;

/// Everything that can be wrong with a volume, its file, a table or a lattice.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// The number of voxels does not match the shape.
    #[error("shape {shape:?} needs {expected} voxels, but {found} were given")]
    VoxelCount {
        /// Voxels per axis.
        shape: [usize; 3],
        /// Product of the shape, saturated.
        expected: usize,
        /// Length of the data.
        found: usize,
    },
    /// A matrix that maps indices to millimeters must be finite and invertible.
    #[error("affine {rows:?} is not invertible: it must map voxel indices to distinct millimeter positions")]
    SingularAffine {
        /// The four rows.
        rows: Box<[[f64; 4]; 4]>,
    },
    /// The operating system refused: missing file, no permission, disk full, damaged gzip stream.
    #[error("cannot {action} {path}: {source}")]
    Io {
        /// The file the user named.
        path: PathBuf,
        /// What was tried: `read`, `write`, `create`, …
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The name does not end in a NIfTI extension.
    #[error("{path}: expected a file name that ends in {expected}")]
    Extension {
        /// The file the user named.
        path: PathBuf,
        /// The extensions that would do.
        expected: &'static str,
    },
    /// A `.hdr` without its `.img`, or the other way round.
    #[error("{path} is one half of a NIfTI pair, and the other half {partner} is not beside it")]
    MissingPartner {
        /// The file the user named.
        path: PathBuf,
        /// The file that should be there.
        partner: PathBuf,
    },
    /// The first bytes are no NIfTI header.
    #[error("{path} is not a NIfTI file: {reason}")]
    NotNifti {
        /// The file.
        path: PathBuf,
        /// What is missing.
        reason: &'static str,
    },
    /// A header field holds a value that cannot be right.
    #[error("{path}: header field {field} is {value}, expected {expected}")]
    Header {
        /// The file.
        path: PathBuf,
        /// Name of the field in the NIfTI standard.
        field: &'static str,
        /// What it holds.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// Color, complex or other voxels that are not one real number.
    #[error(
        "{path}: voxel type {dtype} (code {code}) is not a CT: expected one integer or real number per voxel"
    )]
    VoxelType {
        /// The file.
        path: PathBuf,
        /// Name of the type.
        dtype: &'static str,
        /// `datatype` in the header.
        code: i16,
    },
    /// A time series or several channels.
    #[error("{path} holds {count} volumes (dim {dim:?}): expected one; extract the one to use first")]
    SeveralVolumes {
        /// The file.
        path: PathBuf,
        /// How many.
        count: u64,
        /// Sizes of all axes.
        dim: Vec<u64>,
    },
    /// The file ends before its last voxel.
    #[error(
        "{path} is truncated: the header promises {expected_bytes} bytes of voxels, {found_bytes} are there"
    )]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Voxels × bytes per voxel.
        expected_bytes: u64,
        /// Bytes found after the header.
        found_bytes: u64,
    },
    /// More voxels than this program, or this machine, can address.
    #[error("{path}: {shape:?} voxels are more than this machine can hold")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Voxels per axis.
        shape: [u64; 3],
    },
    /// HU that do not fit into int16.
    #[error(
        "{path}: values from {min} to {max} HU do not fit into int16 (-32768 to 32767 HU); is this a CT in Hounsfield units?"
    )]
    Range {
        /// The file.
        path: PathBuf,
        /// Lowest value, HU.
        min: f64,
        /// Highest value, HU.
        max: f64,
    },
    /// A voxel is plus or minus infinity.
    #[error("{path}: voxel {index:?} is {value}: expected finite values (NaN counts as air)")]
    Infinite {
        /// The file.
        path: PathBuf,
        /// Index of the first such voxel.
        index: [usize; 3],
        /// Infinity or minus infinity.
        value: f64,
    },
    /// NIfTI-1 cannot hold this shape.
    #[error("{path}: shape {shape:?} cannot be written: NIfTI-1 holds 1 to 32767 voxels per axis")]
    WriteShape {
        /// The target.
        path: PathBuf,
        /// Voxels per axis.
        shape: [usize; 3],
    },
    /// The affine has a shear, which a qform cannot represent and ITK refuses.
    #[error(
        "{path}: the voxel axes are not perpendicular (largest cosine between two {cosine:.6}), which a NIfTI qform cannot hold; \
         resample to an orthogonal grid first"
    )]
    Sheared {
        /// The target.
        path: PathBuf,
        /// Largest |cosine| between two index axes.
        cosine: f64,
    },
    /// A streaming writer got more or fewer voxels than its grid has.
    #[error("{path}: {found} voxels were pushed, the grid has {expected}")]
    Pushed {
        /// The target.
        path: PathBuf,
        /// Voxels of the grid.
        expected: usize,
        /// Voxels pushed.
        found: usize,
    },
    /// A phantom with no voxels along an axis, or with too many for the axis or for memory.
    #[error(
        "a phantom of shape {shape:?} cannot be made: expected 1 to {most} voxels per axis, and memory for all of them"
    )]
    PhantomShape {
        /// Voxels per axis.
        shape: [usize; 3],
        /// The most that an axis may have.
        most: usize,
    },
    /// Slices that a volume does not have.
    #[error("slices {start}..{end} were asked for, the volume has {count}")]
    SliceRange {
        /// First slice.
        start: usize,
        /// One past the last slice.
        end: usize,
        /// Slices of the volume.
        count: usize,
    },
    /// Concentric spheres need radii that are finite, positive and decrease from the outermost inwards.
    #[error(
        "sphere radii {radii_mm:?} mm: expected finite positive values, the outermost first and each one smaller"
    )]
    SphereRadii {
        /// The radii, mm.
        radii_mm: Vec<f64>,
    },
    /// A volume needs at least one voxel, and no more than memory can address.
    #[error(
        "shape {shape:?} is not possible: expected at least 1 voxel per axis, and fewer than {} in all",
        usize::MAX
    )]
    Shape {
        /// Voxels per axis.
        shape: [usize; 3],
    },
    /// The map from stored values to HU must be invertible.
    #[error("HU = {slope} × stored + {intercept}: expected finite numbers and a slope that is not 0")]
    Scaling {
        /// HU per stored unit.
        slope: f32,
        /// HU of the stored value 0.
        intercept: f32,
    },
    /// A table needs finite points in ascending order of HU.
    #[error(
        "table in {unit}: {count} points, point {point} is {value:?}: expected finite numbers and HU that increase from point to point"
    )]
    Table {
        /// Unit of the table.
        unit: String,
        /// How many points were given; at least one is needed.
        count: usize,
        /// The first that is wrong.
        point: usize,
        /// Its HU and value.
        value: Option<(f32, f32)>,
    },
    /// The text is no table.
    #[error(
        "{origin}: {message}; expected for example: unit = \"kg/m3\", points = [[-1000, 1.2], [0, 1000]]"
    )]
    TableText {
        /// File name, or what else the text came from.
        origin: String,
        /// What the parser found.
        message: String,
    },
    /// No preset of that name.
    #[error("no {kind} table is called {name:?}: expected {expected}")]
    Preset {
        /// What the table is for.
        kind: &'static str,
        /// The name asked for.
        name: String,
        /// The names there are.
        expected: String,
    },
    /// The text is no lattice size.
    #[error(
        "lattice {text:?}: expected native, a spacing in mm (4.0) or vertices along the axes (129,107,118)"
    )]
    LatticeText {
        /// What was given.
        text: String,
    },
    /// A lattice needs two vertices along each axis, and a number of vertices that fits into 32 bits.
    #[error(
        "a lattice of {vertices:?} vertices cannot be laid over {shape:?} voxels: expected at least 2 along each axis of both, \
         and at most {most} in all"
    )]
    LatticeSize {
        /// Vertices along the axes, rounded; infinite for a spacing of 0.
        vertices: [f64; 3],
        /// Voxels along the axes.
        shape: [usize; 3],
        /// The most a lattice can have.
        most: u64,
    },
    /// A spacing must be a positive length.
    #[error("lattice spacing {spacing_mm} mm: expected a positive number")]
    LatticeSpacing {
        /// What was given.
        spacing_mm: f64,
    },
}
