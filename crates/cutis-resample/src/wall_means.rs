//! The mean over points within each voxel that a wall crosses.

use cutis_constraints::{LaneTask, Lanes, Scalar, SimdLevel};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::partial_volume::Walls;
use crate::raster::{GROUP, RestMaps, TetRaster};
use crate::reaching::{Reaching, half_cube};
use crate::sample::{scanned_range, stored_air, trilinear};
use crate::voxel_set::{VoxelSet, bits};

/// Number of points within a voxel: the bits of a mask.
const POINTS: usize = u64::BITS as usize;
/// Generators of the points, a rank-1 lattice. Both are odd, so that the points have 64 different
/// places along each axis, and a wall parallel to a face of the voxel divides them evenly.
const GENERATORS: [usize; 3] = [1, 41, 49];

/// Voxels that a thread takes at once.
const PART: usize = 256;

/// Points in continuous voxel indices, by axis.
type Places = [[f64; POINTS]; 3];

/// What the means of some voxels need.
pub struct WallMeans<'a> {
    walls: &'a Walls<'a>,
    /// Column, row and slice of each voxel.
    voxels: Vec<[usize; 3]>,
    /// The deformed tets, and their maps to the rest shapes.
    held: Reaching,
    to_rest: Vec<RestMaps>,
    /// Whether each deformed tet has moved.
    is_moved: Vec<bool>,
    /// The tets at rest that moved, and those that were removed.
    left: [Reaching; 2],
    air: i16,
    scanned: [i16; 2],
    points: [Vector3<f64>; POINTS],
}

impl<'a> WallMeans<'a> {
    /// Prepares the tets that may reach the voxels.
    pub fn new(walls: &'a Walls<'a>, set: &VoxelSet) -> Self {
        let Walls { volume, warp, .. } = *walls;
        let reaching = |positions, tets, counts: &(dyn Fn(usize) -> bool + Sync)| {
            Reaching::new(walls, set, positions, tets, counts)
        };
        let (held, moved) = rayon::join(
            || reaching(warp.deformed, warp.tets, &|tet| !walls.has_burst(&warp.tets[tet])),
            || reaching(warp.rest, warp.tets, &|tet| warp.tet_moved(tet)),
        );
        let removed = reaching(warp.rest, warp.removed, &|_| true);
        let air = stored_air(volume);
        Self {
            walls,
            to_rest: held.tets.rest_maps(&|tet| walls.corners(warp.rest, &warp.tets[tet as usize])),
            is_moved: held.tets.numbers().iter().map(|&tet| warp.tet_moved(tet as usize)).collect(),
            held,
            left: [moved, removed],
            air,
            scanned: scanned_range(volume, air),
            points: points(),
            voxels: set.voxels().collect(),
        }
    }

    /// The voxels that walls cross, as indices into the volume, and their new values.
    pub fn values(&self) -> Vec<(usize, i16)> {
        let level = SimdLevel::best();
        let parts = self.voxels.par_chunks(PART).enumerate().flat_map_iter(|(part, voxels)| {
            let mut found = Vec::new();
            f32::in_lanes(level, Part { means: self, first: part * PART, voxels, found: &mut found });
            found
        });
        parts.collect()
    }

    /// The new value of a voxel. `None` if no wall crosses it. `at` is its place in the list.
    /// `owners` is memory.
    #[inline(always)]
    fn value(&self, at: usize, voxel: [usize; 3], owners: &mut Vec<(usize, u64)>) -> Option<i16> {
        let center = voxel.map(|index| index as f64);
        let mut places = [[0.0; POINTS]; 3];
        for axis in 0..3 {
            let last = (self.walls.shape[axis] - 1) as f64;
            for n in 0..POINTS {
                places[axis][n] = (center[axis] + self.points[n][axis]).min(last).max(0.0);
            }
        }
        let center = Vector3::from(center);
        let mut covered = 0_u64;
        owners.clear();
        for &slot in self.held.of(at) {
            let slot = slot as usize;
            let Some(raster) = self.held.tets.raster(slot) else { continue };
            let own = self.inside(raster, &center, &places) & !covered;
            if own != 0 {
                owners.push((slot, own));
                covered |= own;
            }
            if covered == u64::MAX {
                return None;
            }
        }
        let mut empty = 0;
        for left in &self.left {
            for &slot in left.of(at) {
                if let Some(raster) = left.tets.raster(slot as usize) {
                    empty |= self.inside(raster, &center, &places) & !covered;
                }
            }
        }
        if empty == 0 {
            return None;
        }
        let place = |n: usize| [places[0][n], places[1][n], places[2][n]];
        let mut sum = 0.0;
        for &(slot, own) in &*owners {
            for point in bits(own).map(place) {
                sum += self.sample(if self.is_moved[slot] {
                    self.to_rest[slot / GROUP].at(slot % GROUP, point)
                } else {
                    point
                });
            }
        }
        sum += f64::from(empty.count_ones()) * f64::from(self.air);
        sum += bits(!(covered | empty)).map(|n| self.sample(place(n))).sum::<f64>();
        Some((sum / POINTS as f64).round() as i16)
    }

    /// The input's value at a place.
    fn sample(&self, place: [f64; 3]) -> f64 {
        f64::from(trilinear(self.walls.volume.voxels(), self.walls.shape, self.scanned, place))
    }

    /// The points of the voxel around `center` that a tet holds, as bits.
    #[inline(always)]
    fn inside(&self, raster: TetRaster<'_>, center: &Vector3<f64>, [x, y, z]: &Places) -> u64 {
        let mut held = u64::MAX;
        for corner in 0..4 {
            let (gradient, constant) = (raster.gradient_of(corner), raster.constant_of(corner));
            let lowest = -self.walls.space.tolerance * gradient.norm();
            if constant + gradient.dot(center) - half_cube(&gradient) >= lowest {
                // All points of the voxel are on the inner side of this face.
                continue;
            }
            let mut bits = 0;
            for n in 0..POINTS {
                let along = (gradient.x * x[n] + gradient.y * y[n]) + gradient.z * z[n];
                bits |= u64::from(constant + along >= lowest) << n;
            }
            held &= bits;
            if held == 0 {
                break;
            }
        }
        held
    }
}

/// Finds the new values of some voxels. `first` is the place of the first one in the list.
struct Part<'a> {
    means: &'a WallMeans<'a>,
    first: usize,
    voxels: &'a [[usize; 3]],
    found: &'a mut Vec<(usize, i16)>,
}

impl LaneTask<f32> for Part<'_> {
    #[inline(always)]
    fn run<L: Lanes<f32>>(self) {
        let [columns, rows, _] = self.means.walls.shape;
        let mut owners = Vec::new();
        for (n, &[i, j, k]) in self.voxels.iter().enumerate() {
            if let Some(value) = self.means.value(self.first + n, [i, j, k], &mut owners) {
                self.found.push(((k * rows + j) * columns + i, value));
            }
        }
    }
}

/// The points relative to the center of a voxel, in voxels.
fn points() -> [Vector3<f64>; POINTS] {
    let level = |n: usize| ((n % POINTS) as f64 + 0.5) / POINTS as f64 - 0.5;
    std::array::from_fn(|n| Vector3::from(GENERATORS.map(|generator| level(n * generator))))
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
}
