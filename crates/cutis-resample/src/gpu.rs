//! Resampling by a GPU: the contract of the CPU's, in `f32`.
//!
//! The passes of a frame, all of them over items that do not depend on each other's order:
//!
//! 1. `place`: positions of the vertices → places among the voxels.
//! 2. `span`: the slices that each tet comes near, now and (if it moved) at rest, and those that a chunk of tets comes near. A
//!    slab's passes skip a chunk that does not touch it, and look at every tet of one that does, skipping those of other slabs
//!    after four bytes. A sort of tets by slab would spare that, but needs counts, sums and a second copy of the list in every
//!    frame; within WebGPU's baseline 128 MiB of owners are a slab, so even 512 × 512 × 1152 voxels are nine.
//! 3. For each slab `claim`: a thread per tet walks the voxels of its box, and `atomicMin` on the owner of each that it holds or
//!    comes near lets the tet with the smallest key win. A tet with a large box goes on a list instead, and the threads of a
//!    workgroup share its rows.
//! 4. `vacate`: the same walk at rest, for tets that moved or were removed, marks what the body may have left.
//! 5. `gather`: a thread per two voxels gives them their value through their owner.
//!
//! What may differ from the CPU's result, which is computed in `f64`: the owner of a center within a few roundings of `f32` of a
//! face, and values by the rounding of the place at rest. A tet so flat, or with a corner so far away, that `f32` cannot tell its
//! volume from zero takes no part.

mod bound;
mod kernels;
mod memory;
mod resampler;
mod setup;
mod state;
mod uniform;

use cutis_gpu::Gpu;
use cutis_volume::Volume;

pub use resampler::ResamplerGpu;
pub use setup::{ResamplerOptions, Setup, relative};
pub use state::{NEAR, NONE, SlabDifference, SlabState};
pub use uniform::Grid;

use crate::report::ResampleReport;
use crate::{ResampleError, Warp};

/// [`resample`](crate::resample) by a GPU: everything goes up, `progress(done, total)` is called for each slab that came back.
///
/// For more than one state of a body keep a [`ResamplerGpu`].
///
/// # Errors
/// As [`resample`](crate::resample), [`ResampleError::TooLarge`], and [`ResampleError::Gpu`] for what the GPU refuses.
pub fn resample_gpu(
    gpu: &Gpu,
    volume: &Volume,
    warp: &Warp<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Volume, ResampleReport), ResampleError> {
    let mut resampler = ResamplerGpu::new(gpu, volume, warp, &ResamplerOptions::centerd(warp))?;
    resampler.resample(warp.deformed)?;
    let volume = resampler.volume(progress)?;
    Ok((volume, resampler.report()?))
}
