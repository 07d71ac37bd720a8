//! The surface around an excised piece: walls along its outline, and a floor below it.
//!
//! A piece with pointed ends is thinner than a lattice step there. Both of its walls then cross the
//! same edges, and one distance cannot tell them apart: no corner is inside. So the outline is
//! divided at its two ends, and two blades cut the piece out. Each has the wall on its side of the
//! outline, which continues straight beyond the ends, and the floor. The piece is where both
//! distances are negative.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::blade::{Shape, Station};
use super::depth::{SPREAD_STEPS, SkinDepth};
use super::ribbon::Ribbon;
use crate::skin_surface::Facet;

/// How far the blades cut beyond the piece, in lattice steps, so that rounding leaves no edge at
/// its border whole.
const BEYOND_STEPS: f64 = 0.1;

/// The surface around a piece of tissue below a closed outline on the skin, down to a depth. The
/// inside is negative.
#[derive(Debug)]
pub(crate) struct Bowl {
    /// The walls along the whole outline.
    around: Ribbon,
    /// The walls on both sides of the outline, and their lengths in m.
    walls: [(Ribbon, f64); 2],
    /// 1, or −1 if the walls have their negative side outside.
    outside: f64,
    skin: SkinDepth,
    /// Depth of the floor below the skin in m.
    depth: f64,
    /// Length of the outline in m.
    length: f64,
    /// How far the blades cut beyond the piece, in m.
    slack: f64,
    /// Diagonal of the box around the walls in m.
    size: f64,
}

/// The part of a bowl that one of two blades cuts.
#[derive(Debug)]
pub(crate) struct BowlSide {
    bowl: Arc<Bowl>,
    side: usize,
}

impl Bowl {
    /// A bowl inside closed stations, whose last one is the first one again. The outline has its
    /// ends at two stations, in ascending order. The bowl reaches from `above` the skin to `depth`
    /// below it, and is known up to `margin` beyond that, all in m. `facets` are the skin near it,
    /// of a lattice with this step. None if the stations are not a path or enclose nothing.
    pub fn new(
        stations: &[Station],
        [start, end]: [usize; 2],
        facets: Vec<Facet>,
        [depth, above, margin]: [f64; 3],
        step: f64,
    ) -> Option<Self> {
        let (around, length) = Ribbon::around(stations, depth, above, margin)?;
        // The first station is the last one too.
        let there = stations.get(start..=end)?;
        let back = [&stations[end..], stations.get(1..=start)?].concat();
        let wall = |stations: &[Station]| Ribbon::along(stations, depth, above, margin);
        let walls = [wall(there)?, wall(&back)?];
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
        let (outside, slack) = (turns.signum(), BEYOND_STEPS * step);
        // The skin of the piece and around it. Without this limit, skin on the other side of the
        // body would count for positions deep below the piece, and the floor would continue there.
        let (width, bottom) = (margin + SPREAD_STEPS * step, depth + margin);
        let belongs = |center: Point3<f64>| {
            let distance = around.distance(center, f64::INFINITY);
            let place = around.place(center, f64::INFINITY);
            distance.is_some_and(|distance| outside * distance <= width)
                && place.is_some_and(|[_, t]| t < bottom - 1e-6 * step)
        };
        let skin = SkinDepth::new(
            facets.into_iter().filter(|facet| belongs(facet.center)).collect(),
            depth.max(above) + margin,
            step,
        );
        let mut bowl = Self { around, walls, outside, skin, depth, length, slack, size: 0.0 };
        let [low, high] = bowl.bounds();
        bowl.size = (high - low).norm();
        Some(bowl)
    }

    /// Its two sides.
    pub fn sides(self) -> [BowlSide; 2] {
        let bowl = Arc::new(self);
        [0, 1].map(|side| BowlSide { bowl: Arc::clone(&bowl), side })
    }

    /// Length of the outline in m.
    pub fn length(&self) -> f64 {
        self.length
    }

    fn bounds(&self) -> [Point3<f64>; 2] {
        let [[a, b], [c, d]] = self.walls.each_ref().map(|(wall, _)| wall.bounds());
        [a.inf(&c), b.sup(&d)]
    }

    /// Signed distance to the walls along an outline. None far away.
    fn across(&self, wall: &Ribbon, position: Point3<f64>) -> Option<f64> {
        Some(self.outside * wall.distance(position, self.size)?)
    }

    /// Height above the floor, negative below the skin above it.
    fn below_floor(&self, position: Point3<f64>) -> Option<f64> {
        Some(self.skin.at(position)? - self.depth)
    }

    /// Whether a position is in the piece.
    fn encloses(&self, position: Point3<f64>) -> bool {
        let inside = |distance: Option<f64>| distance.is_some_and(|distance| distance < 0.0);
        inside(self.across(&self.around, position)) && inside(self.below_floor(position))
    }
}

impl BowlSide {
    /// Distance in m by which a position on the surface is beyond the part that is cut. Negative on
    /// that part.
    fn beyond(&self, position: Point3<f64>) -> Option<f64> {
        let [(own, length), (other, _)] = [self.side, 1 - self.side]
            .map(|side| &self.bowl.walls[side])
            .map(|(wall, length)| (wall, *length));
        if self.bowl.across(own, position)? >= self.bowl.below_floor(position)? {
            let [along, _] = own.place(position, self.bowl.size)?;
            Some(f64::max(-along, along - length))
        } else {
            self.bowl.across(other, position)
        }
    }
}

impl Shape for BowlSide {
    fn bounds(&self) -> [Point3<f64>; 2] {
        self.bowl.bounds()
    }

    fn distance(&self, position: Point3<f64>, reach: f64) -> Option<f64> {
        let across = self.bowl.across(&self.bowl.walls[self.side].0, position)?;
        let distance = across.max(self.bowl.below_floor(position)?);
        Some(distance).filter(|distance| distance.abs() <= reach)
    }

    /// The whole surface is cut at once.
    fn place(&self, position: Point3<f64>, _reach: f64) -> Option<[f64; 2]> {
        let Bowl { length, slack, .. } = *self.bowl;
        Some([(length + self.beyond(position)? - slack).max(length / 2.0), 0.0])
    }

    /// The first of the two blades takes the piece out.
    fn encloses(&self, position: Point3<f64>) -> bool {
        self.side == 0 && self.bowl.encloses(position)
    }
}
