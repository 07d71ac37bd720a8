//! Directions in the skin: around an axis, along an axis, or from strokes.

mod axis;
mod graph;
mod harmonic;
mod multigrid;
mod sampled;
mod system;
mod tensor;

use nalgebra::Vector3;

use crate::{BodySkin, Normals, SkinError, Strokes};

/// How the directions in the skin are given.
#[derive(Clone, Debug)]
pub enum Directions {
    /// Perpendicular to an axis, as on the trunk and the neck. World axes (RAS+), of any length.
    ///
    /// With the unit axis `a` and the normal `n`, the direction is `a × n / s` with `s = |a × n|`.
    /// The weight is `smoothstep(0.2, 0.5, s)`: 0 where the skin is within 11.5° of perpendicular
    /// to the axis, 1 from 30° on.
    Around([f64; 3]),
    /// Along an axis, as on a limb. World axes (RAS+), of any length.
    ///
    /// The direction is `(a − n(n·a)) / s`, the projection of the axis on the skin. The weight is
    /// that of [`Directions::Around`].
    Along([f64; 3]),
    /// From strokes on the skin.
    ///
    /// At a stroke the field is `Q = d dᵀ − ⅓`, where `d` is the unit direction of the stroke in
    /// the skin. `Q` has no sign, so the strokes may run either way. Between the strokes each of
    /// its five numbers is harmonic over the vertices of the skin: the value at a vertex is the
    /// mean of its neighbors' values, weighted by 1/length² of the skin's edges. At a triangle the
    /// direction is the main eigenvector of `P Q P`, with `P = 1 − n nᵀ`. The weight is the gap
    /// between the two eigenvalues in the skin, which is 1 at a single stroke and 0 where strokes
    /// that cross cancel. Parts of the skin that no stroke touches have the weight 0.
    Strokes(Strokes),
}

/// A direction with a weight at each skin triangle.
#[derive(Clone, Debug, Default)]
pub struct TangentField {
    /// Unit vectors perpendicular to the normals, in world axes (RAS+). The sign has no meaning.
    pub directions: Vec<Vector3<f64>>,
    /// How much the direction counts, from 0 (isotropic) to 1. A direction of weight 0 is
    /// arbitrary.
    pub weights: Vec<f64>,
}

impl TangentField {
    /// Computes the directions in a skin with these normals. The work is parallel, and the bits do
    /// not depend on the number of threads.
    ///
    /// # Errors
    /// [`SkinError::Normals`] if there is not one normal per triangle. [`SkinError::Axis`] if an
    /// axis is zero or not finite. [`SkinError::StrokeOffSkin`] or [`SkinError::StrokeThroughSkin`]
    /// if a stroke does not run along the skin. [`SkinError::StrokesTooLong`] if the strokes
    /// together are longer than ten million lattice steps.
    pub fn new(skin: &BodySkin<'_>, normals: &Normals, directions: &Directions) -> Result<Self, SkinError> {
        let (expected, found) = (skin.triangles().len(), normals.vectors.len());
        if expected != found {
            return Err(SkinError::Normals { expected, found });
        }
        let at_triangles: Vec<(Vector3<f64>, f64)> = match directions {
            Directions::Around(axis) => axis::around(&axis::unit("around", *axis)?, &normals.vectors),
            Directions::Along(axis) => axis::along(&axis::unit("along", *axis)?, &normals.vectors),
            Directions::Strokes(strokes) => sampled::from_strokes(skin, &normals.vectors, strokes)?,
        };
        let (directions, weights) = at_triangles.into_iter().unzip();
        Ok(Self { directions, weights })
    }
}

/// A unit vector perpendicular to a unit normal: the world axis farthest from the normal,
/// projected.
fn any_tangent(normal: &Vector3<f64>) -> Vector3<f64> {
    let axis = Vector3::ith(normal.iamin(), 1.0);
    (axis - normal * normal.dot(&axis)).normalize()
}
