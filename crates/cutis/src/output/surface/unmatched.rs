//! Walls among faces that have no face with the same corners on their other side.
//!
//! Two cuts that meet in a tet may divide one of its faces otherwise than the next tet does. There
//! the tissue on the other side is looked up at the center of each face.

use std::collections::{BTreeMap, HashMap};

use cutis_mesh::sever::Embedded;
use nalgebra::{Point3, Vector3};

use super::walls::Side;

/// Distance of a point from the plane of a face, in lattice steps, up to which it lies on the face.
const FLAT: f64 = 1e-3;

/// Share of a corner, below 0, down to which a point is in a face: it may lie on the edge of two.
const EDGE: f64 = 1e-6;

/// Sum of the differences between the weights of two points that move alike.
const ALIKE: f64 = 0.05;

/// The faces of `open` whose center lies on a face that looks the other way, and moves otherwise or
/// has no tissue behind it. `step_m` is the step of the lattice.
pub(super) fn walls(open: &[Side], positions: &[Point3<f32>], step_m: f64) -> Vec<[Embedded; 3]> {
    let faces: Vec<Face<'_>> = open.iter().map(|side| Face::new(side, positions)).collect();
    let slack = Vector3::repeat(FLAT * step_m);
    let mut near: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for (n, Face { at: [a, b, c], .. }) in faces.iter().enumerate() {
        let (low, high) = (a.inf(b).inf(c) - slack, a.sup(b).sup(c) + slack);
        cells(low, high, step_m).for_each(|cell| near.entry(cell).or_default().push(n as u32));
    }
    let is_wall = |face: &&Face<'_>| {
        let center = face.center();
        let candidates = near.get(&cell(center, step_m)).into_iter().flatten().map(|&n| &faces[n as usize]);
        let opposite = candidates.filter(|other| other.normal.dot(&face.normal) < 0.0);
        let on = opposite.filter_map(|other| Some((other, other.shares(center, FLAT * step_m)?)));
        let mut on = on.peekable();
        !face.side.out
            && on.peek().is_some()
            && on.all(|(other, shares)| {
                other.side.out || !moves_alike((face.side, [1.0 / 3.0; 3]), (other.side, shares))
            })
    };
    faces.iter().filter(is_wall).map(|face| face.side.corners).collect()
}

/// The cell of a point, with a side of one step.
fn cell(at: Point3<f64>, step_m: f64) -> [i64; 3] {
    [0, 1, 2].map(|axis| (at[axis] / step_m).floor() as i64)
}

/// All cells of a box.
fn cells(low: Point3<f64>, high: Point3<f64>, step_m: f64) -> impl Iterator<Item = [i64; 3]> {
    let (first, last) = (cell(low, step_m), cell(high, step_m));
    let plane = move |x| (first[1]..=last[1]).map(move |y| [x, y]);
    let line = move |[x, y]: [i64; 2]| (first[2]..=last[2]).map(move |z| [x, y, z]);
    (first[0]..=last[0]).flat_map(plane).flat_map(line)
}

/// A side of a face with the places of its corners.
struct Face<'a> {
    side: &'a Side,
    at: [Point3<f64>; 3],
    normal: Vector3<f64>,
}

impl<'a> Face<'a> {
    fn new(side: &'a Side, positions: &[Point3<f32>]) -> Self {
        let [a, b, c] = side.corners.map(|corner| corner.at(positions).cast::<f64>());
        Self { side, at: [a, b, c], normal: (b - a).cross(&(c - a)) }
    }

    fn center(&self) -> Point3<f64> {
        let [a, b, c] = self.at;
        Point3::from((a.coords + b.coords + c.coords) / 3.0)
    }

    /// The shares of the corners in a point of the face, which may be off its plane by a distance.
    /// None outside of the face.
    fn shares(&self, point: Point3<f64>, distance: f64) -> Option<[f64; 3]> {
        let [a, b, c] = self.at;
        let off = (point - a).dot(&self.normal).abs() / self.normal.norm();
        let share = |from: Point3<f64>, to: Point3<f64>| {
            (to - from).cross(&(point - from)).dot(&self.normal) / self.normal.norm_squared()
        };
        let shares = [share(b, c), share(c, a), share(a, b)];
        (off <= distance && shares.iter().all(|share| *share >= -EDGE)).then_some(shares)
    }
}

/// Whether two points of faces, each with the shares of its corners, follow the same nodes alike.
fn moves_alike(a: (&Side, [f64; 3]), b: (&Side, [f64; 3])) -> bool {
    // In the order of the nodes, so that the sum is always the same.
    let mut weights: BTreeMap<u32, f64> = BTreeMap::new();
    for ((side, shares), sign) in [(a, 1.0), (b, -1.0)] {
        for (corner, share) in side.corners.iter().zip(shares) {
            for (node, weight) in corner.nodes.into_iter().zip(corner.weights) {
                *weights.entry(node).or_default() += sign * share * f64::from(weight);
            }
        }
    }
    weights.values().map(|weight| weight.abs()).sum::<f64>() < ALIKE
}
