//! Errors of resampling.

use cutis_volume::VolumeError;

/// Errors of resampling a volume.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResampleError {
    /// The numbers of rest and deformed positions differ.
    #[error("{rest} rest positions but {deformed} deformed positions: there must be one of each per vertex")]
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
        /// Its coordinates in local meters (mm for the origin).
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
    /// There are fewer tets than body tets.
    #[error("body_tets is {body_tets}, but there are only {tets} tets")]
    BodyTets {
        /// Number of body tets.
        body_tets: usize,
        /// Number of all tets.
        tets: usize,
    },
    /// There are more tets than can be numbered.
    #[error("{tets} tets: at most {limit} can be numbered")]
    TooManyTets {
        /// Number of tets.
        tets: usize,
        /// Largest number of tets.
        limit: usize,
    },
    /// The list of tets next to walls names a tet that does not exist.
    #[error("at_walls names tet {tet}, but there are {tets} tets, numbered from 0")]
    NoSuchTet {
        /// Index of the tet.
        tet: u32,
        /// Number of tets.
        tets: usize,
    },
    /// A resampled volume does not lie on the grid of its input.
    #[error("the resampled volume has the shape {found:?}: its grid must be that of the input, {expected:?}")]
    OtherGrid {
        /// Shape of the input.
        expected: [usize; 3],
        /// Shape of the resampled volume.
        found: [usize; 3],
    },
    /// The volume is too large for the kernels, which number voxels along an axis in 16 bits.
    #[error("the shape of the volume is {shape:?}: a GPU resamples at most {limit} voxels along each axis")]
    TooLarge {
        /// Shape of the volume.
        shape: [usize; 3],
        /// Largest number of voxels along an axis.
        limit: usize,
    },
    /// There is no slab with this number.
    #[error("there is no slab {slab}: the volume is divided into {slabs} slabs, numbered from 0")]
    NoSuchSlab {
        /// Number of the requested slab.
        slab: usize,
        /// Number of slabs.
        slabs: usize,
    },
    /// The result is not a valid volume.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The GPU rejected the work or failed.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] cutis_gpu::GpuError),
}
