//! The crate's error type.

use std::io;
use std::path::PathBuf;

use cutis_volume::VolumeError;

/// Everything that can go wrong with a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// An image must have pixels, and not more than can be held.
    #[error(
        "an image of {width} × {height} pixels: both must be at least 1 and their product at most {limit}"
    )]
    ImageSize {
        /// Pixels along a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Largest number of pixels.
        limit: usize,
    },
    /// A setting of a view is not a usable number.
    #[error("{key} is {value}: it must be {expected}")]
    Setting {
        /// Name of the field.
        key: &'static str,
        /// The value, as given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A triangle of a contour names a vertex that does not exist.
    #[error(
        "contour {contour}, triangle {triangle} = {corners:?} names a vertex out of range: there are {vertices} vertices"
    )]
    VertexOutOfRange {
        /// Index of the contour.
        contour: usize,
        /// Index of the triangle.
        triangle: usize,
        /// Its three vertices.
        corners: [u32; 3],
        /// Number of vertices.
        vertices: usize,
    },
    /// A picture could not be encoded or written.
    #[error("{path}: cannot write the picture: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file could not be created or replaced, or a derived volume is not valid.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The GPU could not do it.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] cutis_gpu::GpuError),
}
