//! The skin of a body on its lattice: the input of every field.

use cutis_mesh::Lattice;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::SkinError;

/// The skin of a body on a lattice, with the HU from which its normals follow.
///
/// ```
/// use cutis_mesh::{Lattice, SkinMode, SkinOptions, Split, Tissue, TissueMask, skin};
/// use cutis_skin::BodySkin;
/// use cutis_volume::{Affine, Grid};
/// let grid = Grid { shape: [9, 9, 9], affine: Affine::from_spacing([2.0; 3], [0.0; 3])? };
/// let lattice = Lattice::new(grid, Split::Kuhn6)?;
/// let inside = |p: [usize; 3]| p.iter().all(|c| (2..7).contains(c));
/// let air: Vec<bool> = (0..grid.len()).map(|point| !inside(grid.point(point))).collect();
/// let hu: Vec<f32> = air.iter().map(|&air| if air { -1000.0 } else { 40.0 }).collect();
/// let body = TissueMask::find(&lattice, &Tissue { air: &air, cut_away: &[], largest_component: true })?;
/// let found = skin::detect(&lattice, &air, SkinMode::Exterior, &SkinOptions::default())?;
/// let (triangles, _) = body.skin(&found);
/// let skin = BodySkin::new(&lattice, &hu, body.vertices(), &triangles)?;
/// assert_eq!(skin.triangles().len(), 12 * 16);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct BodySkin<'a> {
    lattice: &'a Lattice,
    hu: &'a [f32],
    vertices: &'a [bool],
    triangles: &'a [[u32; 3]],
}

impl<'a> BodySkin<'a> {
    /// Describes the skin of a body.
    ///
    /// `hu` and `vertices` have one value per lattice point, in grid order: the HU, and true for
    /// vertices of the body ([`TissueMask::vertices`](cutis_mesh::TissueMask::vertices)).
    /// `triangles` are the skin in flat lattice indices, counterclockwise as seen from outside
    /// ([`TissueMask::skin`](cutis_mesh::TissueMask::skin)).
    ///
    /// # Errors
    /// [`SkinError::Length`] if an array does not have one value per lattice point.
    /// [`SkinError::Hu`] if the HU of a vertex of the body is not finite. [`SkinError::Triangle`]
    /// if a triangle does not join three corners of a lattice cell.
    pub fn new(
        lattice: &'a Lattice,
        hu: &'a [f32],
        vertices: &'a [bool],
        triangles: &'a [[u32; 3]],
    ) -> Result<Self, SkinError> {
        let grid = lattice.grid();
        for (array, found) in [("hu", hu.len()), ("vertices", vertices.len())] {
            if found != grid.len() {
                return Err(SkinError::Length { array, expected: grid.len(), found });
            }
        }
        let wrong = |point: &usize| vertices[*point] && !hu[*point].is_finite();
        if let Some(point) = (0..hu.len()).into_par_iter().find_first(wrong) {
            return Err(SkinError::Hu { point: grid.point(point), hu: hu[point] });
        }
        let skin = Self { lattice, hu, vertices, triangles };
        let wrong = |triangle: &usize| !skin.is_face(&triangles[*triangle]);
        match (0..triangles.len()).into_par_iter().find_first(wrong) {
            Some(triangle) => {
                Err(SkinError::Triangle { triangle, points: triangles[triangle], count: hu.len() })
            }
            None => Ok(skin),
        }
    }

    /// True if the points are three different corners of one cell. Three corners of a cell are
    /// never on a line.
    fn is_face(&self, &[a, b, c]: &[u32; 3]) -> bool {
        let grid = self.lattice.grid();
        let exists = |point: u32| (point as usize) < grid.len();
        if ![a, b, c].into_iter().all(exists) || a == b || b == c || c == a {
            return false;
        }
        let corners = [a, b, c].map(|point| grid.point(point as usize));
        (0..3).all(|axis| {
            let along = corners.map(|corner| corner[axis]);
            let low = along.into_iter().fold(usize::MAX, usize::min);
            along.into_iter().all(|n| n - low <= 1)
        })
    }

    /// The lattice.
    pub fn lattice(&self) -> &'a Lattice {
        self.lattice
    }

    /// HU at each lattice point.
    pub fn hu(&self) -> &'a [f32] {
        self.hu
    }

    /// One flag per lattice point: true if it is a vertex of the body.
    pub fn vertices(&self) -> &'a [bool] {
        self.vertices
    }

    /// The skin triangles in flat lattice indices.
    pub fn triangles(&self) -> &'a [[u32; 3]] {
        self.triangles
    }

    /// World position of a lattice point in mm.
    pub(crate) fn mm(&self, point: u32) -> Point3<f64> {
        self.lattice.mm(self.lattice.grid().point(point as usize))
    }

    /// The area vector of a triangle in mm²: its outward facet normal times its area.
    pub(crate) fn area_vector_mm2(&self, triangle: &[u32; 3]) -> Vector3<f64> {
        let [a, b, c] = triangle.map(|point| self.mm(point));
        (b - a).cross(&(c - a)) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use cutis_mesh::Split;
    use cutis_volume::{Affine, Grid};

    use super::*;

    #[test]
    fn arrays_hu_and_triangles_are_checked() {
        let grid = Grid { shape: [3, 3, 3], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
        let lattice = Lattice::new(grid, Split::Kuhn6).unwrap();
        let (mut hu, vertices) = (vec![40.0f32; 27], vec![true; 27]);
        let good: [[u32; 3]; 1] = [[0, 1, 4]];
        assert!(BodySkin::new(&lattice, &hu, &vertices, &good).is_ok());
        let short = BodySkin::new(&lattice, &hu[1..], &vertices, &good);
        assert!(matches!(short, Err(SkinError::Length { array: "hu", expected: 27, found: 26 })));
        let short = BodySkin::new(&lattice, &hu, &vertices[1..], &good);
        assert!(matches!(short, Err(SkinError::Length { array: "vertices", .. })));
        for wrong in [[0, 1, 27], [0, 0, 1], [0, 1, 2], [0, 1, u32::MAX], [0, 4, 8]] {
            let refused = BodySkin::new(&lattice, &hu, &vertices, &[good[0], wrong]).unwrap_err();
            assert!(matches!(refused, SkinError::Triangle { triangle: 1, .. }), "{wrong:?}: {refused}");
        }
        hu[13] = f32::NAN;
        let refused = BodySkin::new(&lattice, &hu, &vertices, &good);
        assert!(matches!(refused, Err(SkinError::Hu { point: [1, 1, 1], .. })));
        // Air may be NaN.
        let mut vertices = vertices;
        vertices[13] = false;
        assert!(BodySkin::new(&lattice, &hu, &vertices, &good).is_ok());
    }
}
