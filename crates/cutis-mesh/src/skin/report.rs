//! What a detected skin is worth: counts, topology, enclosed share, coverage.

use serde::{Deserialize, Serialize};

use super::SkinMode;
use super::exterior::Exterior;
use super::paper::Count;
use crate::Lattice;
use crate::neighbors::Neighbors;
use crate::surface::Topology;

/// Counts and quality of a detected skin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SkinReport {
    /// How it was detected.
    pub mode: SkinMode,
    /// Points of the lattice.
    pub vertices: usize,
    /// Tets of the lattice, tissue or not.
    pub tets: usize,
    /// Tets with 0, 1, 2, 3 and 4 air corners.
    pub air_vertex_histogram: [usize; 5],
    /// Triangles found, each counted once.
    pub triangles: usize,
    /// Triangles that the literal rule gives twice: the tets with one air corner, less the different triangles they give. 0 in the other modes,
    /// which find each triangle once.
    pub duplicates: usize,
    /// Edges of exactly one triangle.
    pub open_edges: usize,
    /// Those of them that lie in a side of the lattice's box, where the scan ends.
    pub open_edges_on_box: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Parts of the skin that share no vertex.
    pub components: usize,
    /// Vertices − edges + triangles of the skin: 2 for a closed surface without handles.
    pub euler_characteristic: i64,
    /// Face-connected components of all-tissue tets; the largest is the body.
    pub bodies: usize,
    /// Share of triangles that are not the body's exterior skin: lungs, bowel, table. Among the triangles of the mode; in `exterior` mode, which
    /// has none, among those of the `boundary` mode. 0 if there are none.
    pub enclosed_share: f64,
    /// How much of the iso-surface between tissue and outside air has skin on it, from 0 to 1.
    ///
    /// The iso-surface crosses the lattice edges that join an outside air point with a tissue point. Of those whose tissue point is a vertex of
    /// the body, or is next to one and in no tet, this is the share whose tissue point is a vertex of the skin. What is missing is thinner
    /// than a lattice step. 1 if there is no such edge.
    pub coverage: f64,
}

pub(super) fn report(
    lattice: &Lattice,
    mode: SkinMode,
    tissue: &[bool],
    triangles: &[[u32; 3]],
    considered: usize,
    literal: &Count,
    exterior: &Exterior,
) -> SkinReport {
    let topology = Topology::of(triangles);
    let emitted = if mode == SkinMode::Paper { literal.air_vertex_histogram[1] } else { triangles.len() };
    let share = |part: usize, whole: usize| if whole == 0 { None } else { Some(part as f64 / whole as f64) };
    SkinReport {
        mode,
        vertices: lattice.grid().len(),
        tets: lattice.tet_count(),
        air_vertex_histogram: literal.air_vertex_histogram,
        triangles: triangles.len(),
        duplicates: emitted - triangles.len(),
        open_edges: topology.open_edges.len(),
        open_edges_on_box: topology.open_edges.iter().filter(|edge| on_box(lattice, edge)).count(),
        non_manifold_edges: topology.non_manifold_edges,
        components: topology.components,
        euler_characteristic: topology.euler_characteristic,
        bodies: exterior.bodies,
        enclosed_share: share(considered - exterior.triangles.len(), considered).unwrap_or(0.0),
        coverage: coverage(lattice, tissue, triangles, exterior),
    }
}

/// True if both ends lie in one side of the box.
fn on_box(lattice: &Lattice, edge: &[u32; 2]) -> bool {
    let [p, q] = edge.map(|point| lattice.grid().point(point as usize));
    let shape = lattice.grid().shape;
    (0..3).any(|axis| p[axis] == q[axis] && (p[axis] == 0 || p[axis] == shape[axis] - 1))
}

fn coverage(lattice: &Lattice, tissue: &[bool], triangles: &[[u32; 3]], exterior: &Exterior) -> f64 {
    let mut on_skin = vec![false; lattice.grid().len()];
    triangles.iter().flatten().for_each(|&point| on_skin[point as usize] = true);
    let neighbors = Neighbors::new(lattice);
    let (mut crossings, mut covered) = (0usize, 0usize);
    for (point, _) in exterior.attached.iter().enumerate().filter(|(_, attached)| **attached) {
        neighbors.of(point, |neighbor| {
            let crosses = exterior.outside[neighbor] && !tissue[neighbor];
            crossings += usize::from(crosses);
            covered += usize::from(crosses && on_skin[point]);
        });
    }
    if crossings == 0 { 1.0 } else { covered as f64 / crossings as f64 }
}
