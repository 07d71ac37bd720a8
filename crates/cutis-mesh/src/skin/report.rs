//! Counts and quality of a detected skin: topology, enclosed share and coverage.

use serde::{Deserialize, Serialize};

use super::SkinMode;
use super::exterior::Exterior;
use super::paper::AirCorners;
use crate::Lattice;
use crate::neighbors::Neighbors;
use crate::surface::Topology;

/// Counts and quality of a detected skin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SkinReport {
    /// Mode of the detection.
    pub mode: SkinMode,
    /// Number of lattice points.
    pub vertices: usize,
    /// Number of lattice tets.
    pub tets: usize,
    /// Number of tets with 0, 1, 2, 3 and 4 air corners.
    pub air_vertex_histogram: [usize; 5],
    /// Number of skin triangles.
    pub triangles: usize,
    /// Number of triangles that two tets give by the literal rule. 0 in the other modes, which find
    /// each triangle once.
    pub duplicates: usize,
    /// Number of edges of exactly one triangle.
    pub open_edges: usize,
    /// Number of open edges that are in a side of the box of the lattice, where the scan ends.
    pub open_edges_on_box: usize,
    /// Number of edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Number of parts of the skin that share no vertex.
    pub components: usize,
    /// Vertices − edges + triangles. It is 2 for a closed surface without handles.
    pub euler_characteristic: i64,
    /// Number of face-connected components of the tets with four tissue corners. The largest is the
    /// body.
    pub bodies: usize,
    /// Share of the triangles that are not exterior skin: lungs, bowel and table. In the `exterior`
    /// mode, which has no such triangles, it refers to the triangles of the `boundary` mode. 0 if
    /// there are no triangles.
    pub enclosed_share: f64,
    /// Share of the iso-surface between tissue and outside air that has skin, from 0 to 1.
    ///
    /// The iso-surface crosses the lattice edges between an outside air point and a tissue point.
    /// Of these edges, those count whose tissue point is a vertex of the body, or is next to such a
    /// vertex and in no tet. The coverage is the share of them whose tissue point is a vertex of
    /// the skin. Uncovered tissue is thinner than a lattice step. The coverage is 1 if there is no
    /// such edge.
    pub coverage: f64,
}

pub(super) fn report(
    lattice: &Lattice,
    mode: SkinMode,
    tissue: &[bool],
    triangles: &[[u32; 3]],
    considered: usize,
    bodies: usize,
    literal: &AirCorners,
    exterior: &Exterior,
) -> SkinReport {
    let topology = Topology::of(triangles);
    let found = if mode == SkinMode::Paper { literal.air_vertex_histogram[1] } else { triangles.len() };
    let share = |part: usize, whole: usize| if whole == 0 { None } else { Some(part as f64 / whole as f64) };
    SkinReport {
        mode,
        vertices: lattice.grid().len(),
        tets: lattice.tet_count(),
        air_vertex_histogram: literal.air_vertex_histogram,
        triangles: triangles.len(),
        duplicates: found - triangles.len(),
        open_edges: topology.open_edges.len(),
        open_edges_on_box: topology.open_edges.iter().filter(|edge| on_box(lattice, edge)).count(),
        non_manifold_edges: topology.non_manifold_edges,
        components: topology.components,
        euler_characteristic: topology.euler_characteristic,
        bodies,
        enclosed_share: share(considered - exterior.triangles.len(), considered).unwrap_or(0.0),
        coverage: coverage(lattice, tissue, triangles, exterior),
    }
}

/// True if both ends are in the same side of the box.
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
