//! The surface of a blade that follows a path on the skin.

use nalgebra::{Point3, Vector3};

use super::blade::{Shape, Station};
use super::surface::{Closest, Surface};

/// A strip of triangles through stations along a path, from above the skin to below it.
#[derive(Debug)]
pub(super) struct Ribbon {
    surface: Surface,
    /// Coordinates of the corners of each triangle.
    coordinates: Vec<[[f64; 2]; 3]>,
}

impl Ribbon {
    /// A ribbon and the length of its path in m. It continues by `margin` beyond the ends of the
    /// path and below `depth`. None if the stations are not a path.
    pub fn along(stations: &[Station], depth: f64, above: f64, margin: f64) -> Option<(Self, f64)> {
        let steps = steps(stations)?;
        let (first, last) = (stations.first()?, stations.last()?);
        let unit = |step: Option<&Vector3<f64>>| step.and_then(|step| step.try_normalize(0.0));
        let (start, end) = (unit(steps.first())?, unit(steps.last())?);
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
        Some((Self::through(&along, [-above - margin, depth + margin]), length))
    }

    /// A ribbon around a closed path, whose last station is the first one again, and the length of
    /// the path in m. None if the stations are not a path.
    pub fn around(stations: &[Station], depth: f64, above: f64, margin: f64) -> Option<(Self, f64)> {
        let steps = steps(stations)?;
        let mut length = 0.0;
        let mut along = vec![(0.0, *stations.first()?)];
        for (station, step) in stations[1..].iter().zip(&steps) {
            length += step.norm();
            along.push((length, *station));
        }
        Some((Self::through(&along, [-above - margin, depth + margin]), length))
    }

    fn through(along: &[(f64, Station)], rows: [f64; 2]) -> Self {
        let point =
            |&(s, station): &(f64, Station)| rows.map(|t| (station.skin + station.inward * t, [s, t]));
        let columns: Vec<_> = along.iter().map(point).collect();
        let points: Vec<Point3<f64>> = columns.iter().flatten().map(|(p, _)| *p).collect();
        let places: Vec<[f64; 2]> = columns.iter().flatten().map(|(_, place)| *place).collect();
        let quads = (0..columns.len() as u32 - 1).map(|n| 2 * n);
        let triangles: Vec<[u32; 3]> =
            quads.flat_map(|n| [[n, n + 1, n + 2], [n + 1, n + 3, n + 2]]).collect();
        let coordinates = triangles.iter().map(|t| t.map(|p| places[p as usize])).collect();
        // A closed path has its first column twice. Both are one for the normals.
        let last = points.len() as u32 - 2;
        let closed = along.len() > 2 && points[0] == points[last as usize];
        let same = |p: u32| if closed && p >= last { p - last } else { p };
        let joined: Vec<[u32; 3]> = triangles.iter().map(|triangle| triangle.map(same)).collect();
        Self { surface: Surface::new(&points, &joined), coordinates }
    }
}

/// The steps between stations. None if there are fewer than two stations, or two equal neighbors.
fn steps(stations: &[Station]) -> Option<Vec<Vector3<f64>>> {
    let steps: Vec<Vector3<f64>> = stations.windows(2).map(|pair| pair[1].skin - pair[0].skin).collect();
    let fits = !steps.is_empty() && steps.iter().all(|step| step.norm() > 0.0);
    fits.then_some(steps)
}

impl Shape for Ribbon {
    fn bounds(&self) -> [Point3<f64>; 2] {
        self.surface.bounds()
    }

    fn distance(&self, position: Point3<f64>, reach: f64) -> Option<f64> {
        Some(self.surface.closest(position, reach)?.signed)
    }

    fn place(&self, position: Point3<f64>, reach: f64) -> Option<[f64; 2]> {
        let Closest { triangle, weights, .. } = self.surface.closest(position, reach)?;
        let coordinate = |n: usize| -> f64 {
            self.coordinates[triangle].iter().zip(&weights).map(|(place, weight)| place[n] * weight).sum()
        };
        Some([coordinate(0), coordinate(1)])
    }
}
