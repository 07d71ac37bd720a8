//! The lips of a cut of no width: the points where it cuts the edges of the skin.

use std::collections::HashMap;

use nalgebra::{Matrix3, Point3};

use super::pieces::Embedded;
use super::wound::{TriangleCopy, Wound};
use crate::TetMesh;

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

/// A lip point, and the end of its edge on its side if the tet there has no copy.
type Found = (LipPoint, Option<u32>);

impl Wound {
    /// The points of both lips of a blade: where it separates the ends of edges of the skin. At
    /// rest the two points of an edge are at one place. They are in the order of the edges.
    ///
    /// A part of a tet that is too thin for a copy moves with no tet of its own. Its point is then
    /// in the linear extension of another tet on the same side.
    pub fn lips(
        &self,
        mesh: &TetMesh,
        triangles: &[[u32; 3]],
        copies: &[TriangleCopy],
        blade: usize,
    ) -> Vec<LipPoint> {
        let mut found: Vec<Found> = Vec::new();
        for own in copies {
            let split = &self.split[own.split as usize];
            let Some(distances) = self.distances_to(split, blade) else { continue };
            let Some(own_part) = own.part else { continue };
            let Some(copy) = self.copy_of(split, own_part) else { continue };
            let nodes = self.copies[copy].nodes;
            let corners = &mesh.tets[split.tet as usize];
            let in_face = |corner: usize| triangles[own.triangle as usize].contains(&corners[corner]);
            for held in (0..4).filter(|&corner| in_face(corner) && split.parts[corner] == own_part) {
                let apart = |other: usize| {
                    split.parts[other] != own_part && (distances[held] >= 0.0) != (distances[other] >= 0.0)
                };
                for other in (0..4).filter(|&corner| in_face(corner) && apart(corner)) {
                    // The same weights for both lips.
                    let (low, high) =
                        if corners[held] < corners[other] { (held, other) } else { (other, held) };
                    let part = distances[low] / (distances[low] - distances[high]);
                    let mut weights = [0.0; 4];
                    weights[low] = 1.0 - part;
                    weights[high] = part;
                    let edge = [corners[low], corners[high]];
                    let right = distances[held] >= 0.0;
                    found.push((LipPoint { edge, right, at: Embedded { nodes, weights } }, None));
                    if self.copy_of(split, split.parts[other]).is_none() {
                        let at = Embedded { nodes: *corners, weights };
                        found.push((LipPoint { edge, right: !right, at }, Some(corners[other])));
                    }
                }
            }
        }
        found.sort_by_key(|(point, thin)| (point.edge, point.right, thin.is_some()));
        found.dedup_by_key(|(point, _)| (point.edge, point.right));
        let ends = found.iter().filter_map(|(_, thin)| *thin);
        let tets = self.tets_of(mesh, ends);
        let point = |(point, thin): Found| match thin {
            None => Some(point),
            Some(end) => {
                let &[tet, nodes] = tets.get(&end)?;
                let weights = barycentric(mesh, &tet, point.at.at(&mesh.positions))?;
                Some(LipPoint { at: Embedded { nodes, weights }, ..point })
            }
        };
        found.into_iter().filter_map(point).collect()
    }

    /// For some vertices a tet on their side of the cut, and its nodes. A vertex whose parts of all
    /// tets are too thin has none.
    fn tets_of(&self, mesh: &TetMesh, vertices: impl Iterator<Item = u32>) -> HashMap<u32, [[u32; 4]; 2]> {
        let mut wanted: Vec<u32> = vertices.collect();
        wanted.sort_unstable();
        wanted.dedup();
        let mut tets = HashMap::new();
        if wanted.is_empty() {
            return tets;
        }
        let is_wanted = |vertex: &u32| wanted.binary_search(vertex).is_ok();
        let mut divided: Vec<u32> = self.split.iter().map(|split| split.tet).collect();
        divided.sort_unstable();
        for (number, tet) in (0..).zip(&mesh.tets) {
            if tet.iter().any(is_wanted) && divided.binary_search(&number).is_err() {
                let ends = tet.iter().filter(|vertex| is_wanted(vertex));
                ends.for_each(|&vertex| _ = tets.entry(vertex).or_insert([*tet; 2]));
            }
        }
        for split in &self.split {
            let tet = &mesh.tets[split.tet as usize];
            for corner in (0..4).filter(|&corner| is_wanted(&tet[corner])) {
                if let Some(copy) = self.copy_of(split, split.parts[corner]) {
                    tets.entry(tet[corner]).or_insert([*tet, self.copies[copy].nodes]);
                }
            }
        }
        tets
    }
}

/// Barycentric coordinates of a place in a tet at rest. They are negative outside it.
fn barycentric(mesh: &TetMesh, tet: &[u32; 4], at: Point3<f32>) -> Option<[f32; 4]> {
    let [a, b, c, d] = tet.map(|v| mesh.positions[v as usize].cast::<f64>());
    let from_a = Matrix3::from_columns(&[b - a, c - a, d - a]).try_inverse()? * (at.cast() - a);
    let weights = [1.0 - from_a.sum(), from_a.x, from_a.y, from_a.z];
    Some(weights.map(|weight| weight as f32))
}
