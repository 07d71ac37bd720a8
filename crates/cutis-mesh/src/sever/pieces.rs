//! The shapes of the parts of divided tets, as tets and triangles whose corners lie on edges and
//! walls.
//!
//! A copy of a tet holds only one part of it, but its nodes are the corners of the whole tet. For
//! pictures and resampling each part is cut out of its copy: the pieces of all copies fill the tet
//! at rest, and each piece moves with its copy.

use nalgebra::Point3;

use super::walls::Barycentric;
use super::wound::{TriangleCopy, Wound};
use crate::TetMesh;

/// A point that moves with nodes: the sum of their positions, times weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Embedded {
    /// Nodes of the cut body.
    pub nodes: [u32; 4],
    /// Weights of the nodes. Their sum is 1.
    pub weights: [f32; 4],
}

impl Embedded {
    /// A node itself.
    pub fn node(node: u32) -> Self {
        Self { nodes: [node; 4], weights: [1.0, 0.0, 0.0, 0.0] }
    }

    /// The position, from those of all nodes.
    pub fn at(&self, positions: &[Point3<f32>]) -> Point3<f32> {
        self.at_by(&|node| positions[node as usize].cast()).cast()
    }

    /// The position, from a function that returns those of nodes.
    pub fn at_by(&self, position: &dyn Fn(u32) -> Point3<f64>) -> Point3<f64> {
        // A node without weight may have no position.
        let used = self.nodes.iter().zip(&self.weights).filter(|(_, weight)| **weight != 0.0);
        used.fold(Point3::origin(), |sum, (&node, &weight)| sum + position(node).coords * f64::from(weight))
    }
}

/// Simplices with `N` corners, and the points at their corners that are no nodes.
///
/// Corner `nodes + n` is `points[n]`, where `nodes` is the number of nodes of the cut body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pieces<const N: usize> {
    /// Points on edges and walls.
    pub points: Vec<Embedded>,
    /// Corners: nodes or points.
    pub simplices: Vec<[u32; N]>,
    /// Number of the copy of each simplex.
    pub copies: Vec<u32>,
}

impl<const N: usize> Pieces<N> {
    /// The pieces but for those of copies that leave with one of `groups` groups, and the corners
    /// of these for each group. `leaves` returns the group of a copy.
    pub(super) fn apart(
        mut self,
        groups: usize,
        leaves: impl Fn(u32) -> Option<usize>,
    ) -> (Self, Vec<Vec<[u32; N]>>) {
        let (mut kept, mut copies, mut left) = (Vec::new(), Vec::new(), vec![Vec::new(); groups]);
        for (simplex, copy) in self.simplices.drain(..).zip(self.copies.drain(..)) {
            if let Some(group) = leaves(copy) {
                left[group].push(simplex);
            } else {
                kept.push(simplex);
                copies.push(copy);
            }
        }
        (Self { simplices: kept, copies, ..self }, left)
    }
}

impl Wound {
    /// Number of nodes of the cut body.
    pub fn nodes(&self, mesh: &TetMesh) -> usize {
        mesh.positions.len() + self.virtual_nodes.len()
    }

    /// The parts of all divided tets as tets, and for each of `blades` blades those that it takes
    /// out of the body.
    pub(super) fn tet_pieces(&self, mesh: &TetMesh, blades: usize) -> (Pieces<4>, Vec<Vec<[u32; 4]>>) {
        let mut builder = Builder::new(self.nodes(mesh));
        // What is taken out and has no copy has the number of its blade, after all copies.
        let all = self.copies.len();
        for split in &self.split {
            let corners = [0, 1, 2, 3].map(unit);
            let out = split.piece.map(|row| self.blades[split.walls.0 as usize + usize::from(row)]);
            self.walls(split).pieces(corners, |part, piece| {
                let copy = part.and_then(|part| self.copy_of(split, part));
                match (copy, out) {
                    (Some(copy), _) => builder.push(copy, piece, self.copies[copy].nodes),
                    (None, Some(blade)) if part.is_none() => {
                        builder.push(all + blade as usize, piece, mesh.tets[split.tet as usize]);
                    }
                    _ => {}
                }
            });
        }
        builder.pieces.apart(blades, |copy| match self.copies.get(copy as usize) {
            Some(copy) => copy.gone.map(|blade| blade as usize),
            None => Some(copy as usize - all),
        })
    }

    /// The parts of the skin triangles that `copies` ([`Wound::skin`]) name, as triangles.
    /// `triangles` is the skin.
    pub fn skin_pieces(&self, mesh: &TetMesh, triangles: &[[u32; 3]], copies: &[TriangleCopy]) -> Pieces<3> {
        let mut builder = Builder::new(self.nodes(mesh));
        for (number, own) in copies.iter().enumerate() {
            let split = &self.split[own.split as usize];
            let corners = &mesh.tets[split.tet as usize];
            let triangle = triangles[own.triangle as usize].map(|v| {
                unit(corners.iter().position(|&corner| corner == v).expect("the face is one of the tet"))
            });
            self.walls(split).pieces(triangle, |part, piece| {
                if let Some(part) = part.filter(|_| part == own.part)
                    && let Some(copy) = self.copy_of(split, part)
                {
                    builder.push(number, piece, self.copies[copy].nodes);
                }
            });
        }
        builder.pieces
    }
}

pub(super) fn unit(corner: usize) -> Barycentric {
    std::array::from_fn(|axis| f64::from(u8::from(axis == corner)))
}

/// Collects simplices and their points.
pub(super) struct Builder<const N: usize> {
    nodes: usize,
    pub(super) pieces: Pieces<N>,
}

impl<const N: usize> Builder<N> {
    /// No simplices. Corners from `nodes` on are points.
    pub(super) fn new(nodes: usize) -> Self {
        Self { nodes, pieces: Pieces::default() }
    }

    /// Adds a piece of a copy with these nodes.
    pub(super) fn push(&mut self, copy: usize, piece: &[Barycentric; N], nodes: [u32; 4]) {
        let corners = piece.map(|at| self.corner(at, nodes));
        let distinct = (0..N).all(|a| (0..a).all(|b| corners[a] != corners[b]));
        if distinct {
            self.pieces.simplices.push(corners);
            self.pieces.copies.push(copy as u32);
        }
    }

    fn corner(&mut self, at: Barycentric, nodes: [u32; 4]) -> u32 {
        if let Some(corner) = (0..4).find(|&corner| at[corner] == 1.0) {
            return nodes[corner];
        }
        let point = Embedded { nodes, weights: at.map(|weight| weight as f32) };
        let first = self.pieces.points.len().saturating_sub(3 * N);
        let known = self.pieces.points[first..].iter().position(|other| *other == point);
        let number = known.map_or_else(
            || {
                self.pieces.points.push(point);
                self.pieces.points.len() - 1
            },
            |recent| first + recent,
        );
        (self.nodes + number) as u32
    }
}
