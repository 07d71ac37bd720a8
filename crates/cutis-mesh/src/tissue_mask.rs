//! Which tets of a lattice are the body, told for the whole of it; and meshes of all or of a part of that body.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::build::NO_VERTEX;
use crate::cells::{CellMasks, CornerBits};
use crate::select::present;
use crate::{Lattice, MeshError, Skin, TetMesh, Tissue, component, edges};

/// The body of a lattice, before anything of it is left out.
#[derive(Clone)]
pub struct TissueMask {
    lattice: Lattice,
    masks: CellMasks,
    vertices: Vec<bool>,
    components: usize,
    dropped_tets: usize,
}

/// What a region left out of a mesh: it never moves, and is in no constraint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frozen {
    /// Per lattice point: a vertex of the whole body that the mesh does not have.
    pub points: Vec<bool>,
    /// Per mesh vertex: outside the region, and there only because a tet reaches across its border. Such vertices must be held.
    pub border: Vec<bool>,
    /// Vertices left out.
    pub vertices: usize,
    /// Edges left out.
    pub edges: usize,
    /// Tets left out.
    pub tets: usize,
}

impl TissueMask {
    /// Keeps the tets whose four corners are tissue; of them the largest part, if so asked.
    ///
    /// # Errors
    /// [`MeshError::Length`] if `tissue.air` has not one value per lattice point, [`MeshError::Plane`] for a bad half-space,
    /// [`MeshError::NoTissue`] if no tet is kept.
    pub fn find(lattice: &Lattice, tissue: &Tissue<'_>) -> Result<Self, MeshError> {
        let present = present(lattice, tissue.air, tissue.cut_away)?;
        let all = CellMasks::of_points(lattice, &present);
        let before = all.tet_count();
        if before == 0 {
            return Err(MeshError::NoTissue {
                tets: lattice.tet_count(),
                tissue_vertices: present.iter().filter(|&&p| p).count(),
                vertices: lattice.grid().len(),
            });
        }
        drop(present);
        let (masks, components) = if tissue.largest_component {
            let largest = component::largest(all);
            (largest.masks, largest.components)
        } else {
            (all, 1)
        };
        let (vertices, dropped_tets) = (masks.used_points(), before - masks.tet_count());
        Ok(Self { lattice: lattice.clone(), masks, vertices, components, dropped_tets })
    }

    /// The lattice.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Per lattice point: a vertex of the body.
    pub fn vertices(&self) -> &[bool] {
        &self.vertices
    }

    /// Per lattice point: a vertex of the body at a position (world mm) that is chosen.
    pub fn vertices_where(&self, chosen: impl Fn(Point3<f64>) -> bool + Sync) -> Vec<bool> {
        let grid = self.lattice.grid();
        let vertex = |(point, &vertex): (usize, &bool)| vertex && chosen(self.lattice.mm(grid.point(point)));
        self.vertices.par_iter().enumerate().map(vertex).collect()
    }

    /// Face-connected components among the tissue tets, before any was dropped; 1 where they were not told apart.
    pub fn components(&self) -> usize {
        self.components
    }

    /// Tissue tets that were dropped with the smaller components.
    pub fn dropped_tets(&self) -> usize {
        self.dropped_tets
    }

    /// Skin triangles all of whose points are vertices of the body, in lattice indices, and how many others there are.
    pub fn skin(&self, skin: &Skin) -> (Vec<[u32; 3]>, usize) {
        let of_body = |point: &u32| self.vertices.get(*point as usize).copied().unwrap_or(false);
        let triangles: Vec<[u32; 3]> =
            skin.triangles.iter().filter(|triangle| triangle.iter().all(of_body)).copied().collect();
        let others = skin.triangles.len() - triangles.len();
        (triangles, others)
    }

    /// The mesh of the whole body. `hu` holds a value per lattice point, in grid order.
    ///
    /// # Errors
    /// [`MeshError::Length`] for an array of another length, [`MeshError::NotFinite`] for a HU value of a vertex that is NaN or infinite.
    pub fn mesh(&self, hu: &[f32]) -> Result<TetMesh, MeshError> {
        TetMesh::from_masks(self, hu, &self.masks)
    }

    /// The mesh of a region: the tets with at least one corner `inside` (a flag per lattice point, in grid order). Only these are ever
    /// listed. [`TetMesh::frozen`] tells what was left out, and which vertices lie outside and must be held.
    ///
    /// # Errors
    /// As [`TissueMask::mesh`], and [`MeshError::RegionEmpty`] if no vertex of the body is inside.
    pub fn mesh_within(&self, hu: &[f32], inside: &[bool]) -> Result<TetMesh, MeshError> {
        let (lattice, grid) = (&self.lattice, self.lattice.grid());
        if inside.len() != grid.len() {
            return Err(MeshError::Length { array: "inside", expected: grid.len(), found: inside.len() });
        }
        let mut masks = self.masks.clone();
        keep_touched(lattice, &mut masks, inside);
        if masks.tet_count() == 0 {
            return Err(MeshError::RegionEmpty { vertices: self.vertices.iter().filter(|&&v| v).count() });
        }
        let mut mesh = TetMesh::from_masks(self, hu, &masks)?;
        let mut points = self.vertices.clone();
        mesh.lattice_index.iter().for_each(|&point| points[point as usize] = false);
        mesh.frozen = Some(Frozen {
            border: mesh.lattice_index.iter().map(|&point| !inside[point as usize]).collect(),
            vertices: points.iter().filter(|&&point| point).count(),
            edges: edges::count(grid, &self.masks, &self.vertices) - mesh.edges.len(),
            tets: self.masks.tet_count() - mesh.tets.len(),
            points,
        });
        Ok(mesh)
    }
}

/// The skin that a region left out, for those who want to see the whole body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InactiveSkin {
    /// Corners below the mesh's number of vertices are mesh vertices; the others are `positions`, counted from there.
    pub triangles: Vec<[u32; 3]>,
    /// Local meters, in lattice order.
    pub positions: Vec<Point3<f32>>,
    /// Flat index of the lattice point of each position.
    pub lattice_index: Vec<u32>,
}

impl TetMesh {
    /// Divides a skin of the whole body (lattice indices, as [`TissueMask::skin`] gives it): triangles that can move, in mesh vertices, and
    /// the others, all of whose corners are frozen or held by a region. Without a region all of them can move.
    pub fn divide_skin(&self, skin: &[[u32; 3]]) -> (Vec<[u32; 3]>, InactiveSkin) {
        let vertex_of = self.vertex_of_point();
        let on_mesh = |triangle: &[u32; 3]| triangle.map(|point| vertex_of[point as usize]);
        let Some(frozen) = &self.frozen else {
            return (skin.iter().map(on_mesh).collect(), InactiveSkin::default());
        };
        let free = |&vertex: &u32| !frozen.border[vertex as usize];
        let moves = |corners: [u32; 3]| !corners.contains(&NO_VERTEX) && corners.iter().any(free);
        let (moving, still): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
            skin.iter().copied().partition(|triangle| moves(on_mesh(triangle)));
        let mut points: Vec<u32> = still.iter().flatten().copied().collect();
        points.retain(|&point| vertex_of[point as usize] == NO_VERTEX);
        points.sort_unstable();
        points.dedup();
        let (vertices, grid) = (self.positions.len(), self.lattice.grid());
        let corner = |point: u32| match vertex_of[point as usize] {
            NO_VERTEX => (vertices + points.partition_point(|&other| other < point)) as u32,
            vertex => vertex,
        };
        let place = |&point: &u32| self.frame.to_local(self.lattice.mm(grid.point(point as usize)));
        let triangles = still.iter().map(|triangle| triangle.map(corner)).collect();
        let positions = points.iter().map(place).collect();
        let still = InactiveSkin { triangles, positions, lattice_index: points };
        (moving.iter().map(on_mesh).collect(), still)
    }
}

/// Drops the tets without a corner inside.
fn keep_touched(lattice: &Lattice, masks: &mut CellMasks, inside: &[bool]) {
    let corners = CornerBits::new(lattice, inside);
    let [_, cy, cz] = masks.shape;
    for k in 0..cz {
        for j in 0..cy {
            let start = masks.flat([0, j, k]);
            let (stencil, bytes) = (masks.stencil, &mut masks.bytes);
            corners.for_row(j, k, |i, bits| {
                bytes[start + i] &= !stencil.kept[(i + j + k) & 1][usize::from(!bits)];
            });
        }
    }
}
