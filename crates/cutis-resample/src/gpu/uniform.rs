//! What the kernels are told, as they read it.

use bytemuck::{Pod, Zeroable};

/// `struct Grid` of the kernels: the volume, the region of it that is filled, and the way from positions to places.
///
/// A place is a voxel index relative to the voxel `center` of the volume, so that `f32` is fine near the body.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Grid {
    /// Rows of the matrix that turns positions (meters) into places (voxels).
    pub linear: [[f32; 3]; 3],
    /// Place of the position zero.
    pub offset: [f32; 3],
    /// Length in voxels below which two positions cannot be told apart.
    pub tolerance: f32,
    /// Place of the region's first voxel.
    pub region: [f32; 3],
    /// Shape of the region.
    pub shape: [u32; 3],
    /// Place of the volume's first voxel.
    pub first: [f32; 3],
    /// Place of its last voxel.
    pub last: [f32; 3],
    /// The voxel at place zero.
    pub center: [i32; 3],
    /// Stored value of a vacated voxel.
    pub air: i32,
    /// Stored values that are no padding, both ends included.
    pub scanned: [i32; 2],
    /// Fills the last block of 16 bytes.
    pub unused: u32,
}

/// `struct Slab` of the kernels: the slices that one pass fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Slab {
    /// First slice, relative to the region.
    pub first: u32,
    /// Number of slices.
    pub slices: u32,
    /// Number of voxels.
    pub voxels: u32,
    /// Number of lists of large tets.
    pub lists: u32,
    /// Where the counts of this slab begin among the counters.
    pub counts: u32,
    /// Fills the last block of 16 bytes.
    pub unused: [u32; 3],
}

/// `struct Chunk` of the kernels: tets that lie in one buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Chunk {
    /// Number of the first tet among all.
    pub first: u32,
    /// Number of tets.
    pub count: u32,
    /// How many of them, the first ones, are the body's.
    pub body: u32,
    /// Which list of large tets is theirs.
    pub list: u32,
}
