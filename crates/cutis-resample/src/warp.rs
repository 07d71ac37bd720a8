//! The warp, its validation, and the resampling of a volume.

use cutis_volume::Volume;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::report::ResampleReport;
use crate::{ResampleError, Resampler};

/// Elements that a thread checks at once.
const PART: usize = 1 << 14;

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
            let largest = |part: &[u32]| part.iter().fold(0, |largest, &v| largest.max(v));
            let largest = tets.as_flattened().par_chunks(PART).map(largest).reduce(|| 0, u32::max);
            if largest as usize >= vertices
                && let Some(tet) = tets.iter().position(|c| c.iter().any(|&v| v as usize >= vertices))
            {
                return Err(ResampleError::VertexOutOfRange { which, tet, corners: tets[tet], vertices });
            }
        }
        Ok(())
    }
}

/// Checks that all positions are finite.
pub(crate) fn check_finite(which: &'static str, positions: &[Point3<f32>]) -> Result<(), ResampleError> {
    let finite = |p: &Point3<f32>| p.x.is_finite() & p.y.is_finite() & p.z.is_finite();
    let all = |part: &[Point3<f32>]| part.iter().fold(true, |all, p| all & finite(p));
    if positions.par_chunks(PART).all(all) {
        return Ok(());
    }
    match positions.iter().position(|p| !finite(p)) {
        None => Ok(()),
        Some(vertex) => {
            let position = positions[vertex].coords.map(f64::from).into();
            Err(ResampleError::NotFinite { which, vertex, position })
        }
    }
}

/// Resamples a volume through a warp, on the same grid.
///
/// `progress(done, total)` is called after each of `total` parts. The result does not depend on
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
    let mut resampler = Resampler::new(volume, warp)?;
    let report = resampler.update_with(warp.deformed, progress)?;
    Ok((resampler.into_volume()?, report))
}

/// Resamples the parts of a volume that `is_needed` names, as [`resample`] does, and leaves the
/// others as they are: see [`Resampler::only`].
///
/// # Errors
/// The errors of [`resample`].
pub fn resample_where(
    volume: &Volume,
    warp: &Warp<'_>,
    is_needed: &dyn Fn(Point3<f64>, f64) -> bool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Volume, ResampleReport), ResampleError> {
    let mut resampler = Resampler::new(volume, warp)?.only(is_needed);
    let report = resampler.update_with(warp.deformed, progress)?;
    Ok((resampler.into_volume()?, report))
}
