//! Partial volume at the walls of wounds.
//!
//! A scanner averages over a voxel. A resampler that reads one point per voxel shows a smooth wall
//! as a flight of stairs. Here the voxels that a wall crosses take the mean over points within the
//! voxel instead.

use cutis_volume::Volume;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::space::IndexSpace;
use crate::voxel_set::{Spans, VoxelSet};
use crate::wall_means::WallMeans;
use crate::{ResampleError, Warp};

/// How many times the voxels of its rest box the deformed box of a tet may have.
const LARGEST_GROWTH: u64 = 16;

/// Gives the voxels that walls cross their mean over 64 points, and returns how many there were.
///
/// `resampled` is the result of resampling `volume` through `warp`, on the CPU or a GPU. `at_walls`
/// are the tets next to walls, as indices into [`Warp::tets`]. Only voxels that such a tet reaches
/// can change, and none if no such tet has moved. A point in a deformed tet counts as tissue with
/// the value at its rest position, a point that the body has left as air, and any other point with
/// the input's value there. A voxel without a point that the body has left is not crossed by a wall
/// and keeps its value.
///
/// A tet is left out if the box around it has more than 16 times the voxels that it has at rest.
/// Such a tet belongs to a run that has diverged, and lists of the voxels that it reaches would not
/// fit in memory.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// The errors of [`resample`](crate::resample), [`ResampleError::NoSuchTet`] for an index in
/// `at_walls` that is out of range, and [`ResampleError::OtherGrid`] if the two volumes have
/// different grids.
pub fn blend_walls(
    volume: &Volume,
    warp: &Warp<'_>,
    at_walls: &[u32],
    resampled: Volume,
) -> Result<(Volume, usize), ResampleError> {
    warp.validate()?;
    let tets = warp.tets.len();
    if let Some(&tet) = at_walls.iter().find(|&&tet| tet as usize >= tets) {
        return Err(ResampleError::NoSuchTet { tet, tets });
    }
    let grid = *volume.grid();
    if *resampled.grid() != grid {
        return Err(ResampleError::OtherGrid { expected: grid.shape, found: resampled.grid().shape });
    }
    let space = IndexSpace::new(&grid.affine, warp.origin_mm, [warp.rest, warp.deformed]);
    let walls = Walls { volume, warp, space: &space, shape: grid.shape };
    let moved = at_walls.par_iter().any(|&tet| warp.tet_moved(tet as usize));
    let Some(voxels) = moved.then(|| walls.voxels_at(at_walls)).flatten() else { return Ok((resampled, 0)) };
    let blended = WallMeans::new(&walls, &voxels).values();
    let (slope, intercept) = (resampled.slope(), resampled.intercept());
    let mut values = resampled.into_voxels();
    for &(voxel, value) in &blended {
        values[voxel] = value;
    }
    Ok((Volume::new(grid, values, slope, intercept)?, blended.len()))
}

/// A volume, its warp, and the map between them.
pub struct Walls<'a> {
    pub volume: &'a Volume,
    pub warp: &'a Warp<'a>,
    pub space: &'a IndexSpace,
    pub shape: [usize; 3],
}

impl Walls<'_> {
    /// The voxels whose cubes touch the boxes around some tets. `None` if there are none.
    fn voxels_at(&self, tets: &[u32]) -> Option<VoxelSet> {
        let tets =
            tets.par_iter().map(|&tet| &self.warp.tets[tet as usize]).filter(|tet| !self.has_burst(tet));
        let boxes: Vec<_> = tets.map(|tet| self.spans(&self.corners(self.warp.deformed, tet))).collect();
        VoxelSet::new(&boxes)
    }

    /// Whether the box around a deformed tet has too many voxels to list them.
    pub fn has_burst(&self, tet: &[u32; 4]) -> bool {
        let [rest, deformed] = [self.warp.rest, self.warp.deformed].map(|positions| {
            let spans = self.spans(&self.corners(positions, tet));
            spans.iter().map(|span| span.len() as u64).product::<u64>()
        });
        deformed > LARGEST_GROWTH * rest.max(1)
    }

    /// The columns, rows and slices of the voxels whose cubes touch the box around a tet.
    pub fn spans(&self, corners: &[Point3<f64>; 4]) -> Spans {
        std::array::from_fn(|axis| {
            let values = corners.map(|corner| corner[axis]);
            let low = values.into_iter().fold(f64::INFINITY, f64::min);
            let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let end = self.shape[axis] as f64;
            let first = (low - 0.5).ceil().clamp(0.0, end) as usize;
            first..((high + 0.5).floor() + 1.0).clamp(0.0, end) as usize
        })
    }

    pub fn corners(&self, positions: &[Point3<f32>], tet: &[u32; 4]) -> [Point3<f64>; 4] {
        tet.map(|v| self.space.index(positions[v as usize]))
    }
}
