//! Blades: surfaces along which tissue is severed.

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::bowl::{Bowl, BowlSide};
use super::components::EDGES;
use super::divide::LEAST_CUT;
use super::pocket::PocketFloor;
use super::ribbon::Ribbon;
use super::section::{Border, Section};
use super::severing::around_section;

/// Width in lattice steps of the border of a blade around a piece. All tissue of the piece comes
/// out, so the border is sharp.
const SHARP: f64 = 0.05;

/// A place on the skin that a blade passes, in local meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Point of the skin.
    pub skin: Point3<f64>,
    /// Unit vector into the body.
    pub inward: Vector3<f64>,
}

/// The surface of a blade, and the coordinates on it.
pub(super) trait Shape: Debug + Send + Sync {
    /// Smallest box around the surface in local meters: lower and upper corner.
    fn bounds(&self) -> [Point3<f64>; 2];

    /// Signed distance in m, up to `reach`. On the surface it is zero.
    fn distance(&self, position: Point3<f64>, reach: f64) -> Option<f64>;

    /// Coordinates in m of the closest point of the surface, also beyond the part that cuts: the
    /// length that the blade has passed when it cuts there, and the depth.
    fn place(&self, position: Point3<f64>, reach: f64) -> Option<[f64; 2]>;

    /// True if the blade cuts a piece out and a position is in it.
    fn encloses(&self, _position: Point3<f64>) -> bool {
        false
    }
}

/// A surface that severs what crosses it. It removes nothing.
///
/// Each of its points has two coordinates in m: the length that the blade has passed when it cuts
/// there, and the depth below the skin. Only a range of the coordinates cuts. Beyond it the surface
/// continues, so that the signed distance is defined on both sides of its border.
#[derive(Clone, Debug)]
pub struct Blade {
    shape: Arc<dyn Shape>,
    /// Smallest box around the surface in local meters: lower and upper corner.
    bounds: [Point3<f64>; 2],
    /// Length of the path in m.
    length: f64,
    /// Depth of the cut in m. Infinite if only the length ends the cut.
    depth: f64,
    /// Width of the border of the cut in lattice steps.
    blur: f64,
    /// True if the cut has a border where it begins.
    begins: bool,
    /// True if this blade and the next one cut a piece out: what is negative for both.
    pub(super) with_next: bool,
}

/// How a blade cuts a tet.
pub(super) struct Across {
    /// Distances of the corners in m.
    pub distances: [f32; 4],
    /// The edges between both sides, as a mask.
    pub apart: u8,
    /// The edges that the blade severs, as a mask.
    pub severed: u8,
    /// Share of the section that is cut.
    pub cut: f64,
}

impl Blade {
    /// A blade through stations along a path on the skin, from above the skin to `depth` below it.
    /// Its positive side is on the right of the path, as seen from outside the body: in the
    /// direction inward × along.
    ///
    /// `above` is the height above the skin up to which it cuts: skin between two stations may lie
    /// higher than the line between them. `margin` is the length by which the surface continues
    /// beyond its border. It must be at least the longest lattice edge. All lengths are in m.
    ///
    /// None if the stations are not a path: fewer than two, or two equal neighbors.
    pub fn along(stations: &[Station], depth: f64, above: f64, margin: f64) -> Option<Self> {
        let (ribbon, length) = Ribbon::along(stations, depth, above, margin)?;
        Some(Self {
            bounds: ribbon.bounds(),
            shape: Arc::new(ribbon),
            length,
            depth,
            blur: 1.0,
            begins: true,
            with_next: false,
        })
    }

    /// A blade parallel to the skin that cuts from a path outwards, up to `distance` in m.
    pub(crate) fn parallel(floor: PocketFloor, distance: f64) -> Self {
        Self {
            bounds: floor.bounds(),
            shape: Arc::new(floor),
            length: distance,
            depth: f64::INFINITY,
            blur: 1.0,
            begins: false,
            with_next: false,
        }
    }

    /// The two blades around a piece, which they cut out at once.
    pub(crate) fn around(bowl: Bowl) -> [Self; 2] {
        let length = bowl.length();
        let blade = |(side, with_next): (BowlSide, bool)| Self {
            bounds: side.bounds(),
            shape: Arc::new(side),
            length,
            depth: f64::INFINITY,
            blur: SHARP,
            begins: false,
            with_next,
        };
        let [first, second] = bowl.sides();
        [(first, true), (second, false)].map(blade)
    }

    /// How the whole blade cuts a tet with these corners. `border` is that of the cut. None if all
    /// corners are on one side, or if the blade passes beyond its border.
    pub(super) fn across(&self, corners: &[Point3<f64>; 4], border: &Border, reach: f64) -> Option<Across> {
        let mut distances = [0.0; 4];
        for (distance, &corner) in distances.iter_mut().zip(corners) {
            *distance = signed(self.distance(corner, reach)?);
        }
        let place = |(a, b): (usize, usize)| {
            let (d, e) = (f64::from(distances[a]), f64::from(distances[b]));
            self.place(corners[a] + (corners[b] - corners[a]) * (d / (d - e)), reach)
        };
        let places: Option<Vec<[f64; 2]>> = around_section(&distances).into_iter().map(place).collect();
        let section = Section::new(&places.filter(|places| places.len() > 2)?);
        let cut = section.cut(border, self.length);
        let mask = |is_set: &dyn Fn(usize, usize) -> bool| {
            EDGES.iter().enumerate().fold(0, |mask, (n, &(a, b))| mask | u8::from(is_set(a, b)) << n)
        };
        let apart = mask(&|a, b| (distances[a] >= 0.0) != (distances[b] >= 0.0));
        let severed = mask(&|a, b| {
            self.crosses([corners[a], corners[b]], [distances[a], distances[b]], reach).is_some()
        });
        (cut >= LEAST_CUT).then_some(Across { distances, apart, severed, cut })
    }

    /// Length along the path at which an edge with these distances of its ends is severed. None if
    /// the blade does not cross it.
    pub(super) fn crosses(&self, [p, q]: [Point3<f64>; 2], [d, e]: [f32; 2], reach: f64) -> Option<f64> {
        if (d >= 0.0) == (e >= 0.0) {
            return None;
        }
        let (d, e) = (f64::from(d), f64::from(e));
        self.reached_at(p + (q - p) * (d / (d - e)), reach)
    }

    /// True if the blade severs the line between two positions. `reach` is at least its length.
    pub(crate) fn separates(&self, ends: [Point3<f64>; 2], reach: f64) -> bool {
        let side = |p: Point3<f64>| self.distance(p, reach).map(signed);
        let [Some(d), Some(e)] = ends.map(|p| Some(p).filter(|p| self.near(p, reach)).and_then(side)) else {
            return false;
        };
        self.crosses(ends, [d, e], reach).is_some()
    }

    /// True if a position is in the piece that the blade cuts out.
    pub(crate) fn encloses(&self, position: Point3<f64>) -> bool {
        self.near(&position, 0.0) && self.shape.encloses(position)
    }

    /// True if a position is at most `reach` from the box around the surface.
    pub(crate) fn near(&self, position: &Point3<f64>, reach: f64) -> bool {
        let [low, high] = self.bounds;
        (0..3).all(|axis| (low[axis] - reach..=high[axis] + reach).contains(&position[axis]))
    }

    /// Length of the path in m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Signed distance in m, up to `reach`. On the blade it is zero.
    pub(super) fn distance(&self, position: Point3<f64>, reach: f64) -> Option<f64> {
        self.shape.distance(position, reach)
    }

    /// Length along the path where a point of the surface is cut. None if it is beyond the border.
    pub(crate) fn reached_at(&self, position: Point3<f64>, reach: f64) -> Option<f64> {
        let [s, t] = self.place(position, reach)?;
        ((0.0..=self.length).contains(&s) && t <= self.depth).then_some(s)
    }

    /// Coordinates of the closest point of the surface, also beyond its border.
    pub(super) fn place(&self, position: Point3<f64>, reach: f64) -> Option<[f64; 2]> {
        self.shape.place(position, reach)
    }

    /// The border of the whole cut on a lattice with this step in m.
    pub(super) fn border(&self, step: f64) -> Border {
        let border = Border::new(self.length, self.depth, self.blur * step);
        if self.begins { border } else { border.without_start() }
    }
}

/// Rounds a distance to 32 bits. A negative distance stays negative.
pub(super) fn signed(distance: f64) -> f32 {
    let rounded = distance as f32;
    if distance < 0.0 && rounded == 0.0 { -f32::MIN_POSITIVE } else { rounded }
}
