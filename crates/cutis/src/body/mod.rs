//! From the CT to the body at rest: lattice, tissue, skin, incisions, region of interest, handles.

mod build;
mod find_skin;
mod fixed;
mod handles;
mod lattice;
mod materials;
mod membrane;
mod region;
mod sections;

use cutis_mesh::{Cut, InactiveSkin, Removed, SkinReport, TetMesh};
use nalgebra::Point3;

use crate::scene::HandleSection;

pub use find_skin::{SkinRequest, find_skin};
pub(crate) use lattice::even_shape;
#[cfg(test)]
pub(crate) use lattice::lattice;
pub(crate) use materials::BodyMaterials;
pub(crate) use membrane::{Membrane, Tangent};
pub(crate) use sections::{BodySections, needs_skin};

/// HU below which a lattice point is air, unless a scene says otherwise: the HU at which opacity
/// begins to rise in the paper's table. A point with exactly this HU is tissue.
pub(crate) const AIR_BELOW_HU: f32 = -449.0;

/// Per lattice point: whether it is air. `hu` holds a value per point.
fn air(hu: &[f32], air_below_hu: f32) -> Vec<bool> {
    hu.iter().map(|&hu| hu < air_below_hu).collect()
}

/// The cut body at rest. Vertices keep their numbers through the cut. `mesh` and `skin` hold the
/// elements that the incisions left.
pub(crate) struct Body {
    pub(crate) mesh: TetMesh,
    /// Skin triangles in mesh vertices, oriented outward; empty if the scene does not need the
    /// skin.
    pub(crate) skin: Vec<[u32; 3]>,
    /// The skin outside the region of interest, which never moves.
    pub(crate) inactive_skin: InactiveSkin,
    /// HU at the positions of the inactive skin.
    pub(crate) inactive_hu: Vec<f32>,
    pub(crate) skin_report: Option<SkinReport>,
    pub(crate) cut: Cut,
    /// The elements that the incisions removed.
    pub(crate) removed: Removed,
    /// Normals and directions of the whole skin before the incisions; none if the scene has no
    /// constraint that needs them.
    pub(crate) membrane: Option<Membrane>,
    /// Vertices that each handle of the scene grabs, in ascending order.
    pub(crate) grabbed: Vec<Vec<u32>>,
    /// The material of each vertex; none if the scene has no table of materials.
    pub(crate) materials: Option<BodyMaterials>,
    /// Lumped masses before the cut, kg.
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

    /// The skin of the whole body: the given positions of the mesh's vertices, then the positions
    /// of the inactive skin; and all triangles.
    pub(crate) fn whole_skin(&self, positions: &[Point3<f32>]) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
        let inactive = &self.inactive_skin;
        ([positions, &inactive.positions].concat(), [self.skin.as_slice(), &inactive.triangles].concat())
    }

    /// The share of the tetrahedra that a region of interest of `around` mm would hold.
    pub(crate) fn share_around(&self, handles: &[HandleSection], around: f64) -> f64 {
        let mesh = &self.mesh;
        let near = |&local: &Point3<f32>| {
            region::near_action(handles, &self.cut.slits, local, mesh.frame.to_mm(local), around)
        };
        let inside: Vec<bool> = mesh.positions.iter().map(near).collect();
        let held = mesh.tets.iter().filter(|tet| tet.iter().any(|&vertex| inside[vertex as usize]));
        held.count() as f64 / mesh.tets.len().max(1) as f64
    }
}
