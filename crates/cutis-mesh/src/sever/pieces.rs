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

    /// The parts of all divided tets as tets.
    pub fn tet_pieces(&self, mesh: &TetMesh) -> Pieces<4> {
        let mut builder = Builder::new(self.nodes(mesh));
        for split in &self.split {
            let corners = [0, 1, 2, 3].map(unit);
            self.walls(split).pieces(corners, |part, piece| {
                if let Some(copy) = self.copy_of(split, part) {
                    builder.push(copy, piece, self.copies[copy].nodes);
                }
            });
        }
        builder.pieces
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
                if Some(part) == own.part
                    && let Some(copy) = self.copy_of(split, part)
                {
                    builder.push(number, piece, self.copies[copy].nodes);
                }
            });
        }
        builder.pieces
    }
}

/// A point of the skin where a blade cuts an edge, on one side of the cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LipPoint {
    /// The edge, in vertices of the mesh, the lower one first.
    pub edge: [u32; 2],
    /// True on the positive side of the blade.
    pub right: bool,
    /// The point.
    pub at: Embedded,
}

impl Wound {
    /// The points of both lips of a blade: where it separates the ends of edges of the skin. At
    /// rest the two points of an edge are at one place. They are in the order of the edges.
    pub fn lips(
        &self,
        mesh: &TetMesh,
        triangles: &[[u32; 3]],
        copies: &[TriangleCopy],
        blade: usize,
    ) -> Vec<LipPoint> {
        let mut points = Vec::new();
        for own in copies {
            let split = &self.split[own.split as usize];
            let Some(distances) = self.distances_to(split, blade) else { continue };
            let Some(own_part) = own.part else { continue };
            let corners = &mesh.tets[split.tet as usize];
            let nodes = self.copy_of(split, own_part).map(|copy| self.copies[copy].nodes);
            let in_face = |corner: usize| triangles[own.triangle as usize].contains(&corners[corner]);
            for held in (0..4).filter(|&corner| in_face(corner) && split.parts[corner] == own_part) {
                let apart = |other: usize| {
                    split.parts[other] != own_part && (distances[held] >= 0.0) != (distances[other] >= 0.0)
                };
                for other in (0..4).filter(|&corner| in_face(corner) && apart(corner)) {
                    let Some(nodes) = nodes else { continue };
                    // The same weights for both lips.
                    let (low, high) =
                        if corners[held] < corners[other] { (held, other) } else { (other, held) };
                    let part = distances[low] / (distances[low] - distances[high]);
                    let mut weights = [0.0; 4];
                    weights[low] = 1.0 - part;
                    weights[high] = part;
                    let edge = [corners[low], corners[high]];
                    let right = distances[held] >= 0.0;
                    points.push(LipPoint { edge, right, at: Embedded { nodes, weights } });
                    // A blade through lattice points leaves the part behind them without a volume.
                    // There the lip is the skin of the whole tets, which has the same corner.
                    if self.copy_of(split, split.parts[other]).is_none() {
                        let at = Embedded { nodes: *corners, weights };
                        points.push(LipPoint { edge, right: !right, at });
                    }
                }
            }
        }
        points.sort_by_key(|point| (point.edge, point.right));
        points.dedup_by_key(|point| (point.edge, point.right));
        points
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
