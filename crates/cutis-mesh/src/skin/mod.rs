//! Skin detection: selects the lattice triangles that are skin.

mod exterior;
mod paper;
mod report;

use serde::{Deserialize, Serialize};

pub use report::SkinReport;

use crate::component::{self, Largest};
use crate::surface::faces;
use crate::tissue_tets::TissueTets;
use crate::{HalfSpace, Lattice, MeshError};

/// The rule that selects the skin triangles.
///
/// In every mode, lattice points in half-spaces that are cut away count as air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SkinMode {
    /// The rule of the STC paper (Algorithm 2), taken literally: a tetrahedron with exactly one air
    /// corner gives the triangle of its other three corners.
    ///
    /// A triangle given by two tets is kept once. The result includes both sides of the scanner
    /// table, the lungs and the bowel. It is the surface of the `Boundary` mode plus stray sheets.
    /// A stray sheet is a triangle between two tets that both have an air corner, for example where
    /// tissue is one vertex thick.
    Paper,
    /// Every face between a tetrahedron with four tissue corners and another tetrahedron.
    ///
    /// Faces on the box of the lattice, where the scan ends, are not skin.
    Boundary,
    /// The faces of the body that touch outside air.
    ///
    /// The *body* is the largest face-connected component of tets with four tissue corners. A point
    /// is *outside* if it can be reached from the lateral sides of the box along lattice edges,
    /// through air and through the other components. Therefore the back of a patient who lies on
    /// the scanner table is skin.
    ///
    /// Lattice edges are the correct neighborhood, because air points are connected along them
    /// exactly where the space around the tissue is connected. The search does not start at the
    /// first and last slice, where the scan cuts open the lungs and the bowel.
    #[default]
    Exterior,
}

/// Options of skin detection in addition to the mode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinOptions {
    /// Half-spaces that count as air, for example below a plane between a body and the board it
    /// lies on.
    pub cut_away: Vec<HalfSpace>,
    /// Index axis (0, 1 or 2) along which the scan ends cut through the body. The two end faces do
    /// not count as outside. `None` selects the axis closest to the head–foot axis of the world.
    pub through_axis: Option<usize>,
}

/// The skin triangles of a lattice.
#[derive(Clone, Debug)]
pub struct Skin {
    /// Triangles in flat lattice indices, counterclockwise as seen from the air. Each occurs once,
    /// in lattice order.
    pub triangles: Vec<[u32; 3]>,
    /// Counts and quality of the skin.
    pub report: SkinReport,
}

/// Detects the skin of a lattice. `air` has one flag per lattice point, in grid order.
///
/// [`TissueMask::skin`](crate::TissueMask::skin) and
/// [`TetMesh::divide_skin`](crate::TetMesh::divide_skin) convert the triangles to vertices of a
/// mesh. [`TissueMask::find_with_skin`](crate::TissueMask::find_with_skin) finds body and skin
/// together.
///
/// ```
/// use cutis_mesh::{Lattice, SkinMode, SkinOptions, Split, skin};
/// use cutis_volume::{Affine, Grid};
/// let grid = Grid { shape: [7, 7, 7], affine: Affine::from_spacing([1.0; 3], [0.0; 3])? };
/// let inside = |p: [usize; 3]| p.iter().all(|c| (2..5).contains(c));
/// let air: Vec<bool> = (0..grid.len()).map(|point| !inside(grid.point(point))).collect();
/// let lattice = Lattice::new(grid, Split::Kuhn6)?;
/// let skin = skin::detect(&lattice, &air, SkinMode::Exterior, &SkinOptions::default())?;
/// assert_eq!((skin.triangles.len(), skin.report.open_edges, skin.report.euler_characteristic), (48, 0, 2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`MeshError::Length`] if `air` does not have one value per lattice point. [`MeshError::Plane`]
/// if a half-space is not valid. [`MeshError::Axis`] if the through axis is above 2.
pub fn detect(
    lattice: &Lattice,
    air: &[bool],
    mode: SkinMode,
    options: &SkinOptions,
) -> Result<Skin, MeshError> {
    let tissue = TissueTets::find(lattice, air, &options.cut_away)?;
    let body = component::largest(tissue.masks.clone());
    of_tissue(lattice, &tissue, &body, mode, options.through_axis)
}

/// The skin of tissue whose largest component is `body`.
pub(crate) fn of_tissue(
    lattice: &Lattice,
    tissue: &TissueTets,
    body: &Largest,
    mode: SkinMode,
    through_axis: Option<usize>,
) -> Result<Skin, MeshError> {
    if let Some(axis) = through_axis.filter(|&axis| axis > 2) {
        return Err(MeshError::Axis { axis });
    }
    let TissueTets { points, masks } = tissue;
    let literal = paper::count(lattice, points);
    let boundary_triangles =
        || faces(lattice, masks).into_iter().map(|face| face.triangle).collect::<Vec<_>>();
    let exterior = exterior::find(lattice, tissue, body, through_axis);
    let (triangles, considered) = match mode {
        SkinMode::Paper => (paper::triangles(lattice, points), None),
        SkinMode::Boundary => (boundary_triangles(), None),
        SkinMode::Exterior => (exterior.triangles.clone(), Some(boundary_triangles().len())),
    };
    let considered = considered.unwrap_or(triangles.len());
    let bodies = body.components;
    let report = report::report(lattice, mode, points, &triangles, considered, bodies, &literal, &exterior);
    Ok(Skin { triangles, report })
}
