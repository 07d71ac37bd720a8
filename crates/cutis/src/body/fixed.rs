//! Vertices that do not move, and inverse masses.

use super::Body;
use crate::Error;
use crate::scene::{FixedSection, SceneFile};

impl Body {
    /// Inverse mass of each vertex, 1/kg; 0 for a fixed or removed one.
    ///
    /// # Errors
    /// [`Error::SceneKey`] for densities that give a vertex no mass.
    pub(crate) fn inverse_masses(
        &self,
        file: SceneFile<'_>,
        section: &FixedSection,
    ) -> Result<Vec<f32>, Error> {
        let fixed = self.fixed(file, section)?;
        if let Some(vertex) = self.masses.iter().position(|m| !(m.is_finite() && *m > 0.0)) {
            let why = format!(
                "gives a vertex of {} HU a mass of {} kg; densities must be above 0 wherever there is tissue",
                self.mesh.hu[vertex], self.masses[vertex]
            );
            return Err(file.bad_key("tissue.density", "", &why));
        }
        let motionless = |v: usize| fixed[v] || self.cut.removed[v];
        Ok((0..self.masses.len()).map(|v| if motionless(v) { 0.0 } else { 1.0 / self.masses[v] }).collect())
    }

    /// Per vertex: whether the scene fixes it. Vertices on the border of a region of interest are
    /// fixed.
    ///
    /// # Errors
    /// [`Error`] for a plane without a direction.
    pub(crate) fn fixed(&self, file: SceneFile<'_>, section: &FixedSection) -> Result<Vec<bool>, Error> {
        let mesh = &self.mesh;
        let border = mesh.inactive.as_ref().map(|inactive| inactive.border.clone());
        let mut fixed = border.unwrap_or_else(|| vec![false; mesh.positions.len()]);
        let mut add =
            |which: Vec<bool>| fixed.iter_mut().zip(which).for_each(|(fixed, other)| *fixed |= other);
        if let Some(hu) = section.bone_above_hu {
            add(mesh.hu.iter().map(|&value| value > hu).collect());
        }
        for b in &section.boxes {
            add(mesh.vertices_in_box_mm(b.min_mm, b.max_mm));
        }
        for plane in &section.planes {
            add(mesh.vertices_beyond(plane).map_err(file.blame("fixed.planes"))?);
        }
        for axis in section.end_layers.iter().map(|axis| axis.index()) {
            let last = mesh.lattice.grid().shape[axis] - 1;
            let at_end = |v| [0, last].contains(&mesh.point(v)[axis]);
            add((0..mesh.positions.len() as u32).map(at_end).collect());
        }
        Ok(fixed)
    }
}
