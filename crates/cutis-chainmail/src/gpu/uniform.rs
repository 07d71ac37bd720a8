//! The uniform buffers of the relaxation kernel, with the layout that WGSL expects.

use bytemuck::{Pod, Zeroable};

/// `struct Slab` of the kernel.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct SlabUniform {
    /// Elements in a row.
    pub columns: u32,
    /// Rows in a plane.
    pub rows: u32,
    /// Planes in the slab.
    pub planes: u32,
    /// Grid index of the slab's first plane.
    pub first: u32,
    /// Planes in the previous slab; 0 if there is none.
    pub planes_below: u32,
    /// Words that hold the element bytes of one plane.
    pub pitch: u32,
    /// Padding to a multiple of 16 bytes.
    pub unused: [u32; 2],
}

/// `struct Half` of the kernel: one half of a sweep, for one coordinate.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct HalfUniform {
    /// The coordinate that is moved.
    pub coordinate: u32,
    /// 0 for elements whose `i + j + k` is even, 1 for the others.
    pub odd: u32,
    /// Number of materials.
    pub materials: u32,
    /// Padding to a multiple of 16 bytes.
    pub unused: u32,
}
