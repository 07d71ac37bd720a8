//! Applies the filter one axis after the other, first within slices, then across them.

use rayon::prelude::*;

use super::{Axis, Stop};
use crate::{AIR_HU, Volume};

/// The voxels that contribute to a lattice point, with weights that sum to 1. Empty outside the
/// volume.
struct Taps {
    first: usize,
    weights: Vec<f32>,
}

/// HU at every combination of stops of the three axes.
pub(super) fn sample(volume: &Volume, axes: [Axis; 3], stops: &[Vec<Stop>; 3]) -> Vec<f32> {
    let along = |a: usize| stops[a].iter().map(|&stop| taps(axes[a], stop)).collect::<Vec<_>>();
    let [x, y, z] = [along(0), along(1), along(2)];
    let slice_len = x.len() * y.len();
    if slice_len == 0 {
        return Vec::new();
    }
    // Each slice is filtered once, when the first batch needs it. Only the slices of one batch are
    // in memory.
    let mut out = vec![0.0; slice_len * z.len()];
    let threads = rayon::current_num_threads().max(1);
    let mut filtered = Window { first: 0, slices: Vec::new() };
    for (batch, z) in out.chunks_mut(slice_len * threads).zip(z.chunks(threads)) {
        let used = z.iter().filter(|taps| !taps.weights.is_empty());
        let begin = used.clone().map(|taps| taps.first).min();
        let end = used.map(|taps| taps.first + taps.weights.len()).max();
        if let (Some(begin), Some(end)) = (begin, end) {
            filtered.advance(begin, end, |k| filter_slice(volume, k, &x, &y));
        }
        batch.par_chunks_mut(slice_len).zip(z).for_each(|(slice, taps)| filtered.mix(taps, slice));
    }
    out
}

/// Consecutive filtered slices that start with slice `first`.
struct Window {
    first: usize,
    slices: Vec<Vec<f32>>,
}

impl Window {
    /// Moves the window to the slices `begin .. end`: keeps those it has and computes the others.
    fn advance(&mut self, begin: usize, end: usize, compute: impl Fn(usize) -> Vec<f32> + Sync) {
        let kept = self.first..self.first + self.slices.len();
        let old = std::mem::take(&mut self.slices);
        let mut old: Vec<Option<Vec<f32>>> = old.into_iter().map(Some).collect();
        let slices = (begin..end).map(|k| if kept.contains(&k) { old[k - kept.start].take() } else { None });
        let slices: Vec<Option<Vec<f32>>> = slices.collect();
        self.first = begin;
        self.slices = slices
            .into_par_iter()
            .enumerate()
            .map(|(n, slice)| slice.unwrap_or_else(|| compute(begin + n)))
            .collect();
    }

    /// Weighted sum of slices. It is computed as a base plus differences, so that a uniform volume
    /// stays exactly uniform.
    fn mix(&self, taps: &Taps, out: &mut [f32]) {
        let Some((_, rest)) = taps.weights.split_first() else {
            return out.fill(AIR_HU);
        };
        let base = &self.slices[taps.first - self.first];
        out.copy_from_slice(base);
        for (n, weight) in rest.iter().enumerate() {
            let slice = &self.slices[taps.first + n + 1 - self.first];
            out.iter_mut()
                .zip(slice.iter().zip(base))
                .for_each(|(sum, (hu, base))| *sum += weight * (hu - base));
        }
    }
}

/// Filters slice `k` of the volume along the first two axes.
fn filter_slice(volume: &Volume, k: usize, x: &[Taps], y: &[Taps]) -> Vec<f32> {
    let [nx, ny, _] = volume.grid().shape;
    let slice = &volume.voxels()[k * nx * ny..(k + 1) * nx * ny];
    let hu = |stored: i16| volume.hu(stored).max(AIR_HU);
    let mut rows = Vec::with_capacity(x.len() * ny);
    let mut row_hu = vec![0.0; nx];
    for row in slice.chunks_exact(nx) {
        row_hu.iter_mut().zip(row).for_each(|(hu_at, &stored)| *hu_at = hu(stored));
        rows.extend(x.iter().map(|taps| match taps.weights.split_first() {
            None => AIR_HU,
            Some((_, rest)) => {
                let (base, others) = (row_hu[taps.first], &row_hu[taps.first + 1..]);
                rest.iter().zip(others).fold(base, |sum, (weight, hu)| sum + weight * (hu - base))
            }
        }));
    }
    let mut out = vec![0.0; x.len() * y.len()];
    let rows = Window { first: 0, slices: rows.chunks(x.len()).map(<[f32]>::to_vec).collect() };
    out.chunks_mut(x.len()).zip(y).for_each(|(row, taps)| rows.mix(taps, row));
    out
}

/// The voxels and weights of the tent around a stop.
fn taps(axis: Axis, stop: Stop) -> Taps {
    let center = axis.start + stop.at * axis.step;
    let last = (axis.voxels - 1) as f64;
    // The last voxel reaches half a voxel beyond its center.
    if !(-0.5..=last + 0.5).contains(&center) {
        return Taps { first: 0, weights: Vec::new() };
    }
    let center = center.clamp(0.0, last);
    let radius = (stop.reach * axis.step).abs().max(1.0);
    let first = (center - radius).floor().max(0.0) as usize;
    let end = (center + radius).ceil().min(last) as usize;
    let weight = |voxel: usize| (1.0 - (voxel as f64 - center).abs() / radius).max(0.0);
    let used: Vec<usize> = (first..=end).filter(|&voxel| weight(voxel) > 0.0).collect();
    let sum: f64 = used.iter().map(|&voxel| weight(voxel)).sum();
    Taps { first: used[0], weights: used.iter().map(|&voxel| (weight(voxel) / sum) as f32).collect() }
}
