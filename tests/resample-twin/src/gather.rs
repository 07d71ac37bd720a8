//! `gather.wgsl`: the value of each voxel.

use std::ops::Range;

use cutis_volume::Volume;

use crate::is_marked;
use crate::passes::Mesh;
use crate::tet::{Vec3, Vec4, heights, row_of, tet_of};
use cutis_resample::{GridUniform, SlabState};

fn voxel_at(volume: &Volume, i: i32, j: i32, k: i32) -> i32 {
    i32::from(volume.voxels()[volume.grid().index([i as usize, j as usize, k as usize])])
}

fn between(a: f32, b: f32, fraction: f32) -> f32 {
    a + fraction * (b - a)
}

/// The trilinear value at a place, rounded to the nearest stored value, halves upwards. Where
/// padding meets other voxels, it counts as the nearest value that is not padding.
fn trilinear(place: Vec3, volume: &Volume, grid: &GridUniform) -> i32 {
    let at: Vec3 = std::array::from_fn(|n| place[n].clamp(grid.first[n], grid.last[n]));
    let low = at.map(f32::floor);
    let f: Vec3 = std::array::from_fn(|n| at[n] - low[n]);
    let l: [i32; 3] = std::array::from_fn(|n| low[n] as i32 + grid.center[n]);
    let h: [i32; 3] = std::array::from_fn(|n| (l[n] + 1).min(grid.last[n] as i32 + grid.center[n]));
    let mut v: [i32; 8] = std::array::from_fn(|n| {
        let pick = |axis: usize| if n >> axis & 1 == 1 { h[axis] } else { l[axis] };
        voxel_at(volume, pick(0), pick(1), pick(2))
    });
    let padding = v.iter().filter(|&&value| value < grid.scanned[0] || value > grid.scanned[1]).count();
    if padding > 0 && padding < 8 {
        if f == [0.0; 3] {
            return v[0];
        }
        v = v.map(|value| value.clamp(grid.scanned[0], grid.scanned[1]));
    }
    let v = v.map(|value| value as f32);
    let y0 = between(between(v[0], v[1], f[0]), between(v[2], v[3], f[0]), f[1]);
    let y1 = between(between(v[4], v[5], f[0]), between(v[6], v[7], f[0]), f[1]);
    (between(y0, y1, f[2]) + 0.5).floor() as i32
}

/// Place at rest of a point in a deformed tet. A point just outside is clamped to the tet, however
/// thin it is.
fn rest_place(mesh: &Mesh<'_>, corners: [u32; 4], point: Vec3, held: bool) -> Vec3 {
    let [a, b, c, d] = mesh.now(corners);
    let tet = tet_of(a, b, c, d, mesh.grid.tolerance);
    let height = heights(&tet, row_of(&tet, point[1], point[2]), point[0]);
    let inner = height.map(|h| h.max(0.0));
    let sum = ((inner[0] + inner[1]) + inner[2]) + inner[3];
    let whole = if held { tet.volume } else { sum };
    let share: Vec4 = (if held { height } else { inner }).map(|h| h / if whole > 0.0 { whole } else { 1.0 });
    let [a, b, c, d] = mesh.at_rest(corners);
    std::array::from_fn(|n| {
        a[n] + (((b[n] - a[n]) * share[1] + (c[n] - a[n]) * share[2]) + (d[n] - a[n]) * share[3])
    })
}

/// Computes the value of each voxel of the slab: through its owner, air if the body has left it,
/// else the input value.
pub fn gather(mesh: &Mesh<'_>, slab: &Range<u32>, tets: &[[u32; 4]], volume: &Volume, state: &mut SlabState) {
    let grid = mesh.grid;
    let [columns, rows, _] = grid.shape;
    for voxel in 0..state.owners.len() {
        let at = voxel as u32;
        let index = [at % columns, at / columns % rows, slab.start + at / (columns * rows)];
        let point: Vec3 = std::array::from_fn(|n| grid.region[n] + index[n] as f32);
        let [i, j, k]: [i32; 3] = std::array::from_fn(|n| point[n] as i32 + grid.center[n]);
        let owner = state.owners[voxel];
        let value = if owner == SlabState::NONE {
            let gone = is_marked(state, 3, voxel);
            state.counts[1] += u32::from(gone);
            if gone { grid.air } else { voxel_at(volume, i, j, k) }
        } else {
            let corners = tets[(owner & !SlabState::NEAR) as usize];
            let is_fold = is_marked(state, 1, voxel) && is_marked(state, 2, voxel);
            state.counts[2] += u32::from(is_fold);
            if mesh.has_moved(corners) {
                state.counts[0] += 1;
                trilinear(rest_place(mesh, corners, point, owner & SlabState::NEAR == 0), volume, grid)
            } else {
                voxel_at(volume, i, j, k)
            }
        };
        state.values[voxel] = value as i16;
    }
}
