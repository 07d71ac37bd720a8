//! Where the virtual nodes of a wound are in a model that moves only the vertices of the mesh.

use nalgebra::Vector3;

use super::{AxisEdge, Growth};

/// A virtual node of a wound at some stage, for a model that knows no virtual nodes.
///
/// A virtual node continues the tissue on one side of a cut beyond the cut, to the lattice point of
/// a vertex on the other side. It moves as the corners on its own side do: by their mean
/// displacement. These are the corners of all copies with this node that are in the part of the
/// copy.
///
/// Where a blade has not separated the node yet, it moves with the vertex at its lattice point, so
/// that nothing is torn before it is cut. In between, while the blade passes the tets with this
/// node, it moves in part with the one and in part with the others. Its share is that of the tet
/// that is cut least. So it does not jump when the cut grows, and a wound ends in a tip.
#[derive(Clone, Debug, PartialEq)]
pub struct VirtualNode {
    /// Number of the node in the divided mesh.
    pub node: u32,
    /// The vertex at its lattice point.
    pub vertex: u32,
    /// How far it has been separated from that vertex: from 0, not at all, to 1.
    pub share: f64,
    /// The vertices on its own side of the cut, ascending. Empty if the share is 0.
    pub own_side: Vec<u32>,
}

impl VirtualNode {
    /// The displacement of the node. `of` gives those of vertices, in any unit.
    ///
    /// If all have the same displacement, and sums of it are exact, it is exactly this one.
    pub fn displacement(&self, of: impl Fn(u32) -> Vector3<f64>) -> Vector3<f64> {
        let here = of(self.vertex);
        if self.own_side.is_empty() {
            return here;
        }
        let sum = self.own_side.iter().fold(Vector3::zeros(), |sum, &vertex| sum + of(vertex));
        here + (sum / self.own_side.len() as f64 - here) * self.share
    }
}

impl Growth {
    /// For each blade, the edges along the axes of the lattice that the whole blade severs, in the
    /// order in which it severs them.
    pub fn axis_edges(&self) -> &[Vec<AxisEdge>] {
        &self.axis_edges
    }

    /// The virtual nodes in ascending order, after each blade has cut up to a length in m along its
    /// path. They are all vertices of the divided mesh that are not vertices of the mesh.
    ///
    /// # Panics
    /// If there is not one length per blade.
    pub fn virtual_nodes(&self, reached: &[f64]) -> Vec<VirtualNode> {
        let cuts = self.cuts(reached);
        let roots = self.roots(&cuts);
        let mut vertex_of: Vec<usize> = (0..self.nodes.len()).collect();
        for tet in &self.tets {
            for (_, nodes) in tet.copies.iter().flatten() {
                for (&node, &corner) in nodes.iter().zip(&tet.corners) {
                    vertex_of[node as usize] = corner as usize;
                }
            }
        }
        // Least share and own side of each virtual node that is not one with a lower node.
        let mut sides = vec![(1.0_f64, Vec::new()); self.nodes.len()];
        for (tet, cut) in self.tets.iter().zip(&cuts) {
            let Some((share, groups)) = cut else { continue };
            for (part, (_, nodes)) in
                tet.copies.iter().enumerate().filter_map(|(n, copy)| Some((n, (*copy)?)))
            {
                let is_own = |corner: &usize| groups[usize::from(tet.parts[*corner])] == groups[part];
                let own = (0..4).filter(is_own).map(|corner| self.nodes[tet.corners[corner] as usize]);
                for root in nodes.map(|node| roots[node as usize]) {
                    if vertex_of[root] != root {
                        let (least, side) = &mut sides[root];
                        *least = least.min(*share);
                        side.extend(own.clone());
                    }
                }
            }
        }
        for (_, side) in &mut sides {
            side.sort_unstable();
            side.dedup();
        }
        let node = |n: usize| {
            let (share, own_side) = sides[roots[n]].clone();
            let share = if own_side.is_empty() { 0.0 } else { share };
            VirtualNode { node: self.nodes[n], vertex: self.nodes[vertex_of[n]], share, own_side }
        };
        (0..self.nodes.len()).filter(|&n| vertex_of[n] != n).map(node).collect()
    }
}
