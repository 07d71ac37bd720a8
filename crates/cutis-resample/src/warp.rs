//! The warp, its validation, and the resampling of a volume.

use std::sync::atomic::{AtomicUsize, Ordering};

use cutis_volume::Volume;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::ResampleError;
use crate::buckets::Buckets;
use crate::report::ResampleReport;
use crate::sample::{scanned_range, stored_air};
use crate::slab::{Slab, Source};
use crate::space::IndexSpace;

/// Slices per slab. The result does not depend on it. With thinner slabs more tets are in two
/// slabs.
const SLAB: usize = 16;

/// A deformed tetrahedral mesh. Positions are in local meters: `world_mm = origin_mm + 1000 ·
/// local`.
#[derive(Clone, Copy, Debug)]
pub struct Warp<'a> {
    /// World position of the mesh's local origin, mm, RAS+.
    pub origin_mm: Point3<f64>,
    /// Rest positions in local meters, one per vertex.
    pub rest: &'a [Point3<f32>],
    /// Deformed positions in local meters, one per vertex.
    pub deformed: &'a [Point3<f32>],
    /// Corners of the tets: first those of the body, then those of a shell that moves the air
    /// around it.
    pub tets: &'a [[u32; 4]],
    /// Number of `tets` that belong to the body.
    pub body_tets: usize,
    /// Tets that were cut away. They exist at rest only and leave air.
    pub removed: &'a [[u32; 4]],
}

impl Warp<'_> {
    /// True if a corner of the tet has moved by any amount.
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

/// Checks that all positions are finite.
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

/// Resamples a volume through a warp, on the same grid.
///
/// `progress(done, total)` is called after each of the `total` slabs. The result does not depend on
/// the number of threads.
///
/// # Errors
/// [`ResampleError::VertexCount`], [`ResampleError::BodyTets`], [`ResampleError::NotFinite`],
/// [`ResampleError::TooManyTets`], [`ResampleError::VertexOutOfRange`].
pub fn resample(
    volume: &Volume,
    warp: &Warp<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Volume, ResampleReport), ResampleError> {
    warp.validate()?;
    let grid = *volume.grid();
    let space = IndexSpace::new(&grid.affine, warp.origin_mm, [warp.rest, warp.deformed]);
    let air = stored_air(volume);
    let source = Source {
        warp,
        space: &space,
        voxels: volume.voxels(),
        shape: grid.shape,
        air,
        scanned: scanned_range(volume, air),
    };
    let [columns, rows, slices] = grid.shape;
    let slabs = slices.div_ceil(SLAB);
    let slabs_of = |positions: &[Point3<f32>], tet: &[u32; 4]| {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &v in tet {
            let z = space.slice(positions[v as usize]);
            low = if z < low { z } else { low };
            high = if z > high { z } else { high };
        }
        let (low, high) = (low - space.tolerance, high + space.tolerance);
        let end = slices as f64;
        if high < 0.0 || low >= end {
            return 0..0;
        }
        let slab = |z: f64| (z.clamp(0.0, end - 1.0) as usize) / SLAB;
        slab(low)..slab(high) + 1
    };
    let deformed = Buckets::new(warp.tets.len(), slabs, |tet| slabs_of(warp.deformed, &warp.tets[tet]));
    let left = Buckets::new(warp.tets.len(), slabs, |tet| {
        if warp.tet_moved(tet) { slabs_of(warp.rest, &warp.tets[tet]) } else { 0..0 }
    });
    let removed = Buckets::new(warp.removed.len(), slabs, |tet| slabs_of(warp.rest, &warp.removed[tet]));

    let mut values = volume.voxels().to_vec();
    let done = AtomicUsize::new(0);
    let report = values
        .par_chunks_mut(columns * rows * SLAB)
        .enumerate()
        .map(|(number, values)| {
            let start = number * SLAB;
            let mut slab = Slab::new(&source, start..slices.min(start + SLAB), values);
            deformed.slab(number).for_each(|tet| slab.deform(tet));
            left.slab(number).for_each(|tet| slab.vacate(warp.tets[tet]));
            removed.slab(number).for_each(|tet| slab.vacate(warp.removed[tet]));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, slabs);
            slab.report()
        })
        .reduce(ResampleReport::default, |a, b| a + b);
    let report = ResampleReport { inverted_tets: inverted_tets(warp), ..report };
    Ok((Volume::new(grid, values, volume.slope(), volume.intercept())?, report))
}

/// Number of tets whose volume changed its sign or vanished.
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
