//! The surface around an excised piece: walls along its outline, and a floor below it.

use nalgebra::{Point3, Vector3};

use super::blade::{Shape, Station};
use super::depth::SkinDepth;
use super::ribbon::Ribbon;
use crate::skin_surface::Facet;

/// The surface around a piece of tissue below a closed outline on the skin, down to a depth. The
/// inside is negative.
#[derive(Debug)]
pub(crate) struct Bowl {
    walls: Ribbon,
    /// 1, or −1 if the walls have their negative side outside.
    outside: f64,
    skin: SkinDepth,
    /// Depth of the floor below the skin in m.
    depth: f64,
    /// Half of the length of the outline in m.
    half: f64,
    /// Diagonal of the box around the walls in m.
    size: f64,
}

impl Bowl {
    /// A bowl inside closed stations, whose last one is the first one again, and the length of its
    /// outline. It reaches from `above` the skin to `depth` below it, and is known up to `margin`
    /// beyond that, all in m. `facets` are the skin near it, of a lattice with this step. None if
    /// the stations are not a path or enclose nothing.
    pub fn new(
        stations: &[Station],
        facets: Vec<Facet>,
        [depth, above, margin]: [f64; 3],
        step: f64,
    ) -> Option<(Self, f64)> {
        let (walls, length) = Ribbon::around(stations, depth, above, margin)?;
        // Area of the outline as a vector, by triangles from its first point. It points outwards
        // if the outline runs to the left, as seen from outside. Then its right side is outside.
        let origin = stations[0].skin;
        let pairs = stations.windows(2);
        let area: Vector3<f64> =
            pairs.map(|pair| (pair[0].skin - origin).cross(&(pair[1].skin - origin))).sum();
        let inward: Vector3<f64> = stations.iter().map(|station| station.inward).sum();
        let turns = -area.dot(&inward);
        if turns == 0.0 {
            return None;
        }
        let [low, high] = walls.bounds();
        let skin = SkinDepth::new(facets, depth + above + 2.0 * margin, step);
        let size = (high - low).norm();
        Some((Self { walls, outside: turns.signum(), skin, depth, half: length / 2.0, size }, length))
    }

    /// Signed distance, also far inside the bowl. None far outside it.
    fn signed(&self, position: Point3<f64>) -> Option<f64> {
        let across = self.outside * self.walls.distance(position, self.size)?;
        Some(across.max(self.skin.at(position)? - self.depth))
    }
}

impl Shape for Bowl {
    fn bounds(&self) -> [Point3<f64>; 2] {
        self.walls.bounds()
    }

    fn distance(&self, position: Point3<f64>, reach: f64) -> Option<f64> {
        self.signed(position).filter(|distance| distance.abs() <= reach)
    }

    /// The whole surface is cut at once.
    fn place(&self, _position: Point3<f64>, _reach: f64) -> Option<[f64; 2]> {
        Some([self.half, 0.0])
    }

    fn encloses(&self, position: Point3<f64>) -> bool {
        self.signed(position).is_some_and(|distance| distance < 0.0)
    }
}
