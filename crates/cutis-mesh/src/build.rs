//! Tetrahedral meshes of tissue, built from lattices.

use cutis_volume::Grid;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::cells::CellMasks;
use crate::select::HalfSpace;
use crate::{Copies, Frame, InactiveTissue, Lattice, MeshError, TissueMask, edges};

/// Marks lattice points without a vertex in [`TetMesh::vertex_of_point`].
pub const NO_VERTEX: u32 = u32::MAX;

/// Selects the lattice points that are tissue. Input of [`TissueMask::find`].
#[derive(Clone, Copy, Debug)]
pub struct Tissue<'a> {
    /// One flag per lattice point, in grid order: true if the point is air. With the transfer table
    /// from −449 to 6 HU, air is *below* −449 HU. Published counts of skin triangles require that a
    /// point of exactly −449 HU is tissue.
    pub air: &'a [bool],
    /// Points strictly inside one of these half-spaces count as air.
    pub cut_away: &'a [HalfSpace],
    /// Keep only the largest face-connected component. This removes the scanner table and other
    /// separate objects.
    pub largest_component: bool,
}

/// A tetrahedral mesh of tissue, with vertices numbered in lattice order. Built by
/// [`TissueMask::mesh`] or [`TissueMask::mesh_within`].
///
/// All indices in `tets` and `edges` are below `positions.len()`. `lattice_index` is ascending.
#[derive(Clone, Debug)]
pub struct TetMesh {
    /// Maps `positions` to the world.
    pub frame: Frame,
    /// The lattice from which the mesh was built.
    pub lattice: Lattice,
    /// Rest positions in local meters.
    pub positions: Vec<Point3<f32>>,
    /// Positively oriented tets in the order of their cells, and within a cell in the order of
    /// [`Lattice::cell_tets`].
    pub tets: Vec<[u32; 4]>,
    /// The edges of the tets in ascending order. Each occurs once, with the lower vertex first.
    pub edges: Vec<[u32; 2]>,
    /// Flat index of the lattice point of each vertex.
    pub lattice_index: Vec<u32>,
    /// HU at each vertex.
    pub hu: Vec<f32>,
    /// Number of face-connected components of the tissue, before the smaller ones were dropped. It
    /// is 1 if components were not searched for.
    pub components: usize,
    /// Number of tissue tets in the components that were dropped.
    pub dropped_tets: usize,
    /// The tissue outside the region, if the mesh was built by [`TissueMask::mesh_within`].
    pub inactive: Option<InactiveTissue>,
    /// The vertices and elements that came with copies of divided tets ([`TetMesh::divide`]). They
    /// are the last of their arrays, and are not in the order of the lattice.
    pub copies: Option<Copies>,
}

impl TetMesh {
    /// Builds the mesh of the tets in `masks`.
    pub(crate) fn from_masks(
        tissue: &TissueMask,
        hu_at_grid: &[f32],
        masks: &CellMasks,
    ) -> Result<Self, MeshError> {
        let lattice = tissue.lattice();
        let grid = lattice.grid();
        if hu_at_grid.len() != grid.len() {
            return Err(MeshError::Length { array: "hu", expected: grid.len(), found: hu_at_grid.len() });
        }
        let used = masks.used_points();
        let lattice_index: Vec<u32> =
            used.iter().enumerate().filter_map(|(point, &used)| used.then_some(point as u32)).collect();
        drop(used);
        let hu: Vec<f32> = lattice_index.iter().map(|&point| hu_at_grid[point as usize]).collect();
        if let Some(vertex) = hu.iter().position(|hu| !hu.is_finite()) {
            return Err(MeshError::NotFinite {
                point: grid.point(lattice_index[vertex] as usize),
                hu: hu[vertex],
            });
        }
        let frame = Frame::center_of(grid);
        let local = |&point: &u32| frame.to_local(lattice.mm(grid.point(point as usize)));
        let positions = lattice_index.par_iter().map(local).collect();
        let vertex_of = invert(grid, &lattice_index);
        let tets = tets(grid, masks, &vertex_of);
        let edges = edges::generate(grid, masks, &lattice_index, &vertex_of);
        Ok(Self {
            frame,
            lattice: lattice.clone(),
            positions,
            tets,
            edges,
            lattice_index,
            hu,
            components: tissue.components(),
            dropped_tets: tissue.dropped_tets(),
            inactive: None,
            copies: None,
        })
    }

    /// The vertex of each lattice point, or [`NO_VERTEX`], by flat lattice index.
    pub fn vertex_of_point(&self) -> Vec<u32> {
        invert(self.lattice.grid(), &self.lattice_index[..self.real_vertices()])
    }

    /// The lattice point `(i, j, k)` of a vertex.
    pub fn point(&self, vertex: u32) -> [usize; 3] {
        self.lattice.grid().point(self.lattice_index[vertex as usize] as usize)
    }

    /// The whole tets of the mesh as one bit mask per cell. After a cut it has only the remaining
    /// tets.
    pub(crate) fn cell_masks(&self) -> CellMasks {
        let mut masks = CellMasks::empty(&self.lattice);
        let [cx, cy, cz] = masks.shape;
        let layer_points = (cx + 1) * (cy + 1);
        let layer_of = |tet: &[u32; 4]| {
            let lowest = tet.iter().fold(u32::MAX, |low, &vertex| low.min(vertex));
            self.lattice_index[lowest as usize] as usize / layer_points
        };
        let tets = &self.tets[..self.whole_tets()];
        let starts: Vec<usize> = (0..=cz).map(|k| tets.partition_point(|tet| layer_of(tet) < k)).collect();
        let first = masks.flat([0, 0, 0]);
        let layer_cells = (cx + 2) * (cy + 2);
        masks.bytes.par_chunks_mut(layer_cells).skip(1).take(cz).enumerate().for_each(|(k, layer)| {
            for tet in &tets[starts[k]..starts[k + 1]] {
                let ([i, j, _], t) = self.cell_of(tet);
                layer[first - layer_cells + i + (cx + 2) * j] |= 1 << t;
            }
        });
        masks
    }

    /// The cell of a tet, and the number of the tet within the cell.
    pub(crate) fn cell_of(&self, tet: &[u32; 4]) -> ([usize; 3], usize) {
        let points = tet.map(|vertex| self.point(vertex));
        let cell: [usize; 3] =
            std::array::from_fn(|axis| points.iter().fold(usize::MAX, |low, p| low.min(p[axis])));
        let corner = |p: [usize; 3]| (0..3).fold(0u8, |c, axis| c | (u8::from(p[axis] > cell[axis])) << axis);
        let corners = points.map(corner);
        let parity = cell.iter().sum::<usize>() & 1;
        let tets = &self.lattice.stencil().tets[parity];
        let t = tets.iter().position(|own| own.iter().all(|c| corners.contains(c)));
        (cell, t.expect("the tets of a mesh are tets of its lattice"))
    }
}

fn invert(grid: &Grid, lattice_index: &[u32]) -> Vec<u32> {
    let mut vertex_of = vec![NO_VERTEX; grid.len()];
    for (vertex, &point) in lattice_index.iter().enumerate() {
        vertex_of[point as usize] = vertex as u32;
    }
    vertex_of
}

fn tets(grid: &Grid, masks: &CellMasks, vertex_of: &[u32]) -> Vec<[u32; 4]> {
    let counts = masks.tets_per_layer();
    let mut tets = vec![[0u32; 4]; counts.iter().sum()];
    let corner_step: [usize; 8] =
        std::array::from_fn(|corner| grid.index(Lattice::corner([0; 3], corner as u8)));
    split(&mut tets, &counts).into_par_iter().enumerate().for_each(|(k, layer)| {
        let mut out = layer.iter_mut();
        masks.for_layer(k, |cell, _, mask| {
            let first = grid.index(cell);
            let cell_tets = &masks.stencil.tets[cell.iter().sum::<usize>() & 1];
            let kept = cell_tets.iter().enumerate().filter(|(t, _)| mask >> t & 1 == 1);
            for ((_, corners), tet) in kept.zip(&mut out) {
                *tet = corners.map(|corner| vertex_of[first + corner_step[usize::from(corner)]]);
            }
        });
    });
    tets
}

/// Splits a slice into consecutive parts of the given lengths.
pub(crate) fn split<'a, T>(mut slice: &'a mut [T], lengths: &[usize]) -> Vec<&'a mut [T]> {
    let take = |&length: &usize| {
        let (part, rest) = std::mem::take(&mut slice).split_at_mut(length);
        slice = rest;
        part
    };
    lengths.iter().map(take).collect()
}
