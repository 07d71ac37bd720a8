//! `place.wgsl`, `span.wgsl`, `claim.wgsl` and `vacate.wgsl`.

use std::ops::Range;

use crate::mark;
use crate::tet::{Tet, Vec3, Vec4, box_of, has_volume, heights, row_of, tet_of, volume_of};
use cutis_resample::{GridUniform, SlabState};

/// A mesh over the grid, as the passes over its tets read it.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// The volume, and the map from positions to places.
    pub grid: &'a GridUniform,
    /// Places of the deformed vertices. The fourth component is 1 for vertices that moved.
    pub places: &'a [Vec4],
    /// Places of the vertices at rest.
    pub rest_places: &'a [Vec4],
}

impl Mesh<'_> {
    pub(crate) fn now(&self, corners: [u32; 4]) -> [Vec3; 4] {
        corners.map(|v| xyz(self.places[v as usize]))
    }

    pub(crate) fn at_rest(&self, corners: [u32; 4]) -> [Vec3; 4] {
        corners.map(|v| xyz(self.rest_places[v as usize]))
    }

    pub(crate) fn has_moved(&self, corners: [u32; 4]) -> bool {
        corners.iter().any(|&v| self.places[v as usize][3] > 0.0)
    }
}

fn xyz([x, y, z, _]: Vec4) -> Vec3 {
    [x, y, z]
}

/// Maps positions of vertices to places.
pub fn place(grid: &GridUniform, positions: &[Vec4], rest: &[Vec4]) -> Vec<Vec4> {
    let [x, y, z] = grid.linear;
    let along = |row: Vec3, p: Vec3, offset: f32| ((row[0] * p[0] + row[1] * p[1]) + row[2] * p[2]) + offset;
    let place = |(&position, &rest): (&Vec4, &Vec4)| {
        let p = xyz(position);
        let moved = p != xyz(rest) || !p.iter().all(|c| c.is_finite());
        let [offset_x, offset_y, offset_z] = grid.offset;
        [along(x, p, offset_x), along(y, p, offset_y), along(z, p, offset_z), f32::from(u8::from(moved))]
    };
    positions.iter().zip(rest).map(place).collect()
}

/// The slices that a tet comes near: the first in the lower half, the end in the upper half; 0 for
/// none.
fn span_of([a, b, c, d]: [Vec3; 4], grid: &GridUniform) -> u32 {
    let finite = [a, b, c, d].iter().all(|p| p.iter().all(|x| x.is_finite()));
    if !finite || !has_volume(&tet_of(a, b, c, d, grid.tolerance)) {
        return 0;
    }
    let covered = box_of(a, b, c, d, grid);
    covered.first[2] | covered.end[2] << 16
}

/// True if the volume changed its sign or vanished.
fn is_inverted([a, b, c, d]: [Vec3; 4], [e, f, g, h]: [Vec3; 4]) -> bool {
    let (now, before) = (volume_of(a, b, c, d), volume_of(e, f, g, h));
    now.is_finite() && before.is_finite() && now * (if before < 0.0 { -1.0 } else { 1.0 }) <= 0.0
}

/// The slices of each deformed tet and, if it moved, of the tet at rest; and the number of inverted
/// tets.
pub fn span(mesh: &Mesh<'_>, tets: &[[u32; 4]]) -> (Vec<[u32; 2]>, usize) {
    let mut inverted = 0;
    let spans = tets.iter().map(|&corners| {
        let mut left = 0;
        if mesh.has_moved(corners) {
            left = span_of(mesh.at_rest(corners), mesh.grid);
            inverted += usize::from(is_inverted(mesh.now(corners), mesh.at_rest(corners)));
        }
        [span_of(mesh.now(corners), mesh.grid), left]
    });
    (spans.collect(), inverted)
}

/// The slices of removed tets, which exist at rest only.
pub fn span_removed(mesh: &Mesh<'_>, removed: &[[u32; 4]]) -> Vec<[u32; 2]> {
    removed.iter().map(|&corners| [0, span_of(mesh.at_rest(corners), mesh.grid)]).collect()
}

fn touches_slab(span: u32, slab: &Range<u32>) -> bool {
    (span & 0xffff) < slab.end && (span >> 16) > slab.start
}

/// Calls `take(tet, height, voxel)` for each voxel of the slab that the tet holds or comes near.
fn walk_rows(
    corners: [Vec3; 4],
    grid: &GridUniform,
    slab: &Range<u32>,
    mut take: impl FnMut(&Tet, Vec4, usize),
) {
    let [a, b, c, d] = corners;
    let mut covered = box_of(a, b, c, d, grid);
    covered.first[2] = covered.first[2].max(slab.start);
    covered.end[2] = covered.end[2].min(slab.end);
    let tet = tet_of(a, b, c, d, grid.tolerance);
    for k in covered.first[2]..covered.end[2] {
        for j in covered.first[1]..covered.end[1] {
            let row = row_of(&tet, grid.region[1] + j as f32, grid.region[2] + k as f32);
            let first = ((k - slab.start) * grid.shape[1] + j) * grid.shape[0];
            for i in covered.first[0]..covered.end[0] {
                let height = heights(&tet, row, grid.region[0] + i as f32);
                if (0..4).all(|c| height[c] >= -tet.near[c]) {
                    take(&tet, height, (first + i) as usize);
                }
            }
        }
    }
}

/// Each deformed tet claims the voxels that it holds or comes near. The smallest key wins.
pub fn claim(
    mesh: &Mesh<'_>,
    slab: &Range<u32>,
    tets: &[[u32; 4]],
    spans: &[[u32; 2]],
    body_tets: usize,
    state: &mut SlabState,
) {
    for (t, (&corners, span)) in tets.iter().zip(spans).enumerate() {
        if !touches_slab(span[0], slab) {
            continue;
        }
        let has_moved = mesh.has_moved(corners);
        walk_rows(mesh.now(corners), mesh.grid, slab, |tet, height, voxel| {
            let holds = (0..4).all(|c| height[c] >= -tet.rounding[c]);
            let key = t as u32 | if holds { 0 } else { SlabState::NEAR };
            state.owners[voxel] = state.owners[voxel].min(key);
            if t < body_tets && (0..4).all(|c| height[c] > tet.near[c]) {
                let first_to_hold = mark(state, 0, voxel);
                if !first_to_hold {
                    mark(state, 1, voxel);
                }
                if has_moved {
                    mark(state, 2, voxel);
                }
            }
        });
    }
}

/// Each tet that moved or was removed marks the voxels that it covers at rest.
pub fn vacate(
    mesh: &Mesh<'_>,
    slab: &Range<u32>,
    tets: &[[u32; 4]],
    spans: &[[u32; 2]],
    state: &mut SlabState,
) {
    for (&corners, span) in tets.iter().zip(spans) {
        if touches_slab(span[1], slab) {
            walk_rows(mesh.at_rest(corners), mesh.grid, slab, |_, _, voxel| {
                mark(state, 3, voxel);
            });
        }
    }
}
