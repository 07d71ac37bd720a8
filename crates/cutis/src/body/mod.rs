//! From the CT to the body at rest: lattice, tissue, skin, incisions, region of interest, handles.

mod build;
mod cut_error;
mod estimate;
mod find_skin;
mod fixed;
mod growing;
mod handles;
mod lattice;
mod materials;
mod membrane;
mod memory;
pub(crate) mod near_end;
mod no_skin;
mod region;
mod sections;
mod sutures;
mod thin;

use cutis_mesh::sever::{Embedded, Severed};
use cutis_mesh::{Cut, InactiveSkin, Removed, SkinReport, Stitch, TetMesh};
use nalgebra::Point3;

use crate::scene::{HandleSection, PickedRegion};

pub use find_skin::{SkinRequest, find_skin};
pub(crate) use growing::GrowingCuts;
pub(crate) use lattice::even_shape;
#[cfg(test)]
pub(crate) use lattice::lattice;
pub(crate) use materials::BodyMaterials;
pub(crate) use membrane::{Membrane, Tangent};
pub use no_skin::NoSkin;
pub(crate) use no_skin::offset_warning;
pub(crate) use sections::{BodySections, needs_skin, smooth_skin};

/// HU below which a lattice point is air, unless a scene says otherwise: the HU at which opacity
/// begins to rise in the paper's table. A point with exactly this HU is tissue.
pub(crate) const AIR_BELOW_HU: f32 = -449.0;

/// Per lattice point: whether it is air. `hu` holds a value per point.
fn air(hu: &[f32], air_below_hu: f32) -> Vec<bool> {
    hu.iter().map(|&hu| hu < air_below_hu).collect()
}

/// The cut body at rest. Vertices keep their numbers through the cut. `mesh` and `skin` hold the
/// elements that the incisions left, and copies along cuts of no width.
pub(crate) struct Body {
    pub(crate) mesh: TetMesh,
    /// Skin triangles in mesh vertices, oriented outward; empty if the scene does not need the
    /// skin.
    pub(crate) skin: Vec<[u32; 3]>,
    /// The skin before cuts of no width divide it; empty if no piece is taken out.
    skin_before_pieces: Vec<[u32; 3]>,
    /// The skin outside the region of interest, which never moves.
    pub(crate) inactive_skin: InactiveSkin,
    /// HU at the positions of the inactive skin.
    pub(crate) inactive_hu: Vec<f32>,
    pub(crate) skin_report: Option<SkinReport>,
    pub(crate) cut: Cut,
    /// The elements that the incisions removed.
    pub(crate) removed: Removed,
    /// What cuts of no width changed; none if the scene has none.
    pub(crate) severed: Option<Severed>,
    /// What is known about the region of interest if the program picked it.
    pub(crate) picked_region: Option<PickedRegion>,
    /// Numbers of the blades whose sides never come apart.
    pub(crate) adhering_blades: Vec<u32>,
    /// The cuts that are made while the body moves; none if the scene has none.
    pub(crate) growing: Option<GrowingCuts>,
    /// Volumes of the parts of the body that its cuts separate from the largest one, ml.
    pub(crate) free_pieces_ml: Vec<f64>,
    /// The stitches of each suture of the scene.
    pub(crate) stitches: Vec<Vec<Stitch>>,
    /// Normals and directions of the whole skin before the incisions; none if the scene has no
    /// constraint that needs them.
    pub(crate) membrane: Option<Membrane>,
    /// Vertices that each handle of the scene grabs, in ascending order.
    pub(crate) grabbed: Vec<Vec<u32>>,
    /// The material of each vertex; none if the scene has no table of materials.
    pub(crate) materials: Option<BodyMaterials>,
    /// Lumped masses, kg. Incisions that remove tissue do not change them.
    masses: Vec<f32>,
    /// Per lattice point: whether it is air.
    pub(crate) air: Vec<bool>,
    pub(crate) warnings: Vec<String>,
}

impl Body {
    /// Whether an incision removed the vertex from all constraints.
    pub(crate) fn is_removed(&self, vertex: u32) -> bool {
        self.cut.removed[vertex as usize]
    }

    /// Which blades of [`Body::severed`] have cut to their ends at a time in s.
    pub(crate) fn finished_cuts(&self, time_s: f64) -> Vec<bool> {
        let all = self.severed.as_ref().map_or(0, |severed| severed.blades.len());
        self.growing.as_ref().map_or(vec![true; all], |growing| growing.finished(time_s))
    }

    /// HU at the positions of [`Body::whole_skin`].
    pub(crate) fn whole_skin_hu(&self) -> Vec<f32> {
        let edges = self.severed.as_ref().map(|severed| self.hu_at(&severed.skin_pieces.points));
        [self.mesh.hu.as_slice(), &self.inactive_hu, &edges.unwrap_or_default()].concat()
    }

    /// HU at the positions of [`Body::whole_tissue`].
    pub(crate) fn whole_tissue_hu(&self) -> Vec<f32> {
        let walls = self.severed.as_ref().map(|severed| self.hu_at(&severed.tet_pieces.points));
        [self.mesh.hu.as_slice(), &walls.unwrap_or_default()].concat()
    }

    fn hu_at(&self, points: &[Embedded]) -> Vec<f32> {
        let hu = |point: &Embedded| {
            point
                .nodes
                .iter()
                .zip(point.weights)
                .map(|(&node, weight)| self.mesh.hu[node as usize] * weight)
                .sum()
        };
        points.iter().map(hu).collect()
    }

    /// Number of vertices that the incisions removed from all constraints.
    pub(crate) fn removed_vertices(&self) -> usize {
        self.cut.removed.iter().filter(|&&removed| removed).count()
    }

    /// Largest displacement of a vertex next to the border of the region of interest, mm. None
    /// without a region that leaves something out.
    pub(crate) fn border_displacement_mm(&self, deformed: &[Point3<f32>]) -> Option<f64> {
        let inactive = self.mesh.inactive.as_ref().filter(|inactive| inactive.tets > 0)?;
        let at_border = |tet: &&[u32; 4]| tet.iter().any(|&v| inactive.border[v as usize]);
        let moved =
            |&v: &u32| f64::from((deformed[v as usize] - self.mesh.positions[v as usize]).norm()) * 1e3;
        Some(self.mesh.tets.iter().filter(at_border).flatten().map(moved).fold(0.0, f64::max))
    }

    /// Share of its area that a triangle of the cut skin holds: 1 but for a copy along a cut of no
    /// width.
    pub(crate) fn skin_share(&self, triangle: usize) -> f64 {
        let Some(severed) = &self.severed else { return 1.0 };
        let whole = self.skin.len() - severed.copies.len();
        triangle.checked_sub(whole).map_or(1.0, |copy| f64::from(severed.copies[copy].share))
    }

    /// The skin of the whole body as it looks: the given positions of the mesh's vertices, then
    /// those of the inactive skin and of the edges of cuts; and all triangles.
    pub(crate) fn whole_skin(&self, positions: &[Point3<f32>]) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
        let inactive = &self.inactive_skin;
        let Some(severed) = &self.severed else {
            let triangles = [self.skin.as_slice(), &inactive.triangles].concat();
            return ([positions, &inactive.positions].concat(), triangles);
        };
        let vertices = self.mesh.positions.len() as u32;
        let behind = inactive.positions.len() as u32;
        let corner = |v: u32| if v < vertices { v } else { v + behind };
        let pieces = severed.skin_pieces.simplices.iter().map(|piece| piece.map(corner));
        let triangles = self.whole_triangles().iter().chain(&inactive.triangles).copied().chain(pieces);
        let edges = embedded(&severed.skin_pieces.points, positions);
        ([positions, &inactive.positions, &edges].concat(), triangles.collect())
    }

    /// The whole skin at rest before the first frame: positions and triangles. A piece that is
    /// taken out later is in its place. If a piece is out from the start, none is in its place.
    pub(crate) fn skin_at_start(&self) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
        let finished = self.finished_cuts(0.0);
        // The blades of pieces come last, two for each.
        let pieces = &finished[finished.len() - 2 * self.cut.pieces.len()..];
        if pieces.is_empty() || pieces.contains(&true) {
            return self.whole_skin(&self.mesh.positions);
        }
        let InactiveSkin { positions, triangles, .. } = &self.inactive_skin;
        let positions = [self.mesh.positions.as_slice(), positions].concat();
        (positions, [self.skin_before_pieces.as_slice(), triangles].concat())
    }

    /// The skin triangle in the scan of which each triangle of [`Body::whole_skin`] is a part.
    pub(crate) fn skin_in_scan(&self) -> Vec<[u32; 3]> {
        let pieces = self.severed.iter().flat_map(|severed| {
            let copies = severed.skin_pieces.copies.iter().map(|&copy| &severed.copies[copy as usize]);
            copies.map(|copy| severed.triangles[copy.triangle as usize])
        });
        self.whole_triangles().iter().chain(&self.inactive_skin.triangles).copied().chain(pieces).collect()
    }

    /// The skin triangles that are no copies.
    pub(crate) fn whole_triangles(&self) -> &[[u32; 3]] {
        &self.skin[..self.skin.len() - self.severed.as_ref().map_or(0, |severed| severed.copies.len())]
    }

    /// The tissue as it looks: the given positions of the mesh's vertices, then those of points on
    /// the walls of cuts; and all tetrahedra.
    pub(crate) fn whole_tissue(&self, positions: &[Point3<f32>]) -> (Vec<Point3<f32>>, Vec<[u32; 4]>) {
        let Some(severed) = &self.severed else { return (positions.to_vec(), self.mesh.tets.clone()) };
        let whole = &self.mesh.tets[..self.mesh.whole_tets()];
        let walls = embedded(&severed.tet_pieces.points, positions);
        ([positions, &walls].concat(), [whole, &severed.tet_pieces.simplices].concat())
    }

    /// The share of the tetrahedra that a region of interest of `around` mm would hold.
    pub(crate) fn share_around(&self, handles: &[HandleSection], around: f64) -> f64 {
        let mesh = &self.mesh;
        let near = |&local: &Point3<f32>| {
            let from_cuts = self.cut.distance_mm(local);
            region::near_action(handles, from_cuts, mesh.frame.to_mm(local), around)
        };
        let inside: Vec<bool> = mesh.positions.iter().map(near).collect();
        let held = mesh.tets.iter().filter(|tet| tet.iter().any(|&vertex| inside[vertex as usize]));
        held.count() as f64 / mesh.tets.len().max(1) as f64
    }
}

/// Positions of points that move with vertices. None without positions of the vertices.
fn embedded(points: &[Embedded], positions: &[Point3<f32>]) -> Vec<Point3<f32>> {
    if positions.is_empty() { Vec::new() } else { points.iter().map(|point| point.at(positions)).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Override;
    use crate::ct::source;

    /// Area in cm² of the skin before the first frame and of the whole skin, with and without an
    /// excision.
    fn areas(excision: &str) -> [f64; 2] {
        let keys = [
            ("volume.phantom", "{ size = [48, 48, 32], seed = 1 }"),
            ("lattice.spacing_mm", "12.0"),
            ("incision", "[]"),
            ("excision", excision),
        ];
        let set = keys.map(|(key, value)| Override { key: key.into(), value: value.into() });
        let loaded = crate::demo(&set).unwrap();
        let body = Body::build(&BodySections::of(&loaded), &source::load(&loaded).unwrap().volume).unwrap();
        let area = |(positions, triangles): (Vec<Point3<f32>>, Vec<[u32; 3]>)| {
            let of = |triangle: &[u32; 3]| {
                let [a, b, c] = triangle.map(|v| positions[v as usize].cast::<f64>());
                (b - a).cross(&(c - a)).norm() / 2.0
            };
            triangles.iter().map(of).sum::<f64>() * 1e4
        };
        [area(body.skin_at_start()), area(body.whole_skin(&body.mesh.positions))]
    }

    #[test]
    fn the_skin_at_the_start_has_the_piece_that_is_taken_out_later() {
        let outline = "[[-40, 110, -40], [40, 110, -40], [40, 110, 40], [-40, 110, 40], [-40, 110, -40]]";
        let piece = |time: &str| format!("[{{ path_mm = {outline}, depth_mm = 40{time} }}]");
        let [uncut, whole] = areas("[]");
        assert!((uncut - whole).abs() < 1e-6 * whole, "{uncut} and {whole} cm²");
        let [later, without] = areas(&piece(", at_s = 0.01"));
        assert!((later - uncut).abs() < 1e-6 * uncut, "{later} cm² of {uncut} cm²");
        assert!(without < uncut - 50.0, "the piece has 64 cm² and more: {without} cm² of {uncut} cm²");
        let [out, at_rest] = areas(&piece(""));
        assert!((out - at_rest).abs() < 1e-6 * out && out < uncut - 50.0, "{out} cm²");
    }
}
