//! Stitches across an incision: pairs of points of the skin on both sides of it.

use nalgebra::Point3;

use crate::sever::closest_in_triangle;
use crate::slit::{Facet, Slit};
use crate::{Cut, MeshError, TetMesh};

/// Largest number of stitches of an incision.
const MOST_STITCHES: f64 = 1000.0;

/// A stitch: a point of the skin on the left side of an incision, and one on its right side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stitch {
    /// The triangles of the two points, in mesh vertices. They share no vertex.
    pub triangles: [[u32; 3]; 2],
    /// Weights of the second and third corner of each triangle.
    pub weights: [[f64; 2]; 2],
    /// Distance of the points at rest in m.
    pub rest: f64,
}

impl Stitch {
    /// The vertices of both triangles.
    pub fn vertices(&self) -> [u32; 6] {
        let [[a, b, c], [d, e, f]] = self.triangles;
        [a, b, c, d, e, f]
    }
}

impl Cut {
    /// Stitches along an incision at equal distances of about `every`. Their ends are about `bite`
    /// from the incision, both in m. `skin` holds triangles of the mesh, none of them divided by a
    /// cut.
    ///
    /// # Errors
    /// [`MeshError::StitchOffSkin`] if a stitch has no skin near one of its ends, or if no cut is
    /// between them. [`MeshError::TooManyStitches`] for more than 1000.
    ///
    /// # Panics
    /// If there is no such incision.
    pub fn stitches(
        &self,
        incision: usize,
        mesh: &TetMesh,
        skin: &[[u32; 3]],
        every: f64,
        bite: f64,
    ) -> Result<Vec<Stitch>, MeshError> {
        let slits = self.incisions().nth(incision).expect("the incision exists");
        let length: f64 = slits.iter().map(Slit::length).sum();
        let count = (length / every).round().max(1.0);
        if count > MOST_STITCHES {
            let least_mm = length * 1000.0 / MOST_STITCHES;
            return Err(MeshError::TooManyStitches { incision, every_mm: every * 1000.0, least_mm });
        }
        let count = count as usize;
        let step = mesh.lattice.longest_step_mm() / 1000.0;
        // The skin may be bent, and its triangles are those of the lattice.
        let reach = 2.0 * step + 0.25 * bite;
        let corners = |triangle: &[u32; 3]| triangle.map(|v| mesh.positions[v as usize]);
        let near: Vec<&[u32; 3]> = skin
            .iter()
            .filter(|triangle| slits.iter().any(|slit| slit.near(corners(triangle)[0], bite + 2.0 * reach)))
            .collect();
        let stitch = |number: usize| {
            let (slit, along) = at_length(slits, length * (number as f64 + 0.5) / count as f64);
            let middle = slit.skin_at(along);
            let end = |side: f64| {
                let wanted = middle + slit.lateral() * (side * bite);
                let outside =
                    |triangle: &[u32; 3]| Facet::of(corners(triangle)).area_vector.dot(&slit.inward()) < 0.0;
                let on_side = |point: Point3<f64>| side * slit.coordinates(point).lateral > 0.2 * bite;
                let found = near.iter().filter(|triangle| outside(triangle)).map(|triangle| {
                    let corners = corners(triangle).map(|corner| corner.cast::<f64>());
                    let weights = closest_in_triangle(&corners, wanted);
                    let sum = corners
                        .iter()
                        .zip(weights)
                        .fold(nalgebra::Vector3::zeros(), |sum, (corner, w)| sum + corner.coords * w);
                    let point = Point3::from(sum);
                    (nalgebra::distance(&point, &wanted), **triangle, weights, point)
                });
                let found = found.filter(|(distance, .., point)| *distance <= reach && on_side(*point));
                found.min_by(|a, b| a.0.total_cmp(&b.0)).ok_or_else(|| MeshError::StitchOffSkin {
                    incision,
                    at_mm: mesh.frame.to_mm(wanted.cast()).into(),
                    reach_mm: reach * 1000.0,
                })
            };
            let [left, right] = [end(-1.0)?, end(1.0)?];
            if left.1.iter().any(|v| right.1.contains(v)) {
                let at_mm = mesh.frame.to_mm(middle.cast()).into();
                return Err(MeshError::StitchOffSkin { incision, at_mm, reach_mm: reach * 1000.0 });
            }
            let rest = nalgebra::distance(&left.3, &right.3);
            let weights = [left.2, right.2].map(|[_, b, c]| [b, c]);
            Ok(Stitch { triangles: [left.1, right.1], weights, rest })
        };
        (0..count).map(stitch).collect()
    }
}

/// The slit at a length along a path, and the length along the slit.
fn at_length(slits: &[Slit], mut along: f64) -> (&Slit, f64) {
    for slit in &slits[..slits.len() - 1] {
        if along <= slit.length() {
            return (slit, along);
        }
        along -= slit.length();
    }
    let last = &slits[slits.len() - 1];
    (last, along.min(last.length()))
}
