//! What the kernel is told, as it reads it.

use bytemuck::{Pod, Zeroable};

/// `struct Slab` of the kernel.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct SlabUniform {
    /// Elements of a row.
    pub columns: u32,
    /// Rows of a plane.
    pub rows: u32,
    /// Planes of the slab.
    pub planes: u32,
    /// Number of the first of them.
    pub first: u32,
    /// Planes of the slab before; 0 if there is none.
    pub planes_below: u32,
    /// Words of a plane among the elements' bytes.
    pub pitch: u32,
    /// Fills the last block of 16 bytes.
    pub unused: [u32; 2],
}

/// `struct Half` of the kernel.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct HalfUniform {
    /// The coordinate that is moved.
    pub coordinate: u32,
    /// 0 for elements whose `i + j + k` is even, 1 for the others.
    pub odd: u32,
    /// Number of materials.
    pub materials: u32,
    /// Fills the block of 16 bytes.
    pub unused: u32,
}
