//! Smooth normals and directions of the skin, for constraints that act along them.

use std::collections::HashMap;

use cutis_mesh::{TetMesh, TissueMask};
use cutis_skin::{BodySkin, Directions, SkinField};
use nalgebra::Vector3;

use crate::Error;
use crate::scene::SceneFile;

/// Normals and directions at the triangles of the whole uncut skin.
pub(crate) struct Membrane {
    pub(crate) field: SkinField,
    /// Position in the field of each skin triangle, by its lattice points.
    position: HashMap<[u32; 3], u32>,
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
        whole: &TissueMask,
        hu: &[f32],
        skin: &[[u32; 3]],
        directions: &Directions,
    ) -> Result<Self, Error> {
        let blame = || file.blame("constraints.membrane.directions");
        let found = BodySkin::new(whole.lattice(), hu, whole.vertices(), skin).map_err(blame())?;
        let field = SkinField::new(&found, directions).map_err(blame())?;
        Ok(Self { field, position: skin.iter().copied().zip(0..).collect() })
    }

    /// Normal and direction at a skin triangle in mesh vertices.
    pub(crate) fn at(&self, mesh: &TetMesh, triangle: &[u32; 3]) -> Tangent {
        let points = triangle.map(|vertex| mesh.lattice_index[vertex as usize]);
        let n = self.position[&points] as usize;
        let SkinField { normals, directions, weights, .. } = &self.field;
        Tangent { normal: normals[n], along: directions[n], weight: weights[n] }
    }
}
