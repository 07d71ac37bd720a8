//! Edges of a lattice mesh, generated per direction, and the lattice's closed-form colors.

use cutis_volume::Grid;
use rayon::prelude::*;

use crate::build::split;
use crate::cells::CellMasks;
use crate::{Split, TetMesh};

/// Which edges start at a point: an edge is there if any of the tets around it is.
struct Starting<'a> {
    grid: &'a Grid,
    masks: &'a CellMasks,
    /// By parity of the point.
    directions: [Vec<Course>; 2],
}

/// A direction that edges of a lattice run in.
struct Course {
    /// To the second point, in flat indices.
    step: isize,
    /// The cells around, relative to the point's, and their tets with the edge.
    around: Vec<(isize, u8)>,
}

impl<'a> Starting<'a> {
    fn new(grid: &'a Grid, masks: &'a CellMasks) -> Self {
        let point_step = |[i, j, k]: [i8; 3]| {
            i as isize + grid.shape[0] as isize * (j as isize + grid.shape[1] as isize * k as isize)
        };
        let around =
            |cells: &[([i8; 3], u8)]| cells.iter().map(|&(cell, mask)| (masks.delta(cell), mask)).collect();
        let directions = masks.stencil.directions.each_ref().map(|directions| {
            directions.iter().map(|d| Course { step: point_step(d.step), around: around(&d.cells) }).collect()
        });
        Self { grid, masks, directions }
    }

    /// A bit per direction.
    fn at(&self, point: usize) -> u16 {
        let [i, j, k] = self.grid.point(point);
        let cell = self.masks.flat([i, j, k]);
        let has = |around: &[(isize, u8)]| {
            around.iter().any(|&(delta, mask)| self.masks.bytes[cell.wrapping_add_signed(delta)] & mask != 0)
        };
        let own = self.directions[(i + j + k) & 1].iter().enumerate();
        own.fold(0u16, |bits, (d, course)| bits | u16::from(has(&course.around)) << d)
    }
}

/// Number of edges of the tets in `masks`, whose corners are the points `used`.
pub(crate) fn count(grid: &Grid, masks: &CellMasks, used: &[bool]) -> usize {
    let starting = Starting::new(grid, masks);
    let edges = |(point, _): (usize, &bool)| starting.at(point).count_ones() as usize;
    used.par_iter().enumerate().filter(|(_, used)| **used).map(edges).reduce(|| 0, |a, b| a + b)
}

/// Ascending; lower vertex first.
pub(crate) fn generate(
    grid: &Grid,
    masks: &CellMasks,
    lattice_index: &[u32],
    vertex_of: &[u32],
) -> Vec<[u32; 2]> {
    let layer_size = grid.shape[0] * grid.shape[1];
    let start = |layer: usize| lattice_index.partition_point(|&point| (point as usize) < layer * layer_size);
    let starts: Vec<usize> = (0..=grid.shape[2]).map(start).collect();
    let starting = Starting::new(grid, masks);
    // First pass: which directions each vertex has an edge in.
    let bits: Vec<u16> = lattice_index.par_iter().map(|&point| starting.at(point as usize)).collect();
    let layers: Vec<_> = starts.windows(2).map(|w| w[0]..w[1]).collect();
    let count =
        |layer: &std::ops::Range<usize>| bits[layer.clone()].iter().map(|b| b.count_ones() as usize).sum();
    let counts: Vec<usize> = layers.par_iter().map(count).collect();
    // Second pass: write them.
    let mut edges = vec![[0u32; 2]; counts.iter().sum()];
    split(&mut edges, &counts).into_par_iter().zip(layers).for_each(|(out, layer)| {
        let mut out = out.iter_mut();
        for vertex in layer {
            let point = lattice_index[vertex] as usize;
            let parity = grid.point(point).iter().sum::<usize>() & 1;
            let own =
                starting.directions[parity].iter().enumerate().filter(|(d, _)| bits[vertex] >> d & 1 == 1);
            for ((_, course), edge) in own.zip(&mut out) {
                *edge = [vertex as u32, vertex_of[point.wrapping_add_signed(course.step)]];
            }
        }
    });
    edges
}

impl TetMesh {
    /// Colors of lattice edges in closed form: edges of one color share no vertex.
    ///
    /// Color = 2 · direction + parity of the first point along the direction's first axis: 14 colors for `kuhn6` (7 directions),
    /// 18 for `five` (9 directions). `edges` are edges of this mesh, or what a cut has left of them.
    pub fn edge_colors(&self, edges: &[[u32; 2]]) -> Vec<u16> {
        let directions = &self.lattice.stencil().directions;
        let class = |&[a, b]: &[u32; 2]| {
            let (p, q) = (self.point(a), self.point(b));
            let step: [i8; 3] = std::array::from_fn(|axis| (q[axis] as isize - p[axis] as isize) as i8);
            let axis = step.iter().position(|&s| s != 0).unwrap_or(0);
            let own = &directions[p.iter().sum::<usize>() & 1];
            let number = own.iter().find(|d| d.step == step).map_or(0, |d| d.number);
            2 * number + (p[axis] & 1) as u16
        };
        edges.par_iter().map(class).collect()
    }

    /// Colors of the vertices in closed form: vertices of one color are in no common tet, edge or face.
    ///
    /// `kuhn6`: (i + j + k) mod 4, since the corners of a tet lie on a monotonous path; 4 colors. `five`: the parities of i, j
    /// and k; 8 colors.
    pub fn vertex_classes(&self) -> Vec<u16> {
        let grid = self.lattice.grid();
        let class = |&point: &u32| {
            let [i, j, k] = grid.point(point as usize);
            let color = match self.lattice.split() {
                Split::Kuhn6 => (i + j + k) % 4,
                Split::Five => (i & 1) + 2 * (j & 1) + 4 * (k & 1),
            };
            color as u16
        };
        self.lattice_index.par_iter().map(class).collect()
    }

    /// Colors of lattice tets in closed form: tets of one color share no vertex.
    ///
    /// `kuhn6`: color = 4 · type + (i + j + k) mod 4 of the cell, 24 colors. `five`: 8 · type + the parities of i, j and k, 40
    /// colors. `tets` are tets of this mesh, or what a cut has left of them.
    pub fn tet_classes(&self, tets: &[[u32; 4]]) -> Vec<u16> {
        let class = |tet: &[u32; 4]| {
            let ([i, j, k], t) = self.cell_of(tet);
            let color = match self.lattice.split() {
                Split::Kuhn6 => 4 * t + (i + j + k) % 4,
                Split::Five => 8 * t + (i & 1) + 2 * (j & 1) + 4 * (k & 1),
            };
            color as u16
        };
        tets.par_iter().map(class).collect()
    }
}
