//! The skin of a lattice as the place of cuts.

use nalgebra::{Point3, Vector3};

use crate::{Frame, Lattice, MeshError};

/// The skin on which cuts are placed.
pub(crate) struct SkinSurface<'a> {
    lattice: &'a Lattice,
    pub frame: Frame,
    /// Longest lattice step in m.
    pub step: f64,
    /// Triangles in flat lattice indices.
    pub triangles: &'a [[u32; 3]],
    pub facets: Vec<Facet>,
}

impl<'a> SkinSurface<'a> {
    /// The skin of a lattice. `triangles` are in flat lattice indices.
    pub fn new(lattice: &'a Lattice, triangles: &'a [[u32; 3]]) -> Result<Self, MeshError> {
        check_indices(triangles, lattice.grid().len())?;
        let (frame, step) = (Frame::center_of(lattice.grid()), lattice.longest_step_mm() / 1000.0);
        let mut surface = Self { lattice, frame, step, triangles, facets: Vec::new() };
        let facet = |triangle: &[u32; 3]| Facet::of(triangle.map(|point| surface.position(point)));
        surface.facets = triangles.iter().map(facet).collect();
        Ok(surface)
    }

    /// Rest position of a lattice point in local meters.
    pub fn position(&self, point: u32) -> Point3<f32> {
        self.frame.to_local(self.lattice.mm(self.lattice.grid().point(point as usize)))
    }
}

/// Center and area vector (outward normal times area) of a skin triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet {
    pub center: Point3<f64>,
    pub area_vector: Vector3<f64>,
}

impl Facet {
    pub fn of(corners: [Point3<f32>; 3]) -> Self {
        let [a, b, c] = corners.map(|corner| corner.cast::<f64>());
        Self {
            center: Point3::from((a.coords + b.coords + c.coords) / 3.0),
            area_vector: (b - a).cross(&(c - a)) / 2.0,
        }
    }

    /// True unless it faces into the body, as the far side of a thin part does.
    pub fn faces_out(&self, inward: &Vector3<f64>) -> bool {
        self.area_vector.dot(inward) < 0.5 * self.area_vector.norm()
    }
}

/// Returns an error if a triangle names a vertex that does not exist.
pub(crate) fn check_indices(triangles: &[[u32; 3]], vertices: usize) -> Result<(), MeshError> {
    let outside = |triangle: &[u32; 3]| triangle.iter().copied().find(|&vertex| vertex as usize >= vertices);
    match triangles.iter().enumerate().find_map(|(n, triangle)| Some((n, outside(triangle)?))) {
        None => Ok(()),
        Some((position, vertex)) => {
            Err(MeshError::VertexIndex { array: "triangles", position, vertex, vertices })
        }
    }
}
