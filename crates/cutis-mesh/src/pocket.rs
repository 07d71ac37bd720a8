//! Undermining: tissue below the skin is separated along a surface parallel to the skin.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::piece::Piece;
use crate::sever::{Blade, PocketFloor, longest_edge, stations};
use crate::skin_surface::{Facet, SkinSurface};
use crate::slit::Slit;
use crate::{Lattice, MeshError};

/// An undermining: the skin around a wound is separated from what is below it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Undermining {
    /// Number of the wound from which it is made: incisions first, then excisions.
    pub wound: usize,
    /// How far it reaches from the incision or the outline in all directions, in mm.
    pub distance_mm: f64,
    /// Depth below the skin in mm.
    pub depth_mm: f64,
}

/// An undermining placed on the skin at rest: a blade parallel to the skin.
#[derive(Clone, Debug)]
pub struct Pocket {
    /// What cuts.
    pub(crate) blade: Blade,
    /// The path of its wound, at the depth of the pocket, in local meters.
    path: Vec<Point3<f64>>,
    /// How far it reaches from the path in m.
    reach: f64,
}

impl Pocket {
    /// Places underminings below the skin of a lattice. `slits` and `pieces` are those of
    /// [`Slit::on_lattice`] and [`Piece::on_lattice`] for the same `skin`.
    ///
    /// # Errors
    /// [`MeshError::VertexIndex`] if a triangle names a point that does not exist.
    /// [`MeshError::Undermining`] if a length is not finite and positive, if there is no such
    /// wound, or if it is not as deep as the undermining.
    pub fn on_lattice(
        lattice: &Lattice,
        skin: &[[u32; 3]],
        slits: &[Slit],
        pieces: &[Piece],
        underminings: &[Undermining],
    ) -> Result<Vec<Self>, MeshError> {
        if underminings.is_empty() {
            return Ok(Vec::new());
        }
        let surface = SkinSurface::new(lattice, skin)?;
        let incisions = slits.chunk_by(|a, b| a.incision == b.incision);
        let wounds: Vec<&[Slit]> = incisions.chain(pieces.iter().map(|piece| &piece.outline[..])).collect();
        let closed = wounds.len() - pieces.len();
        let place = |(number, undermining): (usize, &Undermining)| {
            let wound = wounds.get(undermining.wound).copied().unwrap_or_default();
            Self::place(lattice, &surface, (wound, undermining.wound >= closed), number, undermining)
        };
        underminings.iter().enumerate().map(place).collect()
    }

    fn place(
        lattice: &Lattice,
        surface: &SkinSurface<'_>,
        (slits, closed): (&[Slit], bool),
        number: usize,
        undermining: &Undermining,
    ) -> Result<Self, MeshError> {
        let refuse = |why: String| Err(MeshError::Undermining { undermining: number, why });
        let Undermining { wound, distance_mm, depth_mm } = *undermining;
        for (key, value) in [("distance_mm", distance_mm), ("depth_mm", depth_mm)] {
            if !(value.is_finite() && value > 0.0) {
                return refuse(format!("`{key}` is {value}; it must be finite and positive"));
            }
        }
        let own: Vec<&Slit> = slits.iter().collect();
        let Some(first) = own.first() else {
            return refuse(format!("there is no wound {wound}"));
        };
        let (depth, distance) = (depth_mm / 1000.0, distance_mm / 1000.0);
        if first.depth() < depth || !first.removes_nothing() {
            return refuse(format!(
                "it is {depth_mm} mm deep, but wound {wound} is {:.1} mm deep; make the wound as deep, and \
                 without a width",
                first.depth() * 1000.0
            ));
        }
        let Some(stations) = stations(&own, surface.step / 2.0, closed) else {
            return refuse(format!("wound {wound} is not a path"));
        };
        let path: Vec<Point3<f64>> =
            stations.iter().map(|station| station.skin + station.inward * depth).collect();
        let margin = 2.0 * longest_edge(lattice);
        let far = distance + 2.0 * (depth + margin);
        let closest = |at: Point3<f64>| {
            let closer = |a: &&&Slit, b: &&&Slit| a.distance(at.cast()).total_cmp(&b.distance(at.cast()));
            own.iter().min_by(closer).map_or_else(Vector3::zeros, |slit| slit.inward())
        };
        let near = |facet: &&Facet| {
            distance_to(&path, facet.center).0 <= far && facet.faces_out(&closest(facet.center))
        };
        let facets = surface.facets.iter().filter(near).copied().collect();
        let floor = PocketFloor::new(facets, &path, [depth, distance, margin], surface.step);
        Ok(Self { blade: Blade::parallel(floor, distance), path, reach: distance })
    }

    /// Distance in m from a rest position to the pocket.
    pub fn distance(&self, position: Point3<f32>) -> f64 {
        (distance_to(&self.path, position.cast()).0 - self.reach).max(0.0)
    }
}

/// Distance in m from a path to a position, and the length along the path to its closest point.
pub(crate) fn distance_to(path: &[Point3<f64>], position: Point3<f64>) -> (f64, f64) {
    let (mut best, mut before) = ((f64::INFINITY, 0.0), 0.0);
    for ends in path.windows(2) {
        let along = ends[1] - ends[0];
        let length = along.norm();
        let part = ((position - ends[0]).dot(&along) / (length * length)).clamp(0.0, 1.0);
        let distance = (position - (ends[0] + along * part)).norm();
        if distance < best.0 {
            best = (distance, before + part * length);
        }
        before += length;
    }
    best
}
