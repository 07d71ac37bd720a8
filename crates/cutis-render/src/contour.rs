//! The intersection of a triangle surface with a plane.

use nalgebra::{Point3, Vector3};

use crate::{RenderError, Rgb};

/// A triangle surface to draw on a slice. Positions are in local meters: `world_mm = origin_mm +
/// 1000 · local`.
#[derive(Clone, Copy, Debug)]
pub struct Contour<'a> {
    /// World position of the surface's local origin, mm, RAS+.
    pub origin_mm: Point3<f64>,
    /// Positions of the vertices in local meters.
    pub positions: &'a [Point3<f32>],
    /// Corners of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// Color of the line.
    pub color: Rgb,
}

/// Returns an error if a triangle of a surface names a vertex that does not exist.
pub(crate) fn check_corners(
    contour: usize,
    triangles: &[[u32; 3]],
    vertices: usize,
) -> Result<(), RenderError> {
    let outside = |corners: &&[u32; 3]| corners.iter().any(|&v| v as usize >= vertices);
    match triangles.iter().enumerate().find(|(_, corners)| outside(corners)) {
        Some((triangle, &corners)) => {
            Err(RenderError::VertexOutOfRange { contour, triangle, corners, vertices })
        }
        None => Ok(()),
    }
}

impl Contour<'_> {
    pub(crate) fn validate(&self, contour: usize) -> Result<(), RenderError> {
        check_corners(contour, self.triangles, self.positions.len())
    }

    /// Segments in world mm where the surface meets the plane through `point` with the unit normal
    /// `normal`.
    pub(crate) fn cut(&self, point: Point3<f64>, normal: &Vector3<f64>) -> Vec<[Point3<f64>; 2]> {
        let segment = |corners: &[u32; 3]| {
            let world =
                corners.map(|v| self.origin_mm + self.positions[v as usize].coords.map(f64::from) * 1000.0);
            let height = world.map(|p| (p - point).dot(normal));
            // A vertex on the plane counts as above it, so that each crossed edge is found once.
            let mut ends = (0..3).filter_map(|a| {
                let b = (a + 1) % 3;
                let crossed = (height[a] < 0.0) != (height[b] < 0.0);
                crossed.then(|| world[a] + (world[b] - world[a]) * (height[a] / (height[a] - height[b])))
            });
            Some([ends.next()?, ends.next()?])
        };
        self.triangles.iter().filter_map(segment).collect()
    }
}
