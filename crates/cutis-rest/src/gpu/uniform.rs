//! The uniform buffers of the kernels, with the layout that WGSL expects.

use bytemuck::{Pod, Zeroable};

/// `struct Chunk` of `sliced.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ChunkUniform {
    /// The first slice of a part of a matrix.
    pub first: u32,
    /// Number of rows of the whole matrix.
    pub rows: u32,
    /// Padding to 16 bytes.
    pub unused: [u32; 2],
}

/// `struct Factors` of `smooth.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct FactorsUniform {
    /// For the change before.
    pub old: f32,
    /// For the inverse of the diagonal times the residual.
    pub step: f32,
    /// Padding to 16 bytes.
    pub unused: [u32; 2],
}

/// `struct Dense` of `dense.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct DenseUniform {
    /// Number of rows and of columns.
    pub size: u32,
    /// Unknowns of a node.
    pub unknowns: u32,
    /// Numbers of a node in a vector.
    pub lanes: u32,
    /// Padding to 16 bytes.
    pub unused: u32,
}

/// `struct Factor` of `vectors.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct FactorUniform {
    /// The length of a step, or the ratio of two.
    pub factor: f32,
    /// Padding to 16 bytes.
    pub unused: [u32; 3],
}
