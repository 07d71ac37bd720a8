//! The elements of a mesh along severed edges: copies of tets with virtual nodes.

use std::collections::HashMap;

use nalgebra::Point3;

use super::divide::THIN;
use super::walls::{Barycentric, Walls, raise};
use crate::TetMesh;

/// What replaces the tets that severed edges divide.
///
/// A *copy* of a tet holds one of its parts. A *node* is a vertex of the mesh or a virtual one: the
/// corners of a copy that are not in its part are virtual, unless tissue around the end of the cut
/// connects them. Node `n` is vertex `n` of the mesh, or `virtual_nodes[n − vertices]`.
///
/// Where a blade ends within a tet, the tet is divided in part: its copies hold the share of its
/// section that is cut, and one more copy with the corners of the tet holds the rest. So the
/// stiffness at the end of a cut does not jump when the blade moves.
///
/// It depends only on how far each blade has cut, not on the order of the cuts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wound {
    /// The divided tets in ascending order.
    pub split: Vec<SplitTet>,
    /// The copies, in the order of their tets and parts.
    pub copies: Vec<TetCopy>,
    /// The vertex of the mesh at the lattice point of each virtual node, in ascending order.
    pub virtual_nodes: Vec<u32>,
    /// Edges of the mesh with a divided tet, in ascending order. `edges` replaces them.
    pub split_edges: Vec<[u32; 2]>,
    /// The edges of the copies, and the edges of the mesh that also hold whole tets.
    pub edges: Vec<EdgeCopy>,
    /// Distances of the corners to blades, as [`SplitTet::walls`] names them.
    pub(super) distances: Vec<[f32; 4]>,
    /// Number of the blade of each row of `distances`.
    pub(super) blades: Vec<u32>,
}

/// A tet that severed edges divide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplitTet {
    /// Number of the tet in the mesh.
    pub tet: u32,
    /// The part of each corner.
    pub parts: [u8; 4],
    /// One bit for each part that has a copy.
    pub kept: u8,
    /// Number of the first copy.
    pub first_copy: u32,
    /// Share of the tet's section that is cut, above 0 and at most 1.
    pub cut: f64,
    /// Blades: first row of the distances, and number of rows.
    pub(super) walls: (u32, u8),
    /// The first of two of these rows around a piece, as in [`Walls::piece`].
    pub(super) piece: Option<u8>,
}

/// A copy of a tet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TetCopy {
    /// Number of the tet in the mesh.
    pub tet: u32,
    /// Number among the copies of the tet, for colors.
    pub number: u8,
    /// Nodes, in the order of the tet's corners.
    pub nodes: [u32; 4],
    /// Share of the tet's volume, above 0 and at most 1.
    pub share: f32,
    /// True if the copy has all of the tet's corners as its nodes: it stands for the share of the
    /// section that is not cut.
    pub whole: bool,
    /// The blade that takes it out of the body. A mesh that is divided does not have such a copy.
    pub gone: Option<u32>,
}

/// An edge of copies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeCopy {
    /// Nodes, in the order of their lattice points.
    pub nodes: [u32; 2],
    /// Number among the copies of this edge, for colors.
    pub number: u8,
    /// Volume in m³: its share of each tet around it, as in [`TetMesh::edge_volumes`].
    pub volume: f32,
}

/// A copy of a triangle of the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleCopy {
    /// Number of the triangle in the skin.
    pub triangle: u32,
    /// Number of the divided tet behind it in [`Wound::split`].
    pub split: u32,
    /// The part of that tet that it bounds. None for the copy that stands for the share of the
    /// tet's section that is not cut.
    pub part: Option<u8>,
    /// Nodes, in the order of the triangle's corners.
    pub nodes: [u32; 3],
    /// Share of the triangle's area, above 0 and at most 1.
    pub share: f32,
}

/// A skin triangle of a divided tet.
#[derive(Debug)]
pub(super) struct DividedTriangle {
    /// Number in the skin.
    pub triangle: u32,
    /// Number of the divided tet behind it in [`Wound::split`].
    pub split: u32,
    /// The tet's corners at its own.
    pub corners: [u8; 3],
    /// Share of its area of each part.
    pub areas: [f64; 4],
}

/// More blades sever the edges of one tet than its walls can tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooManyBlades {
    /// Number of the tet in the mesh.
    pub tet: u32,
    /// Number of blades.
    pub blades: usize,
}

impl Wound {
    /// The walls in a divided tet.
    pub fn walls(&self, split: &SplitTet) -> Walls<'_> {
        let (first, count) = (split.walls.0 as usize, usize::from(split.walls.1));
        let SplitTet { parts, kept, piece, .. } = *split;
        Walls { distances: &self.distances[first..first + count], parts, kept, piece }
    }

    /// The blades in a divided tet, with the distances of its corners.
    pub(super) fn walls_of(&self, split: &SplitTet) -> Vec<(u32, [f32; 4])> {
        let first = split.walls.0 as usize;
        let rows = first..first + usize::from(split.walls.1);
        rows.map(|row| (self.blades[row], self.distances[row])).collect()
    }

    /// Distances of the corners of a divided tet to a blade. None if they are on one side of it.
    pub(super) fn distances_to(&self, split: &SplitTet, blade: usize) -> Option<&[f32; 4]> {
        let first = split.walls.0 as usize;
        let rows = first..first + usize::from(split.walls.1);
        rows.into_iter().find(|&row| self.blades[row] as usize == blade).map(|row| &self.distances[row])
    }

    /// The copy that holds a part of a divided tet, as its number in `copies`.
    pub fn copy_of(&self, split: &SplitTet, part: u8) -> Option<usize> {
        let before = (split.kept & ((1 << part) - 1)).count_ones();
        (split.kept >> part & 1 == 1).then_some((split.first_copy + before) as usize)
    }

    /// The copy to which a point of a divided tet belongs, as its number in `copies`.
    pub fn owner(&self, split: &SplitTet, point: &Barycentric) -> Option<usize> {
        self.copy_of(split, self.walls(split).owner(point))
    }

    /// The copies of skin triangles of divided tets, in the order of the skin. `triangles` are
    /// boundary faces of the mesh. A triangle with copies is replaced by them.
    pub fn skin(&self, mesh: &TetMesh, triangles: &[[u32; 3]]) -> Vec<TriangleCopy> {
        let mut copies = Vec::new();
        for DividedTriangle { triangle, split, corners, areas } in self.areas(mesh, triangles) {
            let own = &self.split[split as usize];
            let copy_of = |nodes: &[u32; 4], part, share: f64| {
                let nodes = corners.map(|corner| nodes[usize::from(corner)]);
                TriangleCopy { triangle, split, part, nodes, share: share as f32 }
            };
            let parts = (0..4).filter(|&part| areas[usize::from(part)] > 0.0);
            copies.extend(parts.filter_map(|part| {
                let copy = self.copy_of(own, part).filter(|&copy| self.copies[copy].gone.is_none())?;
                Some(copy_of(&self.copies[copy].nodes, Some(part), areas[usize::from(part)] * own.cut))
            }));
            if own.cut < 1.0 && !self.rest_is_gone(own) {
                copies.push(copy_of(&mesh.tets[own.tet as usize], None, 1.0 - own.cut));
            }
        }
        copies
    }

    /// Whether the share of a tet that is not cut is taken out of the body.
    fn rest_is_gone(&self, split: &SplitTet) -> bool {
        let copy = split.first_copy as usize + split.kept.count_ones() as usize;
        self.copies[copy].gone.is_some()
    }

    /// The skin triangles of divided tets, in the order of the skin.
    pub(super) fn areas(&self, mesh: &TetMesh, triangles: &[[u32; 3]]) -> Vec<DividedTriangle> {
        let mut faces: HashMap<[u32; 3], (u32, usize)> = HashMap::new();
        for (n, split) in (0..).zip(&self.split) {
            let corners = &mesh.tets[split.tet as usize];
            for opposite in 0..4 {
                let mut face = [1, 2, 3].map(|step| corners[(opposite + step) % 4]);
                face.sort_unstable();
                faces.entry(face).or_insert((n, opposite));
            }
        }
        let divided = |(number, triangle): (u32, &[u32; 3])| {
            let mut face = *triangle;
            face.sort_unstable();
            let &(split, opposite) = faces.get(&face)?;
            let own = &self.split[split as usize];
            let tet = &mesh.tets[own.tet as usize];
            let corners = triangle.map(|v| {
                let corner = tet.iter().position(|&corner| corner == v);
                corner.expect("the face has the corners of the triangle") as u8
            });
            let mut areas = self.walls(own).areas(opposite);
            let held = (0..4).fold(0, |held, n| held | u8::from(areas[n] > 0.0) << n);
            raise(&mut areas, held, THIN);
            Some(DividedTriangle { triangle: number, split, corners, areas })
        };
        (0..).zip(triangles).filter_map(divided).collect()
    }

    /// Rest positions of the virtual nodes in local meters.
    pub fn positions(&self, mesh: &TetMesh) -> Vec<Point3<f32>> {
        self.virtual_nodes.iter().map(|&v| mesh.positions[v as usize]).collect()
    }
}
