//! The edges of the copies of divided tets.

use super::components::EDGES;
use super::severing::Severing;
use super::wound::{EdgeCopy, Wound};
use crate::TetMesh;

impl Severing {
    /// Finds the edges of the copies.
    pub(super) fn edges(&self, mesh: &TetMesh, wound: &mut Wound) {
        // Copies that are taken out have no nodes here.
        let mut all: Vec<([u32; 2], Option<[u32; 2]>, f64)> = Vec::new();
        for copy in &wound.copies {
            let corners = &mesh.tets[copy.tet as usize];
            for (a, b) in EDGES {
                let volume = mesh.edge_share(corners, [a, b]) * f64::from(copy.share);
                let (a, b) = if corners[a] < corners[b] { (a, b) } else { (b, a) };
                let nodes = copy.gone.is_none().then_some([copy.nodes[a], copy.nodes[b]]);
                all.push(([corners[a], corners[b]], nodes, volume));
            }
        }
        all.sort_by_key(|&(vertices, nodes, _)| (vertices, nodes));
        for edge in all.chunk_by(|a, b| a.0 == b.0) {
            let [low, high] = edge[0].0;
            wound.split_edges.push([low, high]);
            let whole = self.whole_volume(mesh, wound, [low, high]);
            let mut copies: Vec<([u32; 2], f64)> = edge
                .chunk_by(|a, b| a.1 == b.1)
                .filter_map(|same| Some((same[0].1?, same.iter().map(|(.., volume)| volume).sum())))
                .collect();
            if whole > 0.0 {
                match copies.iter_mut().find(|(nodes, _)| *nodes == [low, high]) {
                    Some((_, volume)) => *volume += whole,
                    None => copies.insert(0, ([low, high], whole)),
                }
            }
            wound.edges.extend(copies.into_iter().zip(0..).map(|((nodes, volume), number)| EdgeCopy {
                nodes,
                number,
                volume: volume as f32,
            }));
        }
    }

    /// Volume in m³ that an edge has from the whole tets around it.
    pub(super) fn whole_volume(&self, mesh: &TetMesh, wound: &Wound, [low, high]: [u32; 2]) -> f64 {
        let is_split = |tet: u32| wound.split.binary_search_by_key(&tet, |split| split.tet).is_ok();
        let mut whole = 0.0;
        self.index.around_edge(mesh.point(low), self.direction(mesh, low, high), |cell, tet| {
            let tet = self.index.position(cell, tet);
            if !is_split(tet) {
                let corners = &mesh.tets[tet as usize];
                let edge = EDGES
                    .into_iter()
                    .find(|&(a, b)| [corners[a].min(corners[b]), corners[a].max(corners[b])] == [low, high]);
                whole += edge.map_or(0.0, |(a, b)| mesh.edge_share(corners, [a, b]));
            }
        });
        whole
    }
}
