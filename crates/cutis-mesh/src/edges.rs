//! The edges of a lattice mesh, and the colors of edges, vertices and tets in closed form.

use cutis_volume::Grid;
use rayon::prelude::*;

use crate::build::split;
use crate::cells::CellMasks;
use crate::{Split, TetMesh};

/// Finds the edges that start at a point. An edge exists if any tet around it is present.
struct EdgeFinder<'a> {
    grid: &'a Grid,
    masks: &'a CellMasks,
    /// Indexed by the parity of the point.
    directions: [Vec<EdgeDirection>; 2],
}

/// A direction of lattice edges.
struct EdgeDirection {
    /// Difference between the flat indices of the two points.
    step: isize,
    /// The cells around the edge, relative to the cell of the first point, each with a mask of its
    /// tets that have the edge.
    around: Vec<(isize, u8)>,
}

impl<'a> EdgeFinder<'a> {
    fn new(grid: &'a Grid, masks: &'a CellMasks) -> Self {
        let point_step = |[i, j, k]: [i8; 3]| {
            i as isize + grid.shape[0] as isize * (j as isize + grid.shape[1] as isize * k as isize)
        };
        let around =
            |cells: &[([i8; 3], u8)]| cells.iter().map(|&(cell, mask)| (masks.delta(cell), mask)).collect();
        let directions = masks.stencil.directions.each_ref().map(|directions| {
            directions
                .iter()
                .map(|d| EdgeDirection { step: point_step(d.step), around: around(&d.cells) })
                .collect()
        });
        Self { grid, masks, directions }
    }

    /// One bit per direction: set if an edge in that direction starts at the point.
    fn starting_at(&self, point: usize) -> u16 {
        let [i, j, k] = self.grid.point(point);
        let cell = self.masks.flat([i, j, k]);
        let has = |around: &[(isize, u8)]| {
            around.iter().any(|&(delta, mask)| self.masks.bytes[cell.wrapping_add_signed(delta)] & mask != 0)
        };
        let own = self.directions[(i + j + k) & 1].iter().enumerate();
        own.fold(0u16, |bits, (d, direction)| bits | u16::from(has(&direction.around)) << d)
    }
}

/// Counts the edges of the tets in `masks`. `used` flags the corners of these tets.
pub(crate) fn count(grid: &Grid, masks: &CellMasks, used: &[bool]) -> usize {
    let finder = EdgeFinder::new(grid, masks);
    let edges = |(point, _): (usize, &bool)| finder.starting_at(point).count_ones() as usize;
    used.par_iter().enumerate().filter(|(_, used)| **used).map(edges).reduce(|| 0, |a, b| a + b)
}

/// Lists the edges of the tets in `masks` in ascending order, with the lower vertex first.
pub(crate) fn generate(
    grid: &Grid,
    masks: &CellMasks,
    lattice_index: &[u32],
    vertex_of: &[u32],
) -> Vec<[u32; 2]> {
    let layer_size = grid.shape[0] * grid.shape[1];
    let start = |layer: usize| lattice_index.partition_point(|&point| (point as usize) < layer * layer_size);
    let starts: Vec<usize> = (0..=grid.shape[2]).map(start).collect();
    let finder = EdgeFinder::new(grid, masks);
    // First pass: find the directions of the edges that start at each vertex.
    let bits: Vec<u16> = lattice_index.par_iter().map(|&point| finder.starting_at(point as usize)).collect();
    let layers: Vec<_> = starts.windows(2).map(|w| w[0]..w[1]).collect();
    let count =
        |layer: &std::ops::Range<usize>| bits[layer.clone()].iter().map(|b| b.count_ones() as usize).sum();
    let counts: Vec<usize> = layers.par_iter().map(count).collect();
    // Second pass: write the edges.
    let mut edges = vec![[0u32; 2]; counts.iter().sum()];
    split(&mut edges, &counts).into_par_iter().zip(layers).for_each(|(out, layer)| {
        let mut out = out.iter_mut();
        for vertex in layer {
            let point = lattice_index[vertex] as usize;
            let parity = grid.point(point).iter().sum::<usize>() & 1;
            let own =
                finder.directions[parity].iter().enumerate().filter(|(d, _)| bits[vertex] >> d & 1 == 1);
            for ((_, direction), edge) in own.zip(&mut out) {
                *edge = [vertex as u32, vertex_of[point.wrapping_add_signed(direction.step)]];
            }
        }
    });
    edges
}

impl TetMesh {
    /// Colors of lattice edges in closed form. Edges of one color share no vertex.
    ///
    /// The color is 2 · direction + the parity of the first point along the last axis of the
    /// direction. So the edges of one direction that start in a row along x have one color, except
    /// those along x itself, and a solver reads their vertices one behind the other. There are 14
    /// colors for `kuhn6` (7 directions) and 18 for `five` (9 directions). The copies of edges
    /// along a cut add as many colors for each number among the copies.
    pub fn edge_colors(&self) -> Vec<u16> {
        let color = |(n, edge): (usize, &[u32; 2])| self.edge_color(*edge, self.copy_of_edge(n));
        self.edges.par_iter().enumerate().map(color).collect()
    }

    /// Color of a copy of a lattice edge, from its nodes and its number among the copies.
    pub fn edge_color(&self, [a, b]: [u32; 2], copy: u8) -> u16 {
        let directions = &self.lattice.stencil().directions;
        let count = directions.iter().flatten().map(|d| d.number + 1).max().unwrap_or(0);
        let (p, q) = (self.point(a), self.point(b));
        let step: [i8; 3] = std::array::from_fn(|axis| (q[axis] as isize - p[axis] as isize) as i8);
        let axis = step.iter().rposition(|&s| s != 0).unwrap_or(0);
        let own = &directions[p.iter().sum::<usize>() & 1];
        let number = own.iter().find(|d| d.step == step).map_or(0, |d| d.number);
        2 * (number + count * u16::from(copy)) + (p[axis] & 1) as u16
    }

    /// Colors of the vertices in closed form. Two vertices of one color never belong to the same
    /// tet.
    ///
    /// For `kuhn6` the color is (i + j + k) mod 4, because the corners of a tet lie on a monotonic
    /// path: 4 colors. For `five` it combines the parities of i, j and k: 8 colors.
    pub fn vertex_colors(&self) -> Vec<u16> {
        let grid = self.lattice.grid();
        let color = |&point: &u32| {
            let [i, j, k] = grid.point(point as usize);
            let color = match self.lattice.split() {
                Split::Kuhn6 => (i + j + k) % 4,
                Split::Five => (i & 1) + 2 * (j & 1) + 4 * (k & 1),
            };
            color as u16
        };
        self.lattice_index.par_iter().map(color).collect()
    }

    /// Colors of lattice tets in closed form. Tets of one color share no vertex.
    ///
    /// Let `t` be the number of the tet within its cell `(i, j, k)`. The corners of a tet of
    /// `kuhn6` go along the three axes in some order. The color is 4t + 2m + n, where m is the
    /// parity of the cell along the middle axis of this order, and n that of the sum along the
    /// other two axes: 24 colors. Two tets of one type share a vertex if their cells are apart by
    /// the steps between two corners, and each of these steps changes m or n. For `five` the color
    /// is 8t + a number from the parities of i, j and k: 40 colors. Along x every second cell has
    /// one color, so that a solver reads vertices in rows. Copies of divided tets add as many
    /// colors for each number among the copies.
    pub fn tet_colors(&self) -> Vec<u16> {
        let color = |(n, tet): (usize, &[u32; 4])| self.tet_color(tet, self.copy_of_tet(n).0);
        self.tets.par_iter().enumerate().map(color).collect()
    }

    /// Color of a copy of a lattice tet, from its nodes and its number among the copies.
    pub fn tet_color(&self, nodes: &[u32; 4], copy: u8) -> u16 {
        let types = &self.lattice.stencil().tets[0];
        let ([i, j, k], number) = self.cell_of(nodes);
        let t = number + types.len() * usize::from(copy);
        let color = match self.lattice.split() {
            Split::Kuhn6 => {
                let middle = middle_axis(&types[number]);
                4 * t + 2 * ([i, j, k][middle] & 1) + ((i + j + k - [i, j, k][middle]) & 1)
            }
            Split::Five => 8 * t + (i & 1) + 2 * (j & 1) + 4 * (k & 1),
        };
        color as u16
    }
}

/// The middle one of the three axes along which the corners of a tet of `kuhn6` go through its
/// cell. Bit `axis` of a corner tells whether it is on the far side of the cell. Half of the
/// corners are.
fn middle_axis(corners: &[u8; 4]) -> usize {
    let far = |axis: usize| corners.iter().filter(|&corner| corner >> axis & 1 == 1).count();
    (0..3).find(|&axis| far(axis) == 2).unwrap_or(0)
}
