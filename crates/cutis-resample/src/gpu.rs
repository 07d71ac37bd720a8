//! Resampling on a GPU in `f32`, with the same rules as on the CPU.
//!
//! The passes of a frame do not depend on the order in which their items are processed:
//!
//! 1. `place` maps positions of vertices to voxel indices relative to a central voxel ("places").
//! 2. `span` finds the slices that each tet comes near, deformed and (if it moved) at rest, and the
//!    slices that a chunk of tets comes near. The passes of a slab skip chunks that do not touch
//!    it. In all other chunks they look at every tet, and skip a tet of another slab after reading
//!    four bytes. Sorting tets by slab would avoid these reads, but would need counts, sums and a
//!    second copy of the list in every frame. A slab has up to 128 MiB of owners within WebGPU's
//!    baseline limits, so that even 512 × 512 × 1152 voxels need only nine slabs.
//! 3. `claim` runs for each slab, with one thread per tet. The thread visits the voxels in the box
//!    of its tet. For each voxel that the tet holds or comes near, `atomicMin` on the voxel's owner
//!    lets the tet with the smallest key win. A tet with a large box goes on a list instead, and
//!    the threads of a workgroup share its rows.
//! 4. `vacate` visits tets that moved or were removed in the same way at rest. It marks voxels that
//!    the body may have left.
//! 5. `gather` runs with one thread per two voxels and computes their values through their owners.
//!
//! The CPU computes in `f64`. Two results may differ from those of the CPU. First, a center that is
//! within a few `f32` roundings of a face may have another owner. Second, values change with the
//! rounding of the place at rest. A tet takes no part if `f32` cannot distinguish its volume from
//! zero, because it is too flat or a corner is too far away.

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
pub use setup::{ResamplerOptions, Setup};
pub use state::SlabState;
pub use uniform::GridUniform;

use crate::report::ResampleReport;
use crate::{ResampleError, Warp};

/// Resamples a volume on a GPU, as [`resample`](crate::resample) does on the CPU.
///
/// `progress(done, total)` is called for each slab that was read back. To resample through several
/// states of a body, use a [`ResamplerGpu`], which uploads the volume only once.
///
/// # Errors
/// The errors of [`resample`](crate::resample), [`ResampleError::TooLarge`] and
/// [`ResampleError::Gpu`].
pub fn resample_gpu(
    gpu: &Gpu,
    volume: &Volume,
    warp: &Warp<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Volume, ResampleReport), ResampleError> {
    let mut resampler = ResamplerGpu::new(gpu, volume, warp, &ResamplerOptions::centered(warp))?;
    resampler.resample(warp.deformed)?;
    let volume = resampler.volume(progress)?;
    Ok((volume, resampler.report()?))
}
