//! Cuts of no width in a chain: the links that they cut, and the positions along them.

use cutis_mesh::TetMesh;
use cutis_mesh::sever::{AxisEdge, VirtualNode};
use nalgebra::Vector3;

use crate::body::GrowingCuts;

/// The state of the cuts of no width of a chain. It depends only on how far each blade has come.
pub(super) struct ChainWound<'a> {
    cuts: &'a GrowingCuts,
    /// How far each blade has come, m.
    reached: Vec<f64>,
    /// Number of edges along the axes that each blade has severed.
    severed: Vec<usize>,
    /// Number of vertices of the mesh that are not virtual.
    real: usize,
    /// The other vertices.
    virtual_nodes: Vec<VirtualNode>,
}

impl<'a> ChainWound<'a> {
    /// The wound before its cuts are made. `mesh` is divided along them.
    pub(super) fn new(cuts: &'a GrowingCuts, mesh: &TetMesh) -> Self {
        let blades = cuts.growth.axis_edges().len();
        let reached = vec![0.0; blades];
        let virtual_nodes = cuts.growth.virtual_nodes(&reached);
        debug_assert!((mesh.real_vertices() as u32..).zip(&virtual_nodes).all(|(v, node)| node.node == v));
        Self { cuts, reached, severed: vec![0; blades], real: mesh.real_vertices(), virtual_nodes }
    }

    /// Brings the cuts to where they are at a time in s, and returns the edges along the axes that
    /// they sever on the way.
    pub(super) fn cut_to(&mut self, time_s: f64) -> Vec<AxisEdge> {
        let reached = self.cuts.reached(time_s);
        if reached == self.reached {
            return Vec::new();
        }
        let mut new = Vec::new();
        let blades = self.cuts.growth.axis_edges().iter().zip(&reached).zip(&mut self.severed);
        for ((edges, &reached), severed) in blades {
            // A blade that has not begun severs nothing, not even at the start of its path.
            let end = if reached > 0.0 { edges.partition_point(|edge| edge.at <= reached) } else { 0 };
            new.extend(edges.get(*severed..end).unwrap_or_default());
            *severed = end.max(*severed);
        }
        self.virtual_nodes = self.cuts.growth.virtual_nodes(&reached);
        self.reached = reached;
        new
    }

    /// Displacement of a virtual vertex, from those of the others. None if the vertex is not
    /// virtual.
    pub(super) fn displacement(&self, vertex: u32, of: impl Fn(u32) -> Vector3<f64>) -> Option<Vector3<f64>> {
        let node = self.virtual_nodes.get((vertex as usize).checked_sub(self.real)?)?;
        Some(node.displacement(of))
    }
}
