//! Errors of pictures.

use std::io;
use std::path::PathBuf;

use cutis_volume::VolumeError;

/// Errors of drawing and writing pictures.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// A picture has no pixels, or too many.
    #[error(
        "an image of {width} × {height} pixels: both must be at least 1 and their product at most {limit}"
    )]
    ImageSize {
        /// Pixels in a row.
        width: usize,
        /// Number of rows.
        height: usize,
        /// Largest number of pixels.
        limit: usize,
    },
    /// A setting of a view is out of range.
    #[error("{key} is {value}: it must be {expected}")]
    Setting {
        /// Name of the field.
        key: &'static str,
        /// Value of the field.
        value: f64,
        /// Allowed values.
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
    /// A field of directions does not have one value per triangle.
    #[error("{array} has {found} values; expected {expected}, one per triangle")]
    FieldLength {
        /// Name of the array.
        array: &'static str,
        /// Number of triangles.
        expected: usize,
        /// Number of values.
        found: usize,
    },
    /// A picture could not be encoded or written.
    #[error("{path}: cannot write the picture: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A file could not be created or replaced, or a derived volume is invalid.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The GPU rejected the work or failed.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] cutis_gpu::GpuError),
}
