//! Skin detection: which triangles of the lattice are skin.

mod exterior;
mod paper;
mod report;

use serde::{Deserialize, Serialize};

pub use report::SkinReport;

use crate::build::NO_VERTEX;
use crate::cells::CellMasks;
use crate::select::{HalfSpace, present};
use crate::surface::faces;
use crate::{Lattice, MeshError, TetMesh};

/// What counts as skin. Lattice points in `cut_away` half-spaces count as air in every mode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SkinMode {
    /// The rule of the STC paper (Algorithm 2), taken literally: a tet with exactly one air corner gives the triangle of its other three
    /// corners. Triangles that two tets give are kept once.
    ///
    /// This holds both sides of the scanner table, the lungs and the bowel. It is the `Boundary` mode's surface plus stray sheets: triangles
    /// between two tets neither of which is all tissue, as where tissue is one vertex thick.
    Paper,
    /// Every face between an all-tissue tet and another tet. Faces on the box of the lattice, where the scan ends, are not skin.
    Boundary,
    /// The faces of the body that touch outside air.
    ///
    /// *Body*: the largest face-connected component of all-tissue tets. *Outside*: points reached from the lateral sides of the box over
    /// lattice edges, through air and through the other components (a scanner table does not shade the back that lies on it).
    /// Lattice edges are the right neighborhood here: the air points and edges left over by the tissue's complex are connected exactly
    /// where the space around that complex is. The flood does not start at the first and last slice, which open lungs and bowel.
    #[default]
    Exterior,
}

/// Choices beside the mode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinOptions {
    /// Half-spaces that count as air; a plane between a body and the board it lies on, for instance.
    pub cut_away: Vec<HalfSpace>,
    /// Index axis (0, 1 or 2) along which the scan cuts through the body, so that its two end faces do not count as outside.
    /// `None`: the axis closest to the world's head–foot axis.
    pub through_axis: Option<usize>,
}

/// Skin triangles of a lattice.
#[derive(Clone, Debug)]
pub struct Skin {
    /// Flat lattice indices, counter-clockwise seen from the air; each triangle once, in lattice order.
    pub triangles: Vec<[u32; 3]>,
    /// What was found.
    pub report: SkinReport,
}

/// Finds the skin of a lattice whose points are `air` or tissue (in grid order).
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
/// [`MeshError::Length`] if `air` has not one value per lattice point, [`MeshError::Plane`] for a bad half-space, [`MeshError::Axis`] for
/// a through axis above 2.
pub fn detect(
    lattice: &Lattice,
    air: &[bool],
    mode: SkinMode,
    options: &SkinOptions,
) -> Result<Skin, MeshError> {
    if let Some(axis) = options.through_axis.filter(|&axis| axis > 2) {
        return Err(MeshError::Axis { axis });
    }
    let tissue = present(lattice, air, &options.cut_away)?;
    let masks = CellMasks::of_points(lattice, &tissue);
    let literal = paper::count(lattice, &tissue);
    let boundary_triangles =
        || faces(lattice, &masks).into_iter().map(|face| face.triangle).collect::<Vec<_>>();
    let exterior = exterior::find(lattice, &tissue, &masks, options.through_axis);
    let (triangles, considered) = match mode {
        SkinMode::Paper => (paper::triangles(lattice, &tissue), None),
        SkinMode::Boundary => (boundary_triangles(), None),
        SkinMode::Exterior => (exterior.triangles.clone(), Some(boundary_triangles().len())),
    };
    let considered = considered.unwrap_or(triangles.len());
    let report = report::report(lattice, mode, &tissue, &triangles, considered, &literal, &exterior);
    Ok(Skin { triangles, report })
}

impl Skin {
    /// The triangles in the vertices of a mesh of the same lattice, and how many were left out because the mesh lacks one of their vertices.
    pub fn on_mesh(&self, mesh: &TetMesh) -> (Vec<[u32; 3]>, usize) {
        let vertex_of = mesh.vertex_of_point();
        let vertex = |point: u32| vertex_of.get(point as usize).copied().unwrap_or(NO_VERTEX);
        let triangles: Vec<[u32; 3]> =
            self.triangles.iter().map(|t| t.map(vertex)).filter(|t| !t.contains(&NO_VERTEX)).collect();
        let dropped = self.triangles.len() - triangles.len();
        (triangles, dropped)
    }
}
