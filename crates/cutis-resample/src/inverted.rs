//! Tets that are turned inside out. The volumes of many tets are computed at once.

use cutis_constraints::{LaneTask, Lanes, Scalar, SimdLevel};
use nalgebra::Point3;
use rayon::prelude::*;

use crate::Warp;

/// Tets whose volumes are computed at once.
const GROUP: usize = 32;
/// Tets that a thread takes at once.
const PART: usize = 512 * GROUP;

/// Number of tets whose volume changed its sign or vanished. `moved` says which tets moved.
pub fn inverted_tets(warp: &Warp<'_>, moved: &[bool], level: SimdLevel) -> usize {
    let parts = warp.tets.par_chunks(PART).zip(moved.par_chunks(PART));
    let counts = parts.map(|(tets, moved)| {
        let mut count = 0;
        f32::in_lanes(level, Inverted { warp, tets, moved, count: &mut count });
        count
    });
    counts.reduce(|| 0, |a, b| a + b)
}

/// Counts the inverted tets among some tets.
struct Inverted<'a> {
    warp: &'a Warp<'a>,
    tets: &'a [[u32; 4]],
    moved: &'a [bool],
    count: &'a mut usize,
}

impl LaneTask<f32> for Inverted<'_> {
    #[inline(always)]
    fn run<L: Lanes<f32>>(self) {
        for (tets, moved) in self.tets.chunks(GROUP).zip(self.moved.chunks(GROUP)) {
            if !moved.contains(&true) {
                continue;
            }
            let now = volumes(self.warp.deformed, tets);
            let before = volumes(self.warp.rest, tets);
            for n in 0..tets.len() {
                *self.count += usize::from(moved[n] && now[n] * before[n].signum() <= 0.0);
            }
        }
    }
}

/// Six times the signed volume of each tet.
#[inline(always)]
fn volumes(positions: &[Point3<f32>], tets: &[[u32; 4]]) -> [f64; GROUP] {
    let mut corners = [[[0.0_f32; GROUP]; 3]; 4];
    for (n, tet) in tets.iter().enumerate() {
        for corner in 0..4 {
            let position = &positions[tet[corner] as usize];
            for axis in 0..3 {
                corners[corner][axis][n] = position[axis];
            }
        }
    }
    let mut volumes = [0.0; GROUP];
    for n in 0..GROUP {
        let mut edges = [[0.0; 3]; 3];
        for corner in 0..3 {
            for axis in 0..3 {
                let (end, start) = (corners[corner + 1][axis][n], corners[0][axis][n]);
                edges[corner][axis] = f64::from(end) - f64::from(start);
            }
        }
        let [a, b, c] = edges;
        let x = b[1] * c[2] - b[2] * c[1];
        let y = b[2] * c[0] - b[0] * c[2];
        let z = b[0] * c[1] - b[1] * c[0];
        volumes[n] = (a[0] * x + a[1] * y) + a[2] * z;
    }
    volumes
}
