//! Blades: surfaces along which tissue is severed.

use nalgebra::{Point3, Vector3};

use super::components::EDGES;
use super::surface::{Closest, Surface};

/// A place on the skin that a blade passes, in local meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Point of the skin.
    pub skin: Point3<f64>,
    /// Unit vector into the body.
    pub inward: Vector3<f64>,
}

/// A surface that severs what crosses it. It removes nothing.
///
/// Its positive side is on the right of the path, as seen from outside the body: in the direction
/// inward × along.
///
/// Each of its points has two coordinates in m: the length along the path, and the depth below the
/// skin. Only a range of the coordinates cuts. Beyond it the surface continues, so that the signed
/// distance is defined on both sides of its border.
#[derive(Debug)]
pub struct Blade {
    surface: Surface,
    /// Coordinates of the corners of each triangle.
    coordinates: Vec<[[f64; 2]; 3]>,
    /// Length of the path in m.
    length: f64,
    /// Depth of the cut in m.
    depth: f64,
}

impl Blade {
    /// A blade through stations along a path on the skin, from above the skin to `depth` below it.
    ///
    /// `above` is the height above the skin up to which it cuts: skin between two stations may lie
    /// higher than the line between them. `margin` is the length by which the surface continues
    /// beyond its border. It must be at least the longest lattice edge. All lengths are in m.
    ///
    /// None if the stations are not a path: fewer than two, or two equal neighbors.
    pub fn along(stations: &[Station], depth: f64, above: f64, margin: f64) -> Option<Self> {
        let steps: Vec<Vector3<f64>> = stations.windows(2).map(|pair| pair[1].skin - pair[0].skin).collect();
        let (first, last) = (stations.first()?, stations.last()?);
        let unit = |step: Option<&Vector3<f64>>| step.and_then(|step| step.try_normalize(0.0));
        let (start, end) = (unit(steps.first())?, unit(steps.last())?);
        if steps.iter().any(|step| step.norm() == 0.0) {
            return None;
        }
        // Stations with their length along the path. The first and the last one are beyond the
        // ends.
        let mut along = vec![(-margin, Station { skin: first.skin - start * margin, ..*first })];
        let mut length = 0.0;
        along.push((length, *first));
        for (station, step) in stations[1..].iter().zip(&steps) {
            length += step.norm();
            along.push((length, *station));
        }
        along.push((length + margin, Station { skin: last.skin + end * margin, ..*last }));
        let rows = [-above - margin, depth + margin];
        let point =
            |&(s, station): &(f64, Station)| rows.map(|t| (station.skin + station.inward * t, [s, t]));
        let columns: Vec<_> = along.iter().map(point).collect();
        let points: Vec<Point3<f64>> = columns.iter().flatten().map(|(p, _)| *p).collect();
        let places: Vec<[f64; 2]> = columns.iter().flatten().map(|(_, place)| *place).collect();
        let quads = (0..columns.len() as u32 - 1).map(|n| 2 * n);
        let triangles: Vec<[u32; 3]> =
            quads.flat_map(|n| [[n, n + 1, n + 2], [n + 1, n + 3, n + 2]]).collect();
        let coordinates = triangles.iter().map(|t| t.map(|p| places[p as usize])).collect();
        Some(Self { surface: Surface::new(&points, &triangles), coordinates, length, depth })
    }

    /// The distances of four corners in m, if the blade has corners on both sides, and the mask of
    /// the edges between them that it severs ([`EDGES`]).
    pub(crate) fn across(&self, corners: &[Point3<f64>; 4], reach: f64) -> Option<([f32; 4], u8)> {
        let mut distances = [0.0; 4];
        for (distance, &corner) in distances.iter_mut().zip(corners) {
            *distance = signed(self.distance(corner, reach)?);
        }
        let severed = EDGES.iter().enumerate().fold(0, |mask, (n, &(a, b))| {
            let crosses = self.crosses([corners[a], corners[b]], [distances[a], distances[b]], reach);
            mask | u8::from(crosses.is_some()) << n
        });
        (severed != 0).then_some((distances, severed))
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
        let [low, high] = self.bounds();
        let near =
            |p: &Point3<f64>| (0..3).all(|axis| (low[axis] - reach..=high[axis] + reach).contains(&p[axis]));
        let side = |p: Point3<f64>| self.distance(p, reach).map(signed);
        let [Some(d), Some(e)] = ends.map(|p| Some(p).filter(near).and_then(side)) else { return false };
        self.crosses(ends, [d, e], reach).is_some()
    }

    /// Length of the path in m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Smallest box around the surface in local meters: lower and upper corner.
    pub(super) fn bounds(&self) -> [Point3<f64>; 2] {
        self.surface.bounds()
    }

    /// Signed distance in m, up to `reach`. On the blade it is zero.
    pub(super) fn distance(&self, position: Point3<f64>, reach: f64) -> Option<f64> {
        Some(self.surface.closest(position, reach)?.signed)
    }

    /// Length along the path where a point of the surface is cut. None if it is beyond the border.
    fn reached_at(&self, position: Point3<f64>, reach: f64) -> Option<f64> {
        let [s, t] = self.place(position, reach)?;
        ((0.0..=self.length).contains(&s) && t <= self.depth).then_some(s)
    }

    /// Coordinates of the closest point of the surface, also beyond its border.
    pub(super) fn place(&self, position: Point3<f64>, reach: f64) -> Option<[f64; 2]> {
        let Closest { triangle, weights, .. } = self.surface.closest(position, reach)?;
        let coordinate = |n: usize| -> f64 {
            self.coordinates[triangle].iter().zip(&weights).map(|(place, weight)| place[n] * weight).sum()
        };
        Some([coordinate(0), coordinate(1)])
    }

    /// Depth of the cut in m.
    pub(super) fn depth(&self) -> f64 {
        self.depth
    }
}

/// Rounds a distance to 32 bits. A negative distance stays negative.
pub(super) fn signed(distance: f64) -> f32 {
    let rounded = distance as f32;
    if distance < 0.0 && rounded == 0.0 { -f32::MIN_POSITIVE } else { rounded }
}
