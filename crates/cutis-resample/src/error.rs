//! The crate's error type.

use cutis_volume::VolumeError;

/// Everything that can be wrong with a warp.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResampleError {
    /// Rest and deformed positions describe the same vertices.
    #[error("{rest} rest positions but {deformed} deformed positions: each vertex needs one of both")]
    VertexCount {
        /// Number of rest positions.
        rest: usize,
        /// Number of deformed positions.
        deformed: usize,
    },
    /// A position is NaN or infinite.
    #[error("{which} position of vertex {vertex} is {position:?}: every coordinate must be finite")]
    NotFinite {
        /// `"rest"`, `"deformed"`, `"origin"` or `"offset"`.
        which: &'static str,
        /// Index of the vertex (0 for the origin and the offset).
        vertex: usize,
        /// Its coordinates, local meters (mm for the origin).
        position: [f64; 3],
    },
    /// A tet names a vertex that does not exist.
    #[error("{which}[{tet}] = {corners:?} names a vertex out of range: there are {vertices} vertices")]
    VertexOutOfRange {
        /// `"tets"` or `"removed"`.
        which: &'static str,
        /// Index of the tet in its list.
        tet: usize,
        /// Its four vertices.
        corners: [u32; 4],
        /// Number of vertices.
        vertices: usize,
    },
    /// The body tets are the first ones of the list.
    #[error("body_tets is {body_tets}, but there are only {tets} tets")]
    BodyTets {
        /// Given number of body tets.
        body_tets: usize,
        /// Number of tets.
        tets: usize,
    },
    /// Tet numbers are stored in 32 bits.
    #[error("{tets} tets given, at most {limit} can be numbered")]
    TooManyTets {
        /// Number of tets.
        tets: usize,
        /// The largest number allowed.
        limit: usize,
    },
    /// The region asked for is empty or leaves the volume.
    #[error("region {start:?}..{end:?} must not be empty and must lie within the volume's shape {shape:?}")]
    Region {
        /// First voxel per axis.
        start: [usize; 3],
        /// End, exclusive, per axis.
        end: [usize; 3],
        /// The volume's shape.
        shape: [usize; 3],
    },
    /// Voxels are numbered in 16 bits along each axis by the kernels of the GPU.
    #[error("the volume's shape is {shape:?}, but a GPU resamples at most {limit} voxels along each axis")]
    TooLarge {
        /// The volume's shape.
        shape: [usize; 3],
        /// The largest number of voxels along an axis.
        limit: usize,
    },
    /// There are slabs of so many slices only.
    #[error("slab {slab} was asked for, but there are only {slabs}")]
    NoSuchSlab {
        /// The slab asked for.
        slab: usize,
        /// How many there are.
        slabs: usize,
    },
    /// The result is not a valid volume.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The GPU refused or failed.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] cutis_gpu::GpuError),
}
