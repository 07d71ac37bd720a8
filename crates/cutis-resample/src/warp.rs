//! The warp, its validation, and the resampling of a whole volume or of a box of it.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use cutis_volume::{Affine, Grid, Volume};
use nalgebra::Point3;
use rayon::prelude::*;

use crate::ResampleError;
use crate::buckets::Buckets;
use crate::report::ResampleReport;
use crate::sample::{scanned_range, stored_air};
use crate::slab::{Slab, Source};
use crate::space::IndexSpace;

/// Slices per slab. The result does not depend on it; thinner slabs meet more tets twice.
const SLAB: usize = 16;

/// A deformed tetrahedral mesh. Positions are local meters: `world_mm = origin_mm + 1000 · local`.
#[derive(Clone, Copy, Debug)]
pub struct Warp<'a> {
    /// World position of the mesh's local origin, mm, RAS+.
    pub origin_mm: Point3<f64>,
    /// Rest positions, local meters, one per vertex.
    pub rest: &'a [Point3<f32>],
    /// Deformed positions, local meters, one per vertex.
    pub deformed: &'a [Point3<f32>],
    /// Corners of the tets: those of the body first, then those of a shell that carries the air around it.
    pub tets: &'a [[u32; 4]],
    /// How many of `tets` are the body's.
    pub body_tets: usize,
    /// Tets that were cut away: they exist at rest only, and leave air.
    pub removed: &'a [[u32; 4]],
}

impl Warp<'_> {
    /// True if a corner of the tet is not where it was, down to the last bit.
    #[inline]
    pub(crate) fn tet_moved(&self, tet: usize) -> bool {
        self.tets[tet].iter().any(|&v| self.rest[v as usize] != self.deformed[v as usize])
    }

    pub(crate) fn validate(&self) -> Result<(), ResampleError> {
        let vertices = self.rest.len();
        if vertices != self.deformed.len() {
            return Err(ResampleError::VertexCount { rest: vertices, deformed: self.deformed.len() });
        }
        if self.body_tets > self.tets.len() {
            return Err(ResampleError::BodyTets { body_tets: self.body_tets, tets: self.tets.len() });
        }
        if !self.origin_mm.iter().all(|c| c.is_finite()) {
            return Err(ResampleError::NotFinite {
                which: "origin",
                vertex: 0,
                position: self.origin_mm.coords.into(),
            });
        }
        check_finite("rest", self.rest)?;
        check_finite("deformed", self.deformed)?;
        for (which, tets) in [("tets", self.tets), ("removed", self.removed)] {
            let limit = u32::MAX as usize;
            if tets.len() > limit {
                return Err(ResampleError::TooManyTets { tets: tets.len(), limit });
            }
            let outside = |corners: &[u32; 4]| corners.iter().any(|&v| v as usize >= vertices);
            if let Some(tet) = tets.par_iter().position_first(outside) {
                return Err(ResampleError::VertexOutOfRange { which, tet, corners: tets[tet], vertices });
            }
        }
        Ok(())
    }
}

/// Refuses positions that are NaN or infinite.
pub(crate) fn check_finite(which: &'static str, positions: &[Point3<f32>]) -> Result<(), ResampleError> {
    let finite = |p: &Point3<f32>| p.iter().all(|c| c.is_finite());
    match positions.par_iter().position_first(|p| !finite(p)) {
        None => Ok(()),
        Some(vertex) => {
            let position = positions[vertex].coords.map(f64::from).into();
            Err(ResampleError::NotFinite { which, vertex, position })
        }
    }
}

/// The volume as the warp deforms it, on the same grid; `progress(done, total)` is called after each slab.
///
/// # Errors
/// [`ResampleError`] for positions that are not finite, vertices out of range, and counts that do not fit together.
pub fn resample(
    volume: &Volume,
    warp: &Warp<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Volume, ResampleReport), ResampleError> {
    let [nx, ny, nz] = volume.grid().shape;
    resample_region(volume, warp, [0..nx, 0..ny, 0..nz], progress)
}

/// The deformed volume in a box of voxels only, as for a picture or a slice. The result has the box's own grid, and the same
/// voxels as the box has in [`resample`].
///
/// # Errors
/// As [`resample`], and [`ResampleError::Region`] if the box is empty or leaves the volume.
pub fn resample_region(
    volume: &Volume,
    warp: &Warp<'_>,
    region: [Range<usize>; 3],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Volume, ResampleReport), ResampleError> {
    resample_in_slabs(volume, warp, region, SLAB, progress)
}

fn resample_in_slabs(
    volume: &Volume,
    warp: &Warp<'_>,
    region: [Range<usize>; 3],
    slab_slices: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Volume, ResampleReport), ResampleError> {
    warp.validate()?;
    let grid = sub_grid(volume.grid(), &region)?;
    let space = IndexSpace::new(&volume.grid().affine, warp.origin_mm, [warp.rest, warp.deformed]);
    let air = stored_air(volume);
    let source = Source {
        warp,
        space: &space,
        voxels: volume.voxels(),
        shape: volume.grid().shape,
        air,
        scanned: scanned_range(volume, air),
    };
    let slices = region[2].clone();
    let slabs = slices.len().div_ceil(slab_slices);
    let touched = |positions: &[Point3<f32>], tet: &[u32; 4]| {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &v in tet {
            let z = space.slice(positions[v as usize]);
            low = if z < low { z } else { low };
            high = if z > high { z } else { high };
        }
        let (low, high) = (low - space.tolerance, high + space.tolerance);
        let (first, end) = (slices.start as f64, slices.end as f64);
        if high < first || low >= end {
            return 0..0;
        }
        let slab = |z: f64| ((z.clamp(first, end - 1.0) - first) as usize) / slab_slices;
        slab(low)..slab(high) + 1
    };
    let deformed = Buckets::new(warp.tets.len(), slabs, |tet| touched(warp.deformed, &warp.tets[tet]));
    let left = Buckets::new(warp.tets.len(), slabs, |tet| {
        if warp.tet_moved(tet) { touched(warp.rest, &warp.tets[tet]) } else { 0..0 }
    });
    let removed = Buckets::new(warp.removed.len(), slabs, |tet| touched(warp.rest, &warp.removed[tet]));

    let mut values = crop(volume, &region);
    let done = AtomicUsize::new(0);
    let slab_len = region[0].len() * region[1].len() * slab_slices;
    let report = values
        .par_chunks_mut(slab_len)
        .enumerate()
        .map(|(slab, values)| {
            let start = slices.start + slab * slab_slices;
            let end = slices.end.min(start + slab_slices);
            let mut filled = Slab::new(&source, [region[0].clone(), region[1].clone(), start..end], values);
            deformed.slab(slab).for_each(|tet| filled.deform(tet));
            left.slab(slab).for_each(|tet| filled.vacate(warp.tets[tet]));
            removed.slab(slab).for_each(|tet| filled.vacate(warp.removed[tet]));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, slabs);
            filled.report()
        })
        .reduce(ResampleReport::default, |a, b| a + b);
    let report = ResampleReport { inverted_tets: inverted_tets(warp), ..report };
    Ok((Volume::new(grid, values, volume.slope(), volume.intercept())?, report))
}

/// Tets whose volume changed its sign or vanished.
fn inverted_tets(warp: &Warp<'_>) -> usize {
    let volume = |positions: &[Point3<f32>], tet: usize| {
        let [a, b, c, d] = warp.tets[tet].map(|v| positions[v as usize].map(f64::from));
        (b - a).dot(&(c - a).cross(&(d - a)))
    };
    let inverted = |&tet: &usize| {
        warp.tet_moved(tet) && volume(warp.deformed, tet) * volume(warp.rest, tet).signum() <= 0.0
    };
    (0..warp.tets.len()).into_par_iter().filter(inverted).count()
}

/// The grid of a box of voxels.
pub(crate) fn sub_grid(grid: &Grid, region: &[Range<usize>; 3]) -> Result<Grid, ResampleError> {
    let start = region.each_ref().map(|range| range.start);
    let end = region.each_ref().map(|range| range.end);
    let shape = grid.shape;
    if (0..3).any(|axis| start[axis] >= end[axis] || end[axis] > shape[axis]) {
        return Err(ResampleError::Region { start, end, shape });
    }
    if start == [0; 3] {
        return Ok(Grid { shape: end, affine: grid.affine });
    }
    let origin = grid.mm(start);
    let mut rows = grid.affine.rows();
    for axis in 0..3 {
        rows[axis][3] = origin[axis];
    }
    let shape = std::array::from_fn(|axis| end[axis] - start[axis]);
    Ok(Grid { shape, affine: Affine::from_rows(rows)? })
}

/// The input's voxels in the region.
fn crop(volume: &Volume, region: &[Range<usize>; 3]) -> Vec<i16> {
    let [columns, rows, slices] = region.clone();
    let mut values = vec![0; columns.len() * rows.len() * slices.len()];
    values.par_chunks_mut(columns.len()).enumerate().for_each(|(row, out)| {
        let (j, k) = (rows.start + row % rows.len(), slices.start + row / rows.len());
        let from = volume.grid().index([columns.start, j, k]);
        out.copy_from_slice(&volume.voxels()[from..from + columns.len()]);
    });
    values
}
