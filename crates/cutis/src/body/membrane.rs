//! Smooth normals and directions of the skin, for constraints that act along them.

use std::collections::HashMap;

use cutis_mesh::TissueMask;
use cutis_skin::{BodySkin, Directions, SkinField};
use nalgebra::Vector3;

use super::Body;
use crate::Error;
use crate::output::report::MembraneReport;
use crate::scene::{MembraneSection, SceneFile};

/// Share of the normals above which means of facet normals cause a warning.
const MANY_FACET_NORMALS: f64 = 0.01;

/// Normals and directions at the triangles of the whole uncut skin.
pub(crate) struct Membrane {
    field: SkinField,
    /// Position in the field of each skin triangle, by its lattice points.
    position: HashMap<[u32; 3], u32>,
    /// Whether the scene gives directions. Without them all weights are 0.
    has_lines: bool,
    /// Parts of a file of strokes that were skipped, and problems of the normals.
    pub(super) warnings: Vec<String>,
}

/// Normal and direction of the skin at one triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tangent {
    /// Outward unit normal of the smooth skin.
    pub(crate) normal: Vector3<f64>,
    /// Unit vector along the lines of tension, perpendicular to the normal.
    pub(crate) along: Vector3<f64>,
    /// How much the direction counts, from 0 (isotropic) to 1.
    pub(crate) weight: f64,
}

impl Membrane {
    /// Computes the field of the whole skin, so that a region of interest has the field of the
    /// whole body. `hu` has one value per lattice point. `skin` is in lattice points.
    ///
    /// # Errors
    /// [`Error`] for directions that do not work with this skin.
    pub(super) fn find(
        file: SceneFile<'_>,
        section: &MembraneSection,
        whole: &TissueMask,
        hu: &[f32],
        skin: &[[u32; 3]],
    ) -> Result<Self, Error> {
        let (directions, has_lines) = section.directions(file)?;
        let key = match directions {
            Directions::Strokes(_) => "constraints.membrane.directions.strokes",
            Directions::Around(_) | Directions::Along(_) => "constraints.membrane.directions",
        };
        let found = BodySkin::new(whole.lattice(), hu, whole.vertices(), skin).map_err(file.blame(key))?;
        let mut field = SkinField::new(&found, &directions).map_err(file.blame(key))?;
        if !has_lines {
            field.weights.fill(0.0);
            field.coverage = 0.0;
        }
        let mut warnings = stroke_warnings(&directions);
        warnings.extend(facet_normals(&field));
        Ok(Self { field, position: skin.iter().copied().zip(0..).collect(), has_lines, warnings })
    }

    /// Normal and direction at a skin triangle in lattice points.
    fn at(&self, points: &[u32; 3]) -> Tangent {
        let n = self.position[points] as usize;
        let SkinField { normals, directions, weights, .. } = &self.field;
        Tangent { normal: normals[n], along: directions[n], weight: weights[n] }
    }

    /// Whether the scene gives directions, so that there are lines to show.
    pub(crate) fn has_lines(&self) -> bool {
        self.has_lines
    }

    /// Figures about the field.
    pub(crate) fn report(&self) -> MembraneReport {
        MembraneReport {
            triangles: self.field.normals.len(),
            coverage: self.has_lines.then_some(self.field.coverage),
            normals_from_facets: self.field.normals_from_facets,
        }
    }
}

impl Body {
    /// Normals and directions at triangles of the skin. The triangles are those of
    /// [`Body::skin`], of [`Body::inactive_skin`] or of [`Body::removed`]. None if the scene has no
    /// membrane.
    pub(crate) fn tangents<'a>(
        &'a self,
        triangles: &'a [[u32; 3]],
    ) -> Option<impl Iterator<Item = Tangent> + 'a> {
        let membrane = self.membrane.as_ref()?;
        let active = self.mesh.positions.len();
        let point = move |vertex: u32| match (vertex as usize).checked_sub(active) {
            Some(inactive) => self.inactive_skin.lattice_index[inactive],
            None => self.mesh.lattice_index[vertex as usize],
        };
        Some(triangles.iter().map(move |triangle| membrane.at(&triangle.map(point))))
    }
}

/// What was skipped in a file of strokes.
fn stroke_warnings(directions: &Directions) -> Vec<String> {
    let Directions::Strokes(strokes) = directions else { return Vec::new() };
    let named = |warning: &String| format!("{}: {warning}", strokes.path().display());
    strokes.warnings().iter().map(named).collect()
}

/// Warning about normals that are only means of the facets around them.
fn facet_normals(field: &SkinField) -> Option<String> {
    let (rough, all) = (field.normals_from_facets, field.normals.len());
    (rough as f64 > MANY_FACET_NORMALS * all as f64).then(|| {
        format!(
            "{rough} of {all} skin triangles have the mean normal of the lattice facets around them, because \
             the CT gives none there: tissue is thinner than about four lattice steps. Set lattice.spacing_mm to less, so that \
             lines follow the skin there"
        )
    })
}
