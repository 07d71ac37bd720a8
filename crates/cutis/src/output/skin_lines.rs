//! Normals and lines of tension at the triangles of a skin, for mesh files and pictures.

use cutis_mesh::vtk::{DataArray, Values};

use crate::body::Body;
use crate::scene::Scene;

/// Fields at the triangles of a skin. They describe the shape in the scan, also for a skin that has
/// moved. All arrays have one entry per triangle.
#[derive(Default)]
pub(super) struct SkinLines {
    /// Outward unit normals of the smooth skin.
    normals: Vec<[f32; 3]>,
    /// Unit vectors along the lines. The sign has no meaning.
    pub(super) directions: Vec<[f32; 3]>,
    /// How much each direction counts, 0 to 1.
    pub(super) weights: Vec<f32>,
    /// Tension along and across the lines, N/m; none with a formulation that knows no forces.
    tension: Option<[Vec<f32>; 2]>,
}

impl SkinLines {
    /// The fields at the triangles of the whole skin ([`Body::whole_skin`]). None without a
    /// membrane.
    pub(super) fn of(body: &Body, scene: &Scene) -> Option<Self> {
        let section = scene.constraints.membrane.as_ref()?;
        let triangles = body.skin_in_scan();
        let mut lines = Self::default();
        let mut tension = [Vec::new(), Vec::new()];
        for tangent in body.tangents(&triangles)? {
            lines.normals.push(tangent.normal.cast::<f32>().into());
            lines.directions.push(tangent.along.cast::<f32>().into());
            lines.weights.push(tangent.weight as f32);
            let values = section.tension_at(&tangent, scene.solver.formulation).into_iter().flatten();
            tension.iter_mut().zip(values).for_each(|(array, value)| array.push(value as f32));
        }
        let has_tension = tension[0].len() == triangles.len();
        Some(Self { tension: has_tension.then_some(tension), ..lines })
    }

    /// The arrays of a mesh file.
    pub(super) fn arrays(&self) -> Vec<DataArray<'_>> {
        let mut arrays = vec![
            DataArray { name: "scan_normal", values: Values::Vectors(&self.normals) },
            DataArray { name: "scan_line_direction", values: Values::Vectors(&self.directions) },
            DataArray { name: "scan_line_weight", values: Values::Scalars(&self.weights) },
        ];
        if let Some([along, across]) = &self.tension {
            arrays.extend([
                DataArray { name: "scan_tension_along_n_per_m", values: Values::Scalars(along) },
                DataArray { name: "scan_tension_across_n_per_m", values: Values::Scalars(across) },
            ]);
        }
        arrays
    }
}
