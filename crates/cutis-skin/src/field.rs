//! All fields on a skin together.

use nalgebra::Vector3;

use crate::{BodySkin, Directions, Normals, SkinError, TangentField};

/// Normals and directions at the triangles of a skin.
///
/// All arrays have one entry per skin triangle. Vectors are in world axes (RAS+), which are also
/// the axes of local coordinates.
#[derive(Clone, Debug)]
pub struct SkinField {
    /// Outward unit normals of the true skin.
    pub normals: Vec<Vector3<f64>>,
    /// Unit directions perpendicular to the normals. The sign has no meaning.
    pub directions: Vec<Vector3<f64>>,
    /// How much each direction counts, from 0 (isotropic) to 1.
    pub weights: Vec<f64>,
    /// Share of the skin's area where the weight is above ½. The area of a triangle is that of its
    /// projection on the tangent plane. It is 0 if there is no skin.
    pub coverage: f64,
    /// Number of normals that are means of facet normals ([`Normals::from_facets`]).
    pub normals_from_facets: usize,
}

/// Fields in 32 bits, as mesh files store values per cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellData {
    /// Outward unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Unit directions. The sign has no meaning.
    pub directions: Vec<[f32; 3]>,
    /// Weights from 0 to 1.
    pub weights: Vec<f32>,
}

impl SkinField {
    /// Computes normals and directions. The work is parallel, and the bits do not depend on the
    /// number of threads.
    ///
    /// # Errors
    /// The errors of [`TangentField::new`].
    pub fn new(skin: &BodySkin<'_>, directions: &Directions) -> Result<Self, SkinError> {
        let normals = Normals::of(skin);
        let TangentField { directions, weights } = TangentField::new(skin, &normals, directions)?;
        let coverage = coverage(skin, &normals.vectors, &weights);
        let Normals { vectors, from_facets } = normals;
        Ok(Self { normals: vectors, directions, weights, coverage, normals_from_facets: from_facets })
    }

    /// The fields in 32 bits, for mesh files.
    pub fn cell_data(&self) -> CellData {
        let vectors = |field: &[Vector3<f64>]| field.iter().map(|v| v.cast::<f32>().into()).collect();
        CellData {
            normals: vectors(&self.normals),
            directions: vectors(&self.directions),
            weights: self.weights.iter().map(|&weight| weight as f32).collect(),
        }
    }
}

/// Share of the projected area where the weight is above ½.
fn coverage(skin: &BodySkin<'_>, normals: &[Vector3<f64>], weights: &[f64]) -> f64 {
    let (mut covered, mut total) = (0.0, 0.0);
    for ((triangle, normal), &weight) in skin.triangles().iter().zip(normals).zip(weights) {
        let area = skin.area_vector_mm2(triangle).dot(normal).abs();
        total += area;
        if weight > 0.5 {
            covered += area;
        }
    }
    if total > 0.0 { covered / total } else { 0.0 }
}
