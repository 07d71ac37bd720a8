//! Excision: a piece of tissue below a closed outline on the skin is taken out.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::incision::Incision;
use crate::path::check_outline;
use crate::sever::{Blade, Bowl, Station, longest_edge, stations};
use crate::skin_surface::{Facet, SkinSurface};
use crate::slit::Slit;
use crate::{Lattice, MeshError};

/// An excision: tissue below a closed outline on the skin is taken out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Excision {
    /// Points of the outline on or near the skin, in mm. The last one is the first one again.
    pub path_mm: Vec<[f64; 3]>,
    /// Depth below the skin in mm.
    pub depth_mm: f64,
}

/// An excision placed on the skin at rest.
#[derive(Clone, Debug)]
pub struct Piece {
    /// What cuts: the two blades of [`Blade::around`].
    pub(crate) blades: [Blade; 2],
    /// Segments of the outline.
    pub(crate) outline: Vec<Slit>,
    /// The straight line between the two points of the outline that are farthest apart. The wound
    /// is closed along it.
    pub(crate) axis: Slit,
}

impl Piece {
    /// Places excisions on the skin of a lattice. `skin` holds triangles in flat lattice indices.
    ///
    /// # Errors
    /// [`MeshError::VertexIndex`] if a triangle names a point that does not exist.
    /// [`MeshError::Excision`] if an outline is not closed, crosses itself, encloses nothing or is
    /// too far from the skin.
    pub fn on_lattice(
        lattice: &Lattice,
        skin: &[[u32; 3]],
        excisions: &[Excision],
    ) -> Result<Vec<Self>, MeshError> {
        if excisions.is_empty() {
            return Ok(Vec::new());
        }
        let surface = SkinSurface::new(lattice, skin)?;
        let place = |(number, excision)| Self::place(lattice, &surface, number, excision);
        excisions.iter().enumerate().map(place).collect()
    }

    fn place(
        lattice: &Lattice,
        surface: &SkinSurface<'_>,
        number: usize,
        excision: &Excision,
    ) -> Result<Self, MeshError> {
        let refuse = |why: String| MeshError::Excision { excision: number, why };
        let Excision { path_mm, depth_mm } = excision;
        if path_mm.first() != path_mm.last() || path_mm.len() < 4 {
            return Err(refuse(
                "its outline is not closed; give three points or more, and the first one again at the end"
                    .to_owned(),
            ));
        }
        check_outline(path_mm, lattice.longest_step_mm())
            .map_err(|why| refuse(format!("its outline cannot be cut: {why}")))?;
        // The messages about segments begin with the number of an incision.
        let of_outline = |error: MeshError| {
            let text = error.to_string();
            refuse(text.split_once(": ").map_or(text.clone(), |(_, rest)| rest.to_owned()))
        };
        let depth_mm = *depth_mm;
        let incision = Incision { path_mm: path_mm.clone(), depth_mm, width_mm: None };
        let place = |ends: [[f64; 3]; 2]| Slit::place(surface, number, &incision, ends).map_err(of_outline);
        let outline: Vec<Slit> =
            path_mm.windows(2).map(|ends| place([ends[0], ends[1]])).collect::<Result<_, _>>()?;
        let axis = place(farthest(path_mm))?;
        let of_path: Vec<&Slit> = outline.iter().collect();
        let stations = stations(&of_path, surface.step / 2.0, true);
        let above = outline.iter().map(Slit::above).fold(0.0, f64::max);
        let margin = 2.0 * longest_edge(lattice);
        let far = 2.0 * (depth_mm / 1000.0 + above + margin) + axis.length();
        let middle = axis.skin_at(axis.length() / 2.0);
        let near = |facet: &&Facet| (facet.center - middle).norm() <= far && facet.faces_out(&axis.inward());
        let facets = surface.facets.iter().filter(near).copied().collect();
        let sizes = [depth_mm / 1000.0, above, margin];
        let bowl = stations.and_then(|stations| {
            let ends = [0.0, axis.length()].map(|along| closest(&stations, axis.skin_at(along)));
            let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            Bowl::new(&stations, ends, facets, sizes, surface.step)
        });
        let bowl = bowl.ok_or_else(|| refuse("its outline encloses nothing".to_owned()))?;
        Ok(Self { blades: Blade::around(bowl), outline, axis })
    }

    /// The straight line between the two points of the outline that are farthest apart.
    pub fn axis(&self) -> &Slit {
        &self.axis
    }

    /// Distance in m from a rest position to the walls of the piece, and zero inside it.
    pub fn distance(&self, position: Point3<f32>) -> f64 {
        let inside = self.blades[0].encloses(position.cast());
        let walls = self.outline.iter().map(|slit| slit.distance(position)).fold(f64::INFINITY, f64::min);
        if inside { 0.0 } else { walls }
    }
}

/// Number of the station that is closest to a point, of several the first one.
fn closest(stations: &[Station], to: Point3<f64>) -> usize {
    let far = |n: &usize| (stations[*n].skin - to).norm_squared();
    (0..stations.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or_default()
}

/// The two points that are farthest apart.
fn farthest(points: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let apart = |[a, b]: [[f64; 3]; 2]| (Point3::from(a) - Point3::from(b)).norm_squared();
    let pairs = points.iter().enumerate().flat_map(|(n, &a)| points[..n].iter().map(move |&b| [b, a]));
    pairs.max_by(|a, b| apart(*a).total_cmp(&apart(*b))).unwrap_or_default()
}
