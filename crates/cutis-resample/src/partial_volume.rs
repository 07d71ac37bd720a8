//! Partial volume at the walls of wounds.
//!
//! A scanner averages over a voxel. A resampler that reads one point per voxel shows a smooth wall
//! as a flight of stairs. Here the voxels that a wall crosses take the mean over points within the
//! voxel instead.

use std::ops::Range;

use cutis_volume::Volume;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::space::IndexSpace;
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
    let voxels = if moved { walls.voxels_at(at_walls) } else { Vec::new() };
    if voxels.is_empty() {
        return Ok((resampled, 0));
    }
    let blended = WallMeans::new(&walls, &voxels).values(&voxels);
    let (slope, intercept) = (resampled.slope(), resampled.intercept());
    let mut values = resampled.into_voxels();
    for &(voxel, value) in &blended {
        values[voxel as usize] = value;
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

/// A voxel, as a position in a list, and a tet that may reach it.
pub type Pair = (u32, u32);

impl Walls<'_> {
    /// The voxels that some tets reach, in ascending order.
    fn voxels_at(&self, tets: &[u32]) -> Vec<u64> {
        let mut voxels: Vec<u64> = tets
            .par_iter()
            .filter(|tet| !self.has_burst(&self.warp.tets[**tet as usize]))
            .flat_map_iter(|&tet| {
                let mut found = Vec::new();
                self.rows(&self.corners(self.warp.deformed, &self.warp.tets[tet as usize]), |first, end| {
                    found.extend(first..end);
                });
                found
            })
            .collect();
        voxels.par_sort_unstable();
        voxels.dedup();
        voxels
    }

    /// The tets that may reach each of some voxels, by voxel and tet in ascending order.
    pub fn pairs(
        &self,
        voxels: &[u64],
        positions: &[Point3<f32>],
        tets: &[[u32; 4]],
        counts: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<Pair> {
        let slice = (self.shape[0] * self.shape[1]) as u64;
        let [first, last] = [voxels[0], voxels[voxels.len() - 1]].map(|voxel| (voxel / slice) as f64);
        let mut pairs: Vec<Pair> = tets
            .par_iter()
            .enumerate()
            .filter(|(_, tet)| {
                let slices = tet.map(|v| self.space.slice(positions[v as usize]));
                slices.iter().any(|&z| z >= first - 1.0) && slices.iter().any(|&z| z <= last + 1.0)
            })
            .filter(|(tet, _)| counts(*tet))
            .flat_map_iter(|(tet, vertices)| {
                let mut found = Vec::new();
                self.rows(&self.corners(positions, vertices), |first, end| {
                    let from = voxels.partition_point(|&voxel| voxel < first);
                    let listed = voxels[from..].iter().take_while(|&&voxel| voxel < end);
                    found.extend(listed.enumerate().map(|(n, _)| ((from + n) as u32, tet as u32)));
                });
                found
            })
            .collect();
        pairs.par_sort_unstable();
        pairs
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
    fn spans(&self, corners: &[Point3<f64>; 4]) -> [Range<usize>; 3] {
        std::array::from_fn(|axis| {
            let values = corners.map(|corner| corner[axis]);
            let low = values.into_iter().fold(f64::INFINITY, f64::min);
            let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let end = self.shape[axis] as f64;
            let first = (low - 0.5).ceil().clamp(0.0, end) as usize;
            first..((high + 0.5).floor() + 1.0).clamp(0.0, end) as usize
        })
    }

    /// Calls `visit(first, end)` for each row of the voxels of [`spans`](Self::spans).
    fn rows(&self, corners: &[Point3<f64>; 4], mut visit: impl FnMut(u64, u64)) {
        let [columns, rows, _] = self.shape;
        let [along, across, slices] = self.spans(corners);
        if along.is_empty() {
            return;
        }
        for k in slices {
            for j in across.clone() {
                let row = ((k * rows + j) * columns) as u64;
                visit(row + along.start as u64, row + along.end as u64);
            }
        }
    }

    /// Column, row and slice of a voxel.
    pub fn point(&self, voxel: u64) -> [usize; 3] {
        let (voxel, [columns, rows, _]) = (voxel as usize, self.shape);
        [voxel % columns, voxel / columns % rows, voxel / (columns * rows)]
    }

    pub fn corners(&self, positions: &[Point3<f32>], tet: &[u32; 4]) -> [Point3<f64>; 4] {
        tet.map(|v| self.space.index(positions[v as usize]))
    }
}
