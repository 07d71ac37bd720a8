//! Triangulated surfaces: the boundary faces of meshes, and the topology of triangle sets.

use rayon::prelude::*;

use crate::cells::CellMasks;
use crate::stencil::Neighbor;
use crate::{Lattice, TetMesh};

/// The face opposite to corner `f` of a positive tet, with its corners counterclockwise as seen
/// from outside.
///
/// In a positive tet `(a, b, c, d)` the normal of the face `b, c, d` points away from `a`.
pub(crate) const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

impl TetMesh {
    /// The faces that belong to exactly one tet of the mesh, in the order of the tets.
    ///
    /// They are oriented outwards: as seen from outside, the three vertices are counterclockwise in
    /// world space.
    pub fn boundary(&self) -> Vec<[u32; 3]> {
        let (masks, vertex_of) = (self.cell_masks(), self.vertex_of_point());
        let grid = self.lattice.grid();
        let layer = |k: usize| {
            let mut out = Vec::new();
            open_faces(&masks, k, |cell, tet, f, _| {
                let vertex = |corner: u8| vertex_of[grid.index(Lattice::corner(cell, corner))];
                out.push(FACES[f].map(|v| vertex(tet[v])));
            });
            out
        };
        (0..masks.shape[2]).into_par_iter().flat_map_iter(layer).collect()
    }
}

/// Calls `visit(cell, tet, f, neighbor)` for each tet in a layer and each of its faces `f` without
/// a tet of `masks` on the other side.
fn open_faces(masks: &CellMasks, k: usize, mut visit: impl FnMut([usize; 3], &[u8; 4], usize, &Neighbor)) {
    let across = |parity: usize| -> Vec<[(isize, u8); 4]> {
        let neighbor = |n: &Neighbor| (masks.delta(n.offset), 1 << n.tet);
        masks.stencil.neighbors[parity].iter().map(|faces| faces.each_ref().map(neighbor)).collect()
    };
    let across = [across(0), across(1)];
    masks.for_layer(k, |cell, flat, mask| {
        let parity = cell.iter().sum::<usize>() & 1;
        for (t, tet) in masks.stencil.tets[parity].iter().enumerate().filter(|(t, _)| mask >> t & 1 == 1) {
            for (f, (delta, bit)) in across[parity][t].iter().enumerate() {
                if masks.bytes[flat.wrapping_add_signed(*delta)] & bit == 0 {
                    visit(cell, tet, f, &masks.stencil.neighbors[parity][t][f]);
                }
            }
        }
    });
}

/// A face of a lattice tet.
pub(crate) struct LatticeFace {
    /// The three points as flat lattice indices, oriented outwards.
    pub triangle: [u32; 3],
    /// The lattice point of the tet on the other side that is not in the face.
    pub opposite: usize,
}

/// The faces between a tet in `masks` and a tet that is not in it. Faces on the box of the lattice
/// are not included.
pub(crate) fn faces(lattice: &Lattice, masks: &CellMasks) -> Vec<LatticeFace> {
    let (grid, cells) = (lattice.grid(), lattice.cells());
    let layer = |k: usize| {
        let mut out = Vec::new();
        open_faces(masks, k, |cell, tet, f, neighbor| {
            if let Some(other) = step(cell, neighbor, cells) {
                let point = |corner: u8| grid.index(Lattice::corner(cell, corner)) as u32;
                let opposite = grid.index(Lattice::corner(other, neighbor.opposite));
                out.push(LatticeFace { triangle: FACES[f].map(|v| point(tet[v])), opposite });
            }
        });
        out
    };
    (0..cells[2]).into_par_iter().flat_map_iter(layer).collect()
}

/// The cell of a neighbor, if it is within the lattice.
pub(crate) fn step(cell: [usize; 3], neighbor: &Neighbor, cells: [usize; 3]) -> Option<[usize; 3]> {
    let mut to = cell;
    for axis in 0..3 {
        to[axis] = cell[axis].checked_add_signed(isize::from(neighbor.offset[axis]))?;
        if to[axis] >= cells[axis] {
            return None;
        }
    }
    Some(to)
}

/// Topology of a set of triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Number of distinct vertices.
    pub vertices: usize,
    /// Edges of exactly one triangle, each with the lower vertex first.
    pub open_edges: Vec<[u32; 2]>,
    /// Number of edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Number of parts that share no vertex.
    pub components: usize,
    /// Vertices − edges + triangles. It is 2 for a sphere.
    pub euler_characteristic: i64,
}

impl Topology {
    /// Computes the topology of distinct triangles.
    pub fn of(triangles: &[[u32; 3]]) -> Self {
        let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)]);
        let mut edges: Vec<[u32; 2]> = triangles.iter().flat_map(sides).collect();
        edges.par_sort_unstable();
        let mut vertices: Vec<u32> = triangles.iter().flatten().copied().collect();
        vertices.par_sort_unstable();
        vertices.dedup();
        let mut sets = DisjointSets::new(vertices.len());
        let (mut open_edges, mut non_manifold_edges, mut distinct) = (Vec::new(), 0, 0);
        for run in edges.chunk_by(|a, b| a == b) {
            distinct += 1;
            match run.len() {
                1 => open_edges.push(run[0]),
                2 => {}
                _ => non_manifold_edges += 1,
            }
            let [a, b] = run[0].map(|v| vertices.partition_point(|&other| other < v));
            sets.join(a, b);
        }
        Self {
            vertices: vertices.len(),
            open_edges,
            non_manifold_edges,
            components: sets.count,
            euler_characteristic: vertices.len() as i64 - distinct + triangles.len() as i64,
        }
    }
}

struct DisjointSets {
    parent: Vec<usize>,
    count: usize,
}

impl DisjointSets {
    fn new(size: usize) -> Self {
        Self { parent: (0..size).collect(), count: size }
    }

    fn root(&mut self, mut element: usize) -> usize {
        while self.parent[element] != element {
            self.parent[element] = self.parent[self.parent[element]];
            element = self.parent[element];
        }
        element
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            self.parent[a.max(b)] = a.min(b);
            self.count -= 1;
        }
    }
}
