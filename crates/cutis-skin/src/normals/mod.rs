//! Smooth outward normals of the true skin.

mod facets;
mod opacity;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::BodySkin;
use crate::vertices::SkinVertices;
use opacity::Opacity;

/// Outward unit normals of the true skin at the skin triangles.
///
/// The skin of a lattice body is a staircase, and the normals of its facets are wrong by tens of
/// degrees. The normal of the skin that the CT shows is
///
/// ```text
/// n = −∇ã / |∇ã|
/// ```
///
/// where `ã` is the blurred opacity of the body. The opacity at a vertex of the body is that of the
/// table preset `paper`, `a = clamp((HU + 449)/455, 0, 1)`. It is 0 at all other points, so that
/// the scanner table and removed parts do not count. The blur repeats the filter (1, 2, 1)/4 along
/// each axis until its standard deviation is two lattice steps (twice the geometric mean of the
/// three steps, if they differ). `∇ã` is the central difference, interpolated at the center of the
/// triangle. At the ends of the lattice the opacity continues by reflection in its end value, so
/// that a scan that cuts through the body makes no edge.
///
/// The blur counts in lattice steps. In a graded lattice the filter and the differences have the
/// weights of the distances between planes, so that a linear opacity keeps its exact gradient.
///
/// # Accuracy
///
/// Angle in degrees to the exact normal, mean and largest, more than seven planes from the border
/// of the lattice. *Mask* is a body of lattice points at 40 HU in air. *CT* is the same body with
/// partial volume, sampled from voxels of a third of a step. Facets are those of the mask.
///
/// | body | mask | CT | facets |
/// |---|---|---|---|
/// | half-spaces | 0.69, 6.5 | 0.38, 0.9 | 43, 90 |
/// | spheres, radius 6 steps | 0.84, 3.0 | 0.30, 1.0 | 39, 94 |
/// | cylinders, radius 6 steps | 0.78, 2.1 | 0.30, 0.6 | 40, 95 |
/// | half-spaces, steps 1 : 1 : 3 | 1.03, 3.8 | 0.94, 3.0 | 45, 87 |
/// | cylinders, radius 10 steps, steps 1 : 1 : 3 | 2.21, 8.8 | 1.98, 4.9 | 37, 87 |
/// | half-spaces, rotated and mirrored axes | 0.72, 5.0 | 0.40, 2.3 | 38, 89 |
/// | half-spaces, axes sheared by 21° | 0.80, 5.2 | 0.44, 1.1 | 47, 110 |
/// | spheres, radius 6 steps, axes sheared by 21° | 1.81, 5.2 | 1.99, 5.2 | 45, 111 |
/// | half-spaces, graded lattice with a growth of 1.3 | 1.89, 7.2 | 1.76, 6.9 | 39, 90 |
///
/// `cargo test --release -p cutis-skin --test all accuracy -- --nocapture` prints these figures.
/// In the last two planes of a scan the mean errors of half-spaces are 2.5° and 1.2°.
#[derive(Clone, Debug)]
pub struct Normals {
    /// One unit vector per skin triangle, in world axes (RAS+). Those are also the axes of local
    /// coordinates ([`Frame`](cutis_mesh::Frame)).
    pub vectors: Vec<Vector3<f64>>,
    /// Number of triangles with the mean normal of the facets around them, because the opacity has
    /// no usable gradient there. This happens where tissue is thinner than the blur.
    pub from_facets: usize,
}

/// Smallest usable gradient of the blurred opacity, per lattice step. At a plane skin it is 0.2.
const LEAST_GRADIENT: f64 = 0.01;

impl Normals {
    /// Computes the normals. The work is parallel, and the bits do not depend on the number of
    /// threads.
    pub fn of(skin: &BodySkin<'_>) -> Self {
        let opacity = Opacity::blurred(skin);
        let around = facets::means(skin, &SkinVertices::of(skin));
        let normal = |(triangle, around): (&[u32; 3], &Vector3<f64>)| {
            let gradient = opacity.gradient(skin.lattice().grid(), triangle);
            let normal = (gradient.per_step >= LEAST_GRADIENT).then(|| -gradient.direction.normalize());
            // Also catches a gradient that overflowed.
            match normal.filter(|normal| normal.dot(around) > 0.0) {
                Some(normal) => (normal, false),
                None => (*around, true),
            }
        };
        let found: Vec<(Vector3<f64>, bool)> = skin.triangles().par_iter().zip(&around).map(normal).collect();
        let from_facets = found.iter().filter(|(_, from_facets)| *from_facets).count();
        Self { vectors: found.into_iter().map(|(vector, _)| vector).collect(), from_facets }
    }
}
