//! Which tets may hold a part of each of some voxels.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::partial_volume::Walls;
use crate::prepared::Prepared;
use crate::raster::{GROUP, TetRaster};
use crate::voxel_set::VoxelSet;

/// Tets, and for each voxel of a set those that may hold a part of its cube.
pub struct Reaching {
    /// The tets near the box around the voxels.
    pub tets: Prepared,
    /// The slots in `tets` of the tets of one voxel after another, in ascending order.
    slots: Vec<u32>,
    /// The first slot of each voxel, and the end.
    offsets: Vec<usize>,
}

impl Reaching {
    /// Finds the tets that `counts` admits. `positions` are those of their corners.
    pub fn new(
        walls: &Walls<'_>,
        voxels: &VoxelSet,
        positions: &[Point3<f32>],
        tets: &[[u32; 4]],
        counts: &(dyn Fn(usize) -> bool + Sync),
    ) -> Self {
        let outside: Vec<u8> =
            positions.par_iter().map(|&position| sides(voxels, walls.space.index(position))).collect();
        let all_outside = |tet: &[u32; 4]| tet.iter().fold(u8::MAX, |all, &v| all & outside[v as usize]);
        let near = tets.par_iter().enumerate().filter(|(n, tet)| all_outside(tet) == 0 && counts(*n));
        let numbers = near.map(|(n, _)| n as u32).collect();
        let corners = |tet: u32| walls.corners(positions, &tets[tet as usize]);
        let tets = Prepared::new(numbers, walls.space.tolerance, &corners);
        let groups = tets.numbers().par_chunks(GROUP).enumerate().map(|(group, numbers)| {
            let mut pairs: Vec<(u32, u32)> = Vec::new();
            for (lane, &tet) in numbers.iter().enumerate() {
                let slot = group * GROUP + lane;
                let Some(raster) = tets.raster(slot) else { continue };
                let cubes = CubeTest::new(raster, walls.space.tolerance);
                let [columns, rows, slices] = walls.spans(&corners(tet));
                for k in slices {
                    for j in rows.clone() {
                        for (place, i) in voxels.in_row(j, k, &columns) {
                            if cubes.may_touch([i, j, k]) {
                                pairs.push((place as u32, slot as u32));
                            }
                        }
                    }
                }
            }
            pairs
        });
        let groups: Vec<Vec<(u32, u32)>> = groups.collect();
        let (slots, offsets) = by_voxel(&groups, voxels.len());
        Self { tets, slots, offsets }
    }

    /// The slots of the tets of the voxel with this place in the set.
    pub fn of(&self, place: usize) -> &[u32] {
        &self.slots[self.offsets[place]..self.offsets[place + 1]]
    }
}

/// Sorts pairs of a voxel and a slot by voxel, in the order that they have.
fn by_voxel(groups: &[Vec<(u32, u32)>], voxels: usize) -> (Vec<u32>, Vec<usize>) {
    let mut offsets = vec![0; voxels + 1];
    for &(voxel, _) in groups.iter().flatten() {
        offsets[voxel as usize + 1] += 1;
    }
    for voxel in 0..voxels {
        offsets[voxel + 1] += offsets[voxel];
    }
    let mut next = offsets.clone();
    let mut slots = vec![0; offsets[voxels]];
    for &(voxel, slot) in groups.iter().flatten() {
        let next = &mut next[voxel as usize];
        slots[*next] = slot;
        *next += 1;
    }
    (slots, offsets)
}

/// The sides of the box around some voxels, dilated by a voxel, on which a point lies outside, as
/// bits. If all corners of a tet lie on the same side, it reaches none of the voxels.
fn sides(voxels: &VoxelSet, point: Point3<f64>) -> u8 {
    let mut sides = 0;
    for (axis, span) in voxels.bounds().iter().enumerate() {
        sides |= u8::from(point[axis] < span.start as f64 - 1.0) << (2 * axis);
        sides |= u8::from(point[axis] > span.end as f64) << (2 * axis + 1);
    }
    sides
}

/// The four faces of a tet against the cubes around voxel centers.
struct CubeTest {
    /// Gradients of the barycentric coordinates.
    gradients: [Vector3<f64>; 4],
    /// The largest value of each coordinate in the cube around `(0, 0, 0)`, plus the tolerance.
    most: [f64; 4],
}

impl CubeTest {
    fn new(raster: TetRaster<'_>, tolerance: f64) -> Self {
        let gradients = [0, 1, 2, 3].map(|corner| raster.gradient_of(corner));
        let most = std::array::from_fn(|corner| {
            let gradient: Vector3<f64> = gradients[corner];
            raster.constant_of(corner) + half_cube(&gradient) + tolerance * gradient.norm()
        });
        Self { gradients, most }
    }

    /// Whether the tet may hold a part of the cube around a voxel. The points of a voxel end at a
    /// 128th of it before the faces of the cube, which is much more than the rounding here.
    #[inline]
    fn may_touch(&self, voxel: [usize; 3]) -> bool {
        let center = Vector3::from(voxel.map(|index| index as f64));
        (0..4).all(|corner| self.most[corner] + self.gradients[corner].dot(&center) >= 0.0)
    }
}

/// How much a linear function differs between the center and a corner of a voxel, at most.
#[inline(always)]
pub fn half_cube(gradient: &Vector3<f64>) -> f64 {
    0.5 * ((gradient.x.abs() + gradient.y.abs()) + gradient.z.abs())
}
