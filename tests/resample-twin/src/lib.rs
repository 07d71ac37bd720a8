//! The kernels of the GPU once more, in plain scalar `f32`: same names, same order of arguments, same operations.
//!
//! On an adapter that computes without contraction (every software one) the results are equal bit for bit. It is slow and
//! serial, and there to be compared with: parity tests take [`resample_slab`] and [`resample`].

mod gather;
mod passes;
mod tet;

use std::ops::Range;

use cutis_volume::Volume;

use crate::gpu::{Setup, SlabState, relative};
use crate::report::ResampleReport;
use crate::{ResampleError, ResamplerOptions, Warp};

use gather::gather;
use passes::{Mesh, claim, place, span, span_removed, vacate};

/// What [`resample_gpu`](crate::resample_gpu) does, by the twin; options as for
/// [`ResamplerGpu::new`](crate::ResamplerGpu::new).
///
/// # Errors
/// As [`resample`](crate::resample), and [`ResampleError::TooLarge`].
pub fn resample(
    volume: &Volume,
    warp: &Warp<'_>,
    options: &ResamplerOptions,
) -> Result<(Volume, ResampleReport), ResampleError> {
    let setup = Setup::new(volume, warp, options)?;
    let slices = 0..setup.region[2].len();
    let (state, inverted_tets) = fill(&setup, volume, warp, slices);
    let report = ResampleReport { inverted_tets, ..state.report() };
    let volume = Volume::new(setup.volume_grid, state.values, volume.slope(), volume.intercept())?;
    Ok((volume, report))
}

/// The state of a slab after the passes over it; `slices` count from the region's first one.
///
/// # Errors
/// As [`resample`], and [`ResampleError::Region`] if the slices are empty or leave the region.
pub fn resample_slab(
    volume: &Volume,
    warp: &Warp<'_>,
    options: &ResamplerOptions,
    slices: Range<usize>,
) -> Result<SlabState, ResampleError> {
    let setup = Setup::new(volume, warp, options)?;
    let [columns, rows, whole] = setup.region.each_ref().map(Range::len);
    if slices.start >= slices.end || slices.end > whole {
        return Err(ResampleError::Region {
            start: [0, 0, slices.start],
            end: [columns, rows, slices.end],
            shape: [columns, rows, whole],
        });
    }
    Ok(fill(&setup, volume, warp, slices).0)
}

fn fill(setup: &Setup, volume: &Volume, warp: &Warp<'_>, slices: Range<usize>) -> (SlabState, usize) {
    let places = place(&setup.grid, &relative(warp.deformed, setup.offset), &setup.rest);
    let rest_places = place(&setup.grid, &setup.rest, &setup.rest);
    let mesh = Mesh { grid: &setup.grid, places: &places, rest_places: &rest_places };
    let (spans, inverted) = span(&mesh, warp.tets);
    let removed_spans = span_removed(&mesh, warp.removed);

    let slab = slices.start as u32..slices.end as u32;
    let mut state = SlabState::clear(slices.len() * setup.slice_voxels());
    claim(&mesh, &slab, warp.tets, &spans, warp.body_tets, &mut state);
    vacate(&mesh, &slab, warp.tets, &spans, &mut state);
    vacate(&mesh, &slab, warp.removed, &removed_spans, &mut state);
    gather(&mesh, &slab, warp.tets, volume, &mut state);
    (state, inverted)
}
