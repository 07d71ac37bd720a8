//! The vertices that a handle grabs.

use cutis_mesh::{Cut, Frame, TetMesh};
use nalgebra::{Point3, distance};

use super::BodySections;
use crate::Error;
use crate::scene::HandleSection;

/// The sphere that a handle grabs.
pub(super) struct Grasp {
    /// Local meters.
    center: Point3<f64>,
    radius_m: f64,
}

impl Grasp {
    pub(super) fn new(handle: &HandleSection, frame: &Frame) -> Self {
        let center = frame.to_local(Point3::from(handle.center_mm())).map(f64::from);
        Self { center, radius_m: handle.radius_mm / 1000.0 }
    }

    /// Whether the handle grabs a vertex at this rest position.
    pub(super) fn holds(&self, position: Point3<f32>) -> bool {
        distance(&position.map(f64::from), &self.center) <= self.radius_m
    }
}

/// The vertices that each handle of the scene grabs, in ascending order. Removed vertices are not
/// grabbed.
///
/// # Errors
/// [`Error::SceneKey`] for a handle that grabs no vertex.
pub(super) fn grabbed(
    sections: &BodySections<'_>,
    mesh: &TetMesh,
    cut: &Cut,
) -> Result<Vec<Vec<u32>>, Error> {
    let grab = |(n, handle): (usize, &HandleSection)| {
        let grasp = Grasp::new(handle, &mesh.frame);
        let vertices: Vec<u32> = (0..mesh.positions.len() as u32)
            .filter(|&v| !cut.removed[v as usize] && grasp.holds(mesh.positions[v as usize]))
            .collect();
        if vertices.is_empty() {
            let (key, value) = (format!("handle[{n}].at_mm"), format!("{:?}", handle.center_mm()));
            let why = format!("there is no tissue within radius_mm = {} of it", handle.radius_mm);
            return Err(sections.file.bad_key(&key, &value, &why));
        }
        Ok(vertices)
    };
    sections.handles.iter().enumerate().map(grab).collect()
}
