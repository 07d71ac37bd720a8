//! The uniform buffers of the kernels, with the layout that WGSL expects.

use bytemuck::{Pod, Zeroable};

/// `struct Grid` of the kernels: the volume, and the map from positions to places.
///
/// A place is a voxel index relative to the voxel `center`, so that `f32` has its best resolution
/// near the body.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GridUniform {
    /// Rows of the matrix that maps positions (meters) to places (voxels).
    pub linear: [[f32; 3]; 3],
    /// Place of position zero.
    pub offset: [f32; 3],
    /// Length in voxels below which two positions cannot be distinguished.
    pub tolerance: f32,
    /// Place of the first voxel that is filled.
    pub region: [f32; 3],
    /// Number of voxels that are filled along each axis.
    pub shape: [u32; 3],
    /// Place of the volume's first voxel.
    pub first: [f32; 3],
    /// Place of the volume's last voxel.
    pub last: [f32; 3],
    /// The voxel at place zero.
    pub center: [i32; 3],
    /// Stored value of a vacated voxel.
    pub air: i32,
    /// Range of stored values that are not padding, both ends included.
    pub scanned: [i32; 2],
    /// Padding to a multiple of 16 bytes.
    pub unused: u32,
}

/// `struct Slab` of the kernels: the slices that one pass fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Slab {
    /// First slice.
    pub first: u32,
    /// Number of slices.
    pub slices: u32,
    /// Number of voxels.
    pub voxels: u32,
    /// Number of lists of large tets.
    pub lists: u32,
    /// Index of this slab's first counter.
    pub counts: u32,
    /// Padding to a multiple of 16 bytes.
    pub unused: [u32; 3],
}

/// `struct Chunk` of the kernels: tets that share a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Chunk {
    /// Number of the first tet among all tets.
    pub first: u32,
    /// Number of tets.
    pub count: u32,
    /// Number of tets that belong to the body; they come first.
    pub body: u32,
    /// Index of their list of large tets.
    pub list: u32,
}
