//! The tissue's tets, vertices and edges, taken from a lattice.

use cutis_volume::Grid;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::cells::CellMasks;
use crate::select::HalfSpace;
use crate::{Frame, Frozen, Lattice, MeshError, TissueMask, edges};

/// Stands for "no vertex" in [`TetMesh::vertex_of_point`].
pub const NO_VERTEX: u32 = u32::MAX;

/// What of a lattice becomes a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Tissue<'a> {
    /// Per lattice point, in grid order: true if the point is air. With the transfer table from −449 to 6 HU that is a value *below* −449 HU;
    /// a point of exactly −449 HU is tissue (published counts of skin triangles rest on this).
    pub air: &'a [bool],
    /// Everything strictly inside one of these is left out, as if it were air.
    pub cut_away: &'a [HalfSpace],
    /// Keep only the largest face-connected component; drops the scanner table, and what else lies apart.
    pub largest_component: bool,
}

/// Tetrahedra over tissue, with vertices numbered in lattice order.
///
/// Indices in `tets` and `edges` are below `positions.len()`; `lattice_index` is ascending.
#[derive(Clone, Debug)]
pub struct TetMesh {
    /// Places `positions` in the world.
    pub frame: Frame,
    /// The lattice the mesh was taken from.
    pub lattice: Lattice,
    /// Local meters.
    pub positions: Vec<Point3<f32>>,
    /// Positively oriented tets, in the order of their cells, then as [`Lattice::cell_tets`].
    pub tets: Vec<[u32; 4]>,
    /// Each edge of a tet once, lower vertex first, in ascending order.
    pub edges: Vec<[u32; 2]>,
    /// Vertex → flat index of its lattice point.
    pub lattice_index: Vec<u32>,
    /// HU at each vertex.
    pub hu: Vec<f32>,
    /// Face-connected components among the tissue tets, before any was dropped; 1 where they were not told apart.
    pub components: usize,
    /// Tissue tets that were dropped with the smaller components.
    pub dropped_tets: usize,
    /// What a region left out of the mesh, if it was built within one ([`TissueMask::mesh_within`]).
    pub frozen: Option<Frozen>,
}

impl TetMesh {
    /// Keeps the tets whose four corners are tissue. `hu` holds a value per lattice point, in grid order.
    ///
    /// ```
    /// use cutis_mesh::{Lattice, Split, TetMesh, Tissue};
    /// use cutis_volume::{Affine, Grid};
    /// let grid = Grid { shape: [3, 3, 3], affine: Affine::from_spacing([2.0; 3], [0.0; 3])? };
    /// let lattice = Lattice::new(grid, Split::Kuhn6)?;
    /// let tissue = Tissue { air: &[false; 27], cut_away: &[], largest_component: true };
    /// let mesh = TetMesh::build(&lattice, &[40.0; 27], &tissue)?;
    /// assert_eq!((mesh.positions.len(), mesh.edges.len(), mesh.tets.len()), (27, 98, 48));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::Length`] for arrays of another length, [`MeshError::NotFinite`] for a HU value of a mesh vertex that is NaN or
    /// infinite, [`MeshError::Plane`] for a bad half-space, [`MeshError::NoTissue`] if no tet is kept.
    pub fn build(lattice: &Lattice, hu: &[f32], tissue: &Tissue<'_>) -> Result<Self, MeshError> {
        TissueMask::find(lattice, tissue)?.mesh(hu)
    }

    /// Numbers the vertices of the tets in `masks` and lists tets and edges.
    pub(crate) fn from_masks(
        whole: &TissueMask,
        hu_at_grid: &[f32],
        masks: &CellMasks,
    ) -> Result<Self, MeshError> {
        let lattice = whole.lattice();
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
            components: whole.components(),
            dropped_tets: whole.dropped_tets(),
            frozen: None,
        })
    }

    /// Flat lattice index → vertex, or [`NO_VERTEX`].
    pub fn vertex_of_point(&self) -> Vec<u32> {
        invert(self.lattice.grid(), &self.lattice_index)
    }

    /// The lattice point `(i, j, k)` of a vertex.
    pub fn point(&self, vertex: u32) -> [usize; 3] {
        self.lattice.grid().point(self.lattice_index[vertex as usize] as usize)
    }

    /// Bits of the cells' tets, recovered from the tets that are (still) there.
    pub(crate) fn cell_masks(&self) -> CellMasks {
        let mut masks = CellMasks::empty(&self.lattice);
        let [cx, cy, cz] = masks.shape;
        let layer_points = (cx + 1) * (cy + 1);
        let layer_of = |tet: &[u32; 4]| {
            let lowest = tet.iter().fold(u32::MAX, |low, &vertex| low.min(vertex));
            self.lattice_index[lowest as usize] as usize / layer_points
        };
        let starts: Vec<usize> =
            (0..=cz).map(|k| self.tets.partition_point(|tet| layer_of(tet) < k)).collect();
        let first = masks.flat([0, 0, 0]);
        let layer_cells = (cx + 2) * (cy + 2);
        masks.bytes.par_chunks_mut(layer_cells).skip(1).take(cz).enumerate().for_each(|(k, layer)| {
            for tet in &self.tets[starts[k]..starts[k + 1]] {
                let ([i, j, _], t) = self.cell_of(tet);
                layer[first - layer_cells + i + (cx + 2) * j] |= 1 << t;
            }
        });
        masks
    }

    /// The cell of a tet, and which of the cell's tets it is.
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
            let kinds = &masks.stencil.tets[cell.iter().sum::<usize>() & 1];
            let kept = kinds.iter().enumerate().filter(|(t, _)| mask >> t & 1 == 1);
            for ((_, corners), tet) in kept.zip(&mut out) {
                *tet = corners.map(|corner| vertex_of[first + corner_step[usize::from(corner)]]);
            }
        });
    });
    tets
}

/// Cuts a slice into consecutive parts of the given lengths.
pub(crate) fn split<'a, T>(mut slice: &'a mut [T], lengths: &[usize]) -> Vec<&'a mut [T]> {
    let take = |&length: &usize| {
        let (part, rest) = std::mem::take(&mut slice).split_at_mut(length);
        slice = rest;
        part
    };
    lengths.iter().map(take).collect()
}
