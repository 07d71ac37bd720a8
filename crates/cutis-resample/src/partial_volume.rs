//! Partial volume at the walls of wounds.
//!
//! A scanner averages over a voxel. A resampler that reads one point per voxel shows a smooth wall
//! as a flight of stairs. Here the voxels that a wall crosses take the mean over points within the
//! voxel instead.

use std::ops::Range;

use cutis_volume::Volume;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::raster::{Rasters, RestMaps, TetRaster, in_all_lanes};
use crate::sample::{scanned_range, stored_air, trilinear};
use crate::space::IndexSpace;
use crate::{ResampleError, Warp};

/// Number of points within a voxel: the bits of a mask.
const POINTS: usize = u64::BITS as usize;
/// Generators of the points, a rank-1 lattice. Both are odd, so that the points have 64 different
/// places along each axis, and a wall parallel to a face of the voxel divides them evenly.
const GENERATORS: [usize; 3] = [1, 41, 49];

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
    let blended = walls.blend(&voxels);
    let (slope, intercept) = (resampled.slope(), resampled.intercept());
    let mut values = resampled.into_voxels();
    for &(voxel, value) in &blended {
        values[voxel as usize] = value;
    }
    Ok((Volume::new(grid, values, slope, intercept)?, blended.len()))
}

/// The points relative to the center of a voxel, in voxels.
fn points() -> [Vector3<f64>; POINTS] {
    let level = |n: usize| ((n % POINTS) as f64 + 0.5) / POINTS as f64 - 0.5;
    std::array::from_fn(|n| Vector3::from(GENERATORS.map(|generator| level(n * generator))))
}

/// A volume, its warp, and the map between them.
struct Walls<'a> {
    volume: &'a Volume,
    warp: &'a Warp<'a>,
    space: &'a IndexSpace,
    shape: [usize; 3],
}

/// A voxel, as a position in a list, and a tet that may reach it.
type Pair = (u32, u32);

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

    /// The values of those voxels that walls cross.
    fn blend(&self, voxels: &[u64]) -> Vec<(u64, i16)> {
        let Self { volume, warp, shape, .. } = *self;
        let held = self.pairs(voxels, warp.deformed, warp.tets, &|tet| !self.has_burst(&warp.tets[tet]));
        let left = self.pairs(voxels, warp.rest, warp.tets, &|tet| warp.tet_moved(tet));
        let removed = self.pairs(voxels, warp.rest, warp.removed, &|_| true);
        let air = stored_air(volume);
        let scanned = scanned_range(volume, air);
        let points = points();
        let value_at =
            |place: Vector3<f64>| f64::from(trilinear(volume.voxels(), shape, scanned, place.into()));
        voxels
            .par_iter()
            .enumerate()
            .filter_map(|(at, &voxel)| {
                let place = Vector3::from(self.point(voxel)).map(|index| index as f64);
                let last = Vector3::from(shape).map(|length| (length - 1) as f64);
                let points = points.map(|point| (place + point).inf(&last).sup(&Vector3::zeros()));
                let (mut covered, mut sum) = (0_u64, 0.0);
                for &(_, tet) in of(&held, at) {
                    let vertices = &warp.tets[tet as usize];
                    let corners = self.corners(warp.deformed, vertices);
                    let rasters = Rasters::new(&in_all_lanes(&corners), self.space.tolerance);
                    let Some(raster) = rasters.tet(0) else { continue };
                    let own = self.inside(raster, &points) & !covered;
                    if own == 0 {
                        continue;
                    }
                    let moved = warp.tet_moved(tet as usize);
                    let at_rest = || in_all_lanes(&self.corners(warp.rest, vertices));
                    let map = moved.then(|| RestMaps::new(&rasters, &at_rest()));
                    for point in bits(own) {
                        let point = points[point];
                        sum += value_at(map.as_ref().map_or(point, |map| map.at(0, point.into()).into()));
                    }
                    covered |= own;
                    if covered == u64::MAX {
                        return None;
                    }
                }
                let mut empty = 0;
                for (pairs, tets) in [(&left, warp.tets), (&removed, warp.removed)] {
                    for &(_, tet) in of(pairs, at) {
                        let corners = self.corners(warp.rest, &tets[tet as usize]);
                        let rasters = Rasters::new(&in_all_lanes(&corners), self.space.tolerance);
                        if let Some(raster) = rasters.tet(0) {
                            empty |= self.inside(raster, &points) & !covered;
                        }
                    }
                }
                if empty == 0 {
                    return None;
                }
                sum += f64::from(empty.count_ones()) * f64::from(air);
                sum += bits(!(covered | empty)).map(|point| value_at(points[point])).sum::<f64>();
                Some((voxel, (sum / POINTS as f64).round() as i16))
            })
            .collect()
    }

    /// The tets that may reach each of some voxels, by voxel and tet in ascending order.
    fn pairs(
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
    fn has_burst(&self, tet: &[u32; 4]) -> bool {
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
    fn point(&self, voxel: u64) -> [usize; 3] {
        let (voxel, [columns, rows, _]) = (voxel as usize, self.shape);
        [voxel % columns, voxel / columns % rows, voxel / (columns * rows)]
    }

    fn corners(&self, positions: &[Point3<f32>], tet: &[u32; 4]) -> [Point3<f64>; 4] {
        tet.map(|v| self.space.index(positions[v as usize]))
    }

    /// The points in a tet, as bits.
    fn inside(&self, raster: TetRaster<'_>, points: &[Vector3<f64>; POINTS]) -> u64 {
        let mut held = u64::MAX;
        for corner in 0..4 {
            let (gradient, constant) = (raster.gradient_of(corner), raster.constant_of(corner));
            let lowest = -self.space.tolerance * gradient.norm();
            let mut bits = 0;
            for (n, point) in points.iter().enumerate() {
                bits |= u64::from(constant + gradient.dot(point) >= lowest) << n;
            }
            held &= bits;
            if held == 0 {
                break;
            }
        }
        held
    }
}

/// The pairs of one voxel.
fn of(pairs: &[Pair], voxel: usize) -> &[Pair] {
    let from = pairs.partition_point(|&(at, _)| (at as usize) < voxel);
    let count = pairs[from..].iter().take_while(|&&(at, _)| at as usize == voxel).count();
    &pairs[from..from + count]
}

/// The numbers of the bits that are set, in ascending order.
fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        bit
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_64_places_along_each_axis_and_halve_a_voxel_in_any_direction() {
        let points = points();
        for axis in 0..3 {
            let mut places: Vec<f64> = points.iter().map(|point| point[axis]).collect();
            places.sort_by(f64::total_cmp);
            places.windows(2).for_each(|pair| assert!((pair[1] - pair[0] - 1.0 / 64.0).abs() < 1e-12));
        }
        // Planes through a voxel: the share of the points on one side against that of a fine grid.
        let fine: Vec<Vector3<f64>> = (0..64_000)
            .map(|n| Vector3::new(n % 40, n / 40 % 40, n / 1600).map(|i| (i as f64 + 0.5) / 40.0 - 0.5))
            .collect();
        let share = |points: &[Vector3<f64>], normal: &Vector3<f64>, at: f64| {
            points.iter().filter(|p| p.dot(normal) < at).count() as f64 / points.len() as f64
        };
        let errors = |points: &[Vector3<f64>]| {
            let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0);
            for n in 0..100 {
                let z = f64::from(2 * n + 1) / 100.0 - 1.0;
                let (sin, cos) = (2.4 * f64::from(n)).sin_cos();
                let normal = Vector3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
                for at in [-0.4, -0.2, -0.05, 0.0, 0.1, 0.3] {
                    let error = share(points, &normal, at) - share(&fine, &normal, at);
                    worst = worst.max(error.abs());
                    squares += error * error;
                    count += 1;
                }
            }
            (worst, (squares / f64::from(count)).sqrt())
        };
        let (worst, mean) = errors(&points);
        assert!(worst < 0.12 && mean < 0.019, "worst {worst}, root mean square {mean}");
        let corner: Vec<_> = points.iter().map(|point| point * 0.8).collect();
        assert!(errors(&corner).1 > 0.025, "the control, points too near to the center");
    }

    #[test]
    fn bits_are_listed_in_ascending_order() {
        assert_eq!(bits(0b1010_0001).collect::<Vec<_>>(), [0, 5, 7]);
        assert_eq!(bits(0).count(), 0);
        assert_eq!(bits(u64::MAX).count(), 64);
    }
}
