//! The crate's error type.

/// Everything that can be wrong with a volume or its file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// The number of voxels does not match the shape.
    #[error("shape {shape:?} needs {expected} voxels, but {found} were given")]
    VoxelCount {
        /// Voxels per axis.
        shape: [usize; 3],
        /// Product of the shape.
        expected: usize,
        /// Length of the data.
        found: usize,
    },
    /// A matrix that maps indices to millimetres must be finite and invertible.
    #[error("affine {rows:?} is not invertible: it must map voxel indices to distinct millimetre positions")]
    SingularAffine {
        /// The four rows.
        rows: [[f64; 4]; 4],
    },
}
