//! How the work is divided, and the buffers that all parts share.

use std::ops::Range;

use cutis_gpu::{Buffer, Gpu, GpuError, Texture3d};
use cutis_volume::Volume;

use super::setup::{ResamplerOptions, Setup};
use super::state::mark_words;
use super::uniform::GridUniform;
use crate::Warp;

/// Largest size of a slab's owners on any device: WebGPU's baseline limit for a binding.
const OWNER_BYTES: u64 = 128 << 20;
/// A list of large tets has room for one of this many tets of a chunk, and for at least one. A
/// large tet without room on the list is visited by a single thread.
const TETS_PER_PLACE: usize = 8;
/// Number of counters per slab: moved, vacated and folded voxels.
pub const COUNTS: usize = 3;

/// The reach of a chunk without tets.
pub const NO_REACH: [u32; 2] = [u32::MAX, 0];

/// Division of tets into chunks and of slices into slabs.
pub struct Plan {
    /// Largest number of tets in a buffer.
    pub chunk_tets: usize,
    /// Number of chunks of deformed tets. There is at least one, so that voxels get values even
    /// without tets.
    pub chunks: usize,
    pub removed_chunks: usize,
    /// Largest number of tets on a list of large tets.
    pub listed: usize,
    /// Slices of each slab.
    pub slabs: Vec<Range<usize>>,
    /// Number of voxels in the largest slab.
    pub slab_voxels: usize,
}

impl Plan {
    pub fn new(gpu: &Gpu, shape: [usize; 3], warp: &Warp<'_>, options: &ResamplerOptions) -> Self {
        let [columns, rows, slices] = shape;
        let slice_voxels = columns * rows;
        let chunk_tets = gpu.chunk_len(size_of::<[u32; 4]>());
        let limits = gpu.limits();
        let room = limits.max_binding_bytes.min(limits.max_buffer_bytes).min(OWNER_BYTES) as usize;
        let fitting = (room / size_of::<u32>() / slice_voxels).max(1);
        let slab = options.slab_slices.unwrap_or(fitting).clamp(1, fitting).min(slices);
        Self {
            chunk_tets,
            chunks: warp.tets.len().div_ceil(chunk_tets).max(1),
            removed_chunks: warp.removed.len().div_ceil(chunk_tets),
            listed: (chunk_tets.min(warp.tets.len().max(warp.removed.len())) / TETS_PER_PLACE).max(1),
            slabs: (0..slices).step_by(slab).map(|start| start..slices.min(start + slab)).collect(),
            slab_voxels: slab * slice_voxels,
        }
    }

    /// Number of lists of large tets: two for each chunk (claim and vacate), and one for each
    /// removed chunk.
    pub fn lists(&self) -> usize {
        2 * self.chunks + self.removed_chunks
    }
}

/// Buffers that exist once on the device.
pub struct Memory {
    pub source: Texture3d,
    pub grid: Buffer<GridUniform>,
    pub rest: Buffer<[f32; 4]>,
    pub rest_places: Buffer<[f32; 4]>,
    pub places: Buffer<[f32; 4]>,
    pub owners: Buffer<u32>,
    pub marks: Buffer<u32>,
    /// Lengths of the lists of large tets, followed by the list in use.
    pub large: Buffer<u32>,
    /// For each of these lists: first and end of the slices that its tets come near.
    pub reaches: Buffer<[u32; 2]>,
    /// Number of inverted tets, followed by [`COUNTS`] counters for each slab.
    pub counters: Buffer<u32>,
}

impl Memory {
    pub fn new(gpu: &Gpu, volume: &Volume, setup: &Setup, plan: &Plan) -> Result<Self, GpuError> {
        Ok(Self {
            source: gpu.texture_3d("resample: volume", volume.grid().shape, volume.voxels())?,
            grid: gpu.uniform("resample: grid", &setup.grid)?,
            rest: gpu.buffer("resample: rest positions", &setup.rest)?,
            rest_places: gpu.zeroed("resample: rest places", setup.rest.len())?,
            places: gpu.zeroed("resample: places", setup.rest.len())?,
            owners: gpu.zeroed("resample: owners", plan.slab_voxels)?,
            marks: gpu.zeroed("resample: marks", mark_words(plan.slab_voxels))?,
            large: gpu.zeroed("resample: large tets", plan.lists() + plan.listed)?,
            reaches: gpu.buffer("resample: reaches", &vec![NO_REACH; plan.lists()])?,
            counters: gpu.zeroed("resample: counters", 1 + COUNTS * plan.slabs.len())?,
        })
    }

    /// Size of all buffers in bytes.
    pub fn bytes(&self) -> u64 {
        let Self { source, grid, rest, rest_places, places, owners, marks, large, reaches, counters } = self;
        let volume = source.shape().iter().product::<usize>() as u64 * size_of::<i16>() as u64;
        let vertices = rest.bytes() + rest_places.bytes() + places.bytes();
        let slab = owners.bytes() + marks.bytes() + large.bytes();
        volume + vertices + slab + grid.bytes() + reaches.bytes() + counters.bytes()
    }
}
