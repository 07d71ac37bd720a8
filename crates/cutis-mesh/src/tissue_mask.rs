//! The body as a set of lattice tets, and meshes of the whole body or of a region.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::build::NO_VERTEX;
use crate::cells::{CellMasks, CornerBits};
use crate::component::{self, Largest};
use crate::tissue_tets::TissueTets;
use crate::{Lattice, MeshError, Skin, SkinMode, TetMesh, Tissue, edges, skin};

/// The body: the tissue tets of a lattice. It is the input for meshes of the whole body or of a
/// region.
#[derive(Clone)]
pub struct TissueMask {
    lattice: Lattice,
    masks: CellMasks,
    vertices: Vec<bool>,
    components: usize,
    dropped_tets: usize,
}

/// The tissue outside the region of a mesh. It never moves and is in no constraint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InactiveTissue {
    /// One flag per lattice point: true if it is a vertex of the body but not of the mesh.
    pub points: Vec<bool>,
    /// One flag per mesh vertex: true if it is outside the region. Such a vertex belongs to a tet
    /// that reaches across the border of the region. It must be fixed.
    pub border: Vec<bool>,
    /// Number of vertices that are not in the mesh.
    pub vertices: usize,
    /// Number of edges that are not in the mesh.
    pub edges: usize,
    /// Number of tets that are not in the mesh.
    pub tets: usize,
}

impl TissueMask {
    /// Finds the tets with four tissue corners, and optionally their largest component.
    ///
    /// ```
    /// use cutis_mesh::{Lattice, Split, Tissue, TissueMask};
    /// use cutis_volume::{Affine, Grid};
    /// let grid = Grid { shape: [3, 3, 3], affine: Affine::from_spacing([2.0; 3], [0.0; 3])? };
    /// let lattice = Lattice::new(grid, Split::Kuhn6)?;
    /// let tissue = Tissue { air: &[false; 27], cut_away: &[], largest_component: true };
    /// let mesh = TissueMask::find(&lattice, &tissue)?.mesh(&[40.0; 27])?;
    /// assert_eq!((mesh.positions.len(), mesh.edges.len(), mesh.tets.len()), (27, 98, 48));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::Length`] if `tissue.air` does not have one value per lattice point.
    /// [`MeshError::Plane`] if a half-space is not valid. [`MeshError::NoTissue`] if there is no
    /// such tet.
    pub fn find(lattice: &Lattice, tissue: &Tissue<'_>) -> Result<Self, MeshError> {
        let all = tissue_tets(lattice, tissue)?.masks;
        Ok(if tissue.largest_component {
            let tets = all.tet_count();
            Self::of_largest(lattice, component::largest(all), tets)
        } else {
            Self::of_all(lattice, all)
        })
    }

    /// Finds the body like [`TissueMask::find`], and the skin like [`skin::detect`], in less time
    /// than the two. `through_axis` is that of [`SkinOptions`](crate::SkinOptions).
    ///
    /// # Errors
    /// The errors of [`TissueMask::find`], and [`MeshError::Axis`] if the through axis is above 2.
    pub fn find_with_skin(
        lattice: &Lattice,
        tissue: &Tissue<'_>,
        mode: SkinMode,
        through_axis: Option<usize>,
    ) -> Result<(Self, Skin), MeshError> {
        let all = tissue_tets(lattice, tissue)?;
        let largest = component::largest(all.masks.clone());
        let skin = skin::of_tissue(lattice, &all, &largest, mode, through_axis)?;
        let mask = if tissue.largest_component {
            Self::of_largest(lattice, largest, all.masks.tet_count())
        } else {
            Self::of_all(lattice, all.masks)
        };
        Ok((mask, skin))
    }

    fn of_all(lattice: &Lattice, masks: CellMasks) -> Self {
        let vertices = masks.used_points();
        Self { lattice: lattice.clone(), masks, vertices, components: 1, dropped_tets: 0 }
    }

    /// `tets` is the number of tets of all components.
    fn of_largest(lattice: &Lattice, largest: Largest, tets: usize) -> Self {
        let Largest { masks, points, components } = largest;
        let dropped_tets = tets - masks.tet_count();
        Self { lattice: lattice.clone(), masks, vertices: points, components, dropped_tets }
    }

    /// The lattice of the body.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The same body on a lattice with moved points ([`Lattice::with_moves`]).
    ///
    /// # Errors
    /// The errors of [`Lattice::with_moves`].
    pub fn with_moves(self, points: Vec<u32>, mm: Vec<Vector3<f64>>) -> Result<Self, MeshError> {
        Ok(Self { lattice: self.lattice.with_moves(points, mm)?, ..self })
    }

    /// One flag per lattice point: true if it is a vertex of the body.
    pub fn vertices(&self) -> &[bool] {
        &self.vertices
    }

    /// One flag per lattice point: true if it is a vertex of the body and `chosen` is true for its
    /// position in world mm.
    pub fn vertices_where(&self, chosen: impl Fn(Point3<f64>) -> bool + Sync) -> Vec<bool> {
        let grid = self.lattice.grid();
        let vertex = |(point, &vertex): (usize, &bool)| vertex && chosen(self.lattice.mm(grid.point(point)));
        self.vertices.par_iter().enumerate().map(vertex).collect()
    }

    /// Number of face-connected components of the tissue, before the smaller ones were dropped. It
    /// is 1 if components were not searched for.
    pub fn components(&self) -> usize {
        self.components
    }

    /// Number of tets of the body.
    pub fn tets(&self) -> usize {
        self.masks.tet_count()
    }

    /// Number of tissue tets in the components that were dropped.
    pub fn dropped_tets(&self) -> usize {
        self.dropped_tets
    }

    /// The skin triangles whose points are all vertices of the body, in flat lattice indices, and
    /// the number of other triangles.
    pub fn skin(&self, skin: &Skin) -> (Vec<[u32; 3]>, usize) {
        let of_body = |point: &u32| self.vertices.get(*point as usize).copied().unwrap_or(false);
        let triangles: Vec<[u32; 3]> =
            skin.triangles.iter().filter(|triangle| triangle.iter().all(of_body)).copied().collect();
        let others = skin.triangles.len() - triangles.len();
        (triangles, others)
    }

    /// Builds the mesh of the whole body. `hu` holds one value per lattice point, in grid order.
    ///
    /// # Errors
    /// [`MeshError::Length`] if `hu` does not have one value per lattice point.
    /// [`MeshError::NotFinite`] if the HU value of a vertex is NaN or infinite.
    pub fn mesh(&self, hu: &[f32]) -> Result<TetMesh, MeshError> {
        TetMesh::from_masks(self, hu, &self.masks)
    }

    /// Builds the mesh of a region: the tets with at least one corner `inside`. `inside` has one
    /// flag per lattice point, in grid order.
    ///
    /// [`TetMesh::inactive`] describes the tissue that is not in the mesh, and the mesh vertices
    /// outside the region, which must be fixed. Only the tets of the region are listed, so the size
    /// of the mesh depends on the region.
    ///
    /// # Errors
    /// The errors of [`TissueMask::mesh`], and [`MeshError::RegionEmpty`] if no vertex of the body
    /// is inside.
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
        mesh.inactive = Some(InactiveTissue {
            border: mesh.lattice_index.iter().map(|&point| !inside[point as usize]).collect(),
            vertices: points.iter().filter(|&&point| point).count(),
            edges: edges::count(grid, &self.masks, &self.vertices) - mesh.edges.len(),
            tets: self.masks.tet_count() - mesh.tets.len(),
            points,
        });
        Ok(mesh)
    }
}

/// The skin outside the region of a mesh. It does not move, but pictures and mesh files of the
/// whole body show it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InactiveSkin {
    /// Triangles. Let `n` be the number of mesh vertices. Corners below `n` are mesh vertices, and
    /// corner `n + m` is at `positions[m]`.
    pub triangles: Vec<[u32; 3]>,
    /// Positions of the vertices that are not in the mesh, in local meters and lattice order.
    pub positions: Vec<Point3<f32>>,
    /// Flat index of the lattice point of each position.
    pub lattice_index: Vec<u32>,
}

impl InactiveSkin {
    /// Follows a mesh with `vertices` vertices to which `more` were added.
    pub fn shift(&mut self, vertices: usize, more: usize) {
        for corner in self.triangles.iter_mut().flatten().filter(|corner| **corner as usize >= vertices) {
            *corner += more as u32;
        }
    }
}

impl TetMesh {
    /// Divides the skin of the whole body, given in lattice indices by [`TissueMask::skin`], into
    /// triangles that can move and triangles that cannot.
    ///
    /// The first are returned in mesh vertices. A triangle cannot move if all of its corners are
    /// outside the region. Without a region all triangles can move.
    ///
    /// # Panics
    /// If a triangle names a point that is not in the lattice.
    pub fn divide_skin(&self, skin: &[[u32; 3]]) -> (Vec<[u32; 3]>, InactiveSkin) {
        let vertex_of = self.vertex_of_point();
        let on_mesh = |triangle: &[u32; 3]| triangle.map(|point| vertex_of[point as usize]);
        let Some(inactive) = &self.inactive else {
            return (skin.iter().map(on_mesh).collect(), InactiveSkin::default());
        };
        let free = |&vertex: &u32| !inactive.border[vertex as usize];
        let moves = |corners: [u32; 3]| !corners.contains(&NO_VERTEX) && corners.iter().any(free);
        let (moving, fixed): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
            skin.iter().copied().partition(|triangle| moves(on_mesh(triangle)));
        let mut points: Vec<u32> = fixed.iter().flatten().copied().collect();
        points.retain(|&point| vertex_of[point as usize] == NO_VERTEX);
        points.sort_unstable();
        points.dedup();
        let (vertices, grid) = (self.positions.len(), self.lattice.grid());
        let corner = |point: u32| match vertex_of[point as usize] {
            NO_VERTEX => (vertices + points.partition_point(|&other| other < point)) as u32,
            vertex => vertex,
        };
        let position = |&point: &u32| self.frame.to_local(self.lattice.mm(grid.point(point as usize)));
        let triangles = fixed.iter().map(|triangle| triangle.map(corner)).collect();
        let positions = points.iter().map(position).collect();
        let inactive_skin = InactiveSkin { triangles, positions, lattice_index: points };
        (moving.iter().map(on_mesh).collect(), inactive_skin)
    }
}

/// The tissue of a lattice, with at least one tet.
fn tissue_tets(lattice: &Lattice, tissue: &Tissue<'_>) -> Result<TissueTets, MeshError> {
    let found = TissueTets::find(lattice, tissue.air, tissue.cut_away)?;
    if found.masks.tet_count() == 0 {
        return Err(MeshError::NoTissue {
            tets: lattice.tet_count(),
            tissue_vertices: found.points.iter().filter(|&&point| point).count(),
            vertices: lattice.grid().len(),
        });
    }
    Ok(found)
}

/// Removes the tets without a corner inside.
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
