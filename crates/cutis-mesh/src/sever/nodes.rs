//! The nodes of the copies of divided tets.

use std::collections::HashMap;

use super::divide::Divided;
use super::severing::Severing;
use super::wound::Wound;
use crate::TetMesh;

impl Severing {
    /// Finds the nodes of the copies. Copies on both sides of a face share its three corners where
    /// a part of the face belongs to both.
    pub(super) fn join(&self, mesh: &TetMesh, divided: &[Divided], wound: &mut Wound) {
        let position: HashMap<u32, usize> = divided.iter().enumerate().map(|(n, d)| (d.tet, n)).collect();
        let mut vertices: Vec<u32> = divided.iter().flat_map(|d| mesh.tets[d.tet as usize]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let real = |vertex: u32| vertices.partition_point(|&v| v < vertex);
        // Real nodes first, so that each class with a real node has it as its root.
        let mut classes = Classes::new(vertices.len() + 4 * wound.copies.len());
        let slot = |copy: usize, corner: usize| vertices.len() + 4 * copy + corner;
        let copy_of = |n: usize, part: u8| wound.copy_of(&wound.split[n], part);
        for (copy, own) in wound.copies.iter().enumerate().filter(|(_, copy)| copy.whole) {
            (0..4).for_each(|corner| classes.join(slot(copy, corner), real(own.nodes[corner])));
        }
        for (n, tet) in divided.iter().enumerate() {
            let corners = &mesh.tets[tet.tet as usize];
            for corner in 0..4 {
                if let Some(copy) = copy_of(n, tet.parts[corner]) {
                    classes.join(slot(copy, corner), real(corners[corner]));
                }
            }
            for face in 0..4 {
                let Some((cell, number)) = self.index.across(tet.cell, tet.number, face) else { continue };
                let other = position.get(&self.index.position(cell, number));
                let in_face = (0..4).filter(|&corner| corner != face);
                // Each corner of the face names the copies that contain it on both sides.
                for named in in_face.clone() {
                    let Some(copy) = copy_of(n, tet.parts[named]) else { continue };
                    let Some(&other) = other else {
                        in_face
                            .clone()
                            .for_each(|corner| classes.join(slot(copy, corner), real(corners[corner])));
                        continue;
                    };
                    let there = &mesh.tets[divided[other].tet as usize];
                    let place = |corner: usize| there.iter().position(|&v| v == corners[corner]);
                    let part = place(named).map(|p| divided[other].parts[p]);
                    let Some(across) = part.and_then(|part| copy_of(other, part)) else { continue };
                    for corner in in_face.clone() {
                        if let Some(place) = place(corner) {
                            classes.join(slot(copy, corner), slot(across, place));
                        }
                    }
                }
            }
        }
        // Virtual nodes are numbered by lattice point, then by their lowest slot.
        let mut roots: Vec<(u32, usize)> = Vec::new();
        for (copy, own) in wound.copies.iter().enumerate() {
            for corner in 0..4 {
                let root = classes.root(slot(copy, corner));
                if root == slot(copy, corner) {
                    roots.push((mesh.tets[own.tet as usize][corner], root));
                }
            }
        }
        roots.sort_unstable();
        let number: HashMap<usize, u32> = roots
            .iter()
            .enumerate()
            .map(|(n, &(_, root))| (root, (mesh.positions.len() + n) as u32))
            .collect();
        for (copy, own) in wound.copies.iter_mut().enumerate() {
            own.nodes = std::array::from_fn(|corner| {
                let root = classes.root(slot(copy, corner));
                vertices.get(root).copied().unwrap_or_else(|| number[&root])
            });
        }
        wound.virtual_nodes = roots.into_iter().map(|(vertex, _)| vertex).collect();
    }
}

/// Disjoint sets whose root is their lowest element.
pub(crate) struct Classes(Vec<usize>);

impl Classes {
    pub(crate) fn new(size: usize) -> Self {
        Self((0..size).collect())
    }

    pub(crate) fn root(&mut self, mut element: usize) -> usize {
        while self.0[element] != element {
            self.0[element] = self.0[self.0[element]];
            element = self.0[element];
        }
        element
    }

    pub(crate) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}
