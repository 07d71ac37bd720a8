//! The resampling kernels in plain scalar `f32`: same names, same order of arguments, same
//! operations.
//!
//! On an adapter that does not fuse products and sums (every software adapter) the results are
//! equal bit for bit. This crate is slow and serial. Parity tests compare [`resample_slab`] and
//! [`resample`] with the kernels.
#![cfg(feature = "gpu")]

mod gather;
mod passes;
mod tet;

use std::ops::Range;

use cutis_resample::{ResampleError, ResampleReport, ResamplerOptions, Setup, SlabState, Warp};
use cutis_volume::Volume;

use gather::gather;
use passes::{Mesh, claim, place, span, span_removed, vacate};

/// Does the same as [`resample_gpu`](cutis_resample::resample_gpu).
///
/// # Errors
/// The errors of [`Setup::new`].
pub fn resample(
    volume: &Volume,
    warp: &Warp<'_>,
    options: &ResamplerOptions,
) -> Result<(Volume, ResampleReport), ResampleError> {
    let (state, inverted_tets) = fill(volume, warp, options, 0..volume.grid().shape[2])?;
    let report = ResampleReport { inverted_tets, ..state.report() };
    let volume = Volume::new(*volume.grid(), state.values, volume.slope(), volume.intercept())?;
    Ok((volume, report))
}

/// The state of a slab after all passes over it.
///
/// # Errors
/// The errors of [`Setup::new`].
///
/// # Panics
/// If there are no `slices`, or if they are outside the volume.
pub fn resample_slab(
    volume: &Volume,
    warp: &Warp<'_>,
    options: &ResamplerOptions,
    slices: Range<usize>,
) -> Result<SlabState, ResampleError> {
    assert!(!slices.is_empty() && slices.end <= volume.grid().shape[2], "slices {slices:?}");
    Ok(fill(volume, warp, options, slices)?.0)
}

/// The state of a slab, and the number of inverted tets of the whole mesh.
fn fill(
    volume: &Volume,
    warp: &Warp<'_>,
    options: &ResamplerOptions,
    slices: Range<usize>,
) -> Result<(SlabState, usize), ResampleError> {
    let setup = Setup::new(volume, warp, options)?;
    let places = place(&setup.grid, &setup.positions(warp.deformed), &setup.rest);
    let rest_places = place(&setup.grid, &setup.rest, &setup.rest);
    let mesh = Mesh { grid: &setup.grid, places: &places, rest_places: &rest_places };
    let (spans, inverted) = span(&mesh, warp.tets);
    let removed_spans = span_removed(&mesh, warp.removed);

    let [columns, rows, _] = volume.grid().shape;
    let slab = slices.start as u32..slices.end as u32;
    let mut state = SlabState::clear(slices.len() * columns * rows);
    claim(&mesh, &slab, warp.tets, &spans, warp.body_tets, &mut state);
    vacate(&mesh, &slab, warp.tets, &spans, &mut state);
    vacate(&mesh, &slab, warp.removed, &removed_spans, &mut state);
    gather(&mesh, &slab, warp.tets, volume, &mut state);
    Ok((state, inverted))
}

/// Index of a word of the marks.
fn word(state: &SlabState, plane: usize, voxel: usize) -> usize {
    plane * state.owners.len().div_ceil(32) + voxel / 32
}

/// Sets a voxel's bit in a plane of the marks. Returns true if it was not set before.
fn mark(state: &mut SlabState, plane: usize, voxel: usize) -> bool {
    let (word, bit) = (word(state, plane, voxel), 1 << (voxel % 32));
    let before = state.marks[word];
    state.marks[word] = before | bit;
    before & bit == 0
}

/// True if a voxel's bit is set in a plane of the marks.
fn is_marked(state: &SlabState, plane: usize, voxel: usize) -> bool {
    state.marks[word(state, plane, voxel)] >> (voxel % 32) & 1 == 1
}
