//! The walls of wounds: faces of the tissue that a cut has laid open.

use std::collections::HashMap;

use cutis_mesh::sever::Embedded;
use nalgebra::Point3;

use super::ends::Ends;
use super::places::Places;
use super::unmatched;
use crate::body::Body;

/// The faces of a positively oriented tet. Seen from outside, their corners turn to the left.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

/// A face by the places of its corners in the scan, in ascending order.
type Key = [u32; 3];

/// One side of a face.
pub(super) struct Side {
    pub(super) corners: [Embedded; 3],
    /// Whether the tissue behind it was taken out.
    pub(super) out: bool,
    /// Number of sides before it.
    number: usize,
}

/// The triangles of the walls, with the outside on the left of their corners' order.
///
/// Two tets, or parts of tets, meet at a face in the scan. The face is a wall where they do not
/// follow the same nodes, and where one of them was taken out.
pub(super) fn walls(body: &Body, ends: &Ends<'_>, places: &mut Places) -> Vec<[Embedded; 3]> {
    let mesh = &body.mesh;
    let (whole, copies) = mesh.tets.split_at(mesh.whole_tets());
    let mut near = vec![false; mesh.positions.len()];
    let touched = copies.iter().chain(&body.removed.tets).flatten();
    touched.for_each(|&v| near[v as usize] = true);
    if let Some(severed) = &body.severed {
        severed.virtual_nodes.iter().for_each(|&v| near[v as usize] = true);
    }
    let mut faces = Faces::new(&mesh.positions, places);
    let around = whole.iter().filter(|tet| tet.iter().filter(|&&v| near[v as usize]).count() > 2);
    around.for_each(|tet| faces.add(tet.map(Embedded::node), false));
    body.removed.tets.iter().for_each(|tet| faces.add(tet.map(Embedded::node), true));
    if let Some(severed) = &body.severed {
        let nodes = mesh.positions.len();
        let corner = |v: u32| match (v as usize).checked_sub(nodes) {
            Some(point) => ends.close(severed.tet_pieces.points[point]),
            None => ends.close(Embedded::node(v)),
        };
        severed.tet_pieces.simplices.iter().for_each(|tet| faces.add(tet.map(corner), false));
        severed.taken_out.iter().flatten().for_each(|tet| faces.add(tet.map(corner), true));
    }
    faces.walls(mesh.lattice.longest_step_mm() / 1000.0)
}

/// Faces of which one side is known, and the walls found so far.
struct Faces<'a> {
    positions: &'a [Point3<f32>],
    places: &'a mut Places,
    open: HashMap<Key, Side>,
    walls: Vec<[Embedded; 3]>,
    sides: usize,
}

impl<'a> Faces<'a> {
    fn new(positions: &'a [Point3<f32>], places: &'a mut Places) -> Self {
        Self { positions, places, open: HashMap::new(), walls: Vec::new(), sides: 0 }
    }

    /// The walls. `step_m` is the step of the lattice.
    fn walls(self, step_m: f64) -> Vec<[Embedded; 3]> {
        let Self { positions, open, mut walls, .. } = self;
        let mut open: Vec<Side> = open.into_values().collect();
        open.sort_unstable_by_key(|side| side.number);
        walls.extend(unmatched::walls(&open, positions, step_m));
        walls
    }

    fn add(&mut self, tet: [Embedded; 4], out: bool) {
        let at = tet.map(|corner| corner.at(self.positions));
        let places = at.map(|at| self.places.number(at));
        // A tet without an extent separates nothing. The faces at both sides of it are one.
        if (1..4).any(|n| places[..n].contains(&places[n])) {
            return;
        }
        let [a, b, c, d] = at.map(|at| at.cast::<f64>());
        let turned = (b - a).cross(&(c - a)).dot(&(d - a)) < 0.0;
        for [i, j, k] in FACES {
            let face = if turned { [i, k, j] } else { [i, j, k] };
            let mut key = face.map(|n| places[n]);
            key.sort_unstable();
            let side = Side { corners: face.map(|n| tet[n]), out, number: self.sides };
            self.sides += 1;
            let Some(other) = self.open.remove(&key) else {
                self.open.insert(key, side);
                continue;
            };
            if other.out != side.out || (!side.out && !same_nodes(&other, &side)) {
                self.walls
                    .extend([other, side].into_iter().filter(|side| !side.out).map(|side| side.corners));
            }
        }
    }
}

/// Whether two sides of a face follow the same nodes.
fn same_nodes(a: &Side, b: &Side) -> bool {
    let nodes = |side: &Side| {
        let mut all: Vec<u32> = side.corners.iter().flat_map(nodes_of).collect();
        all.sort_unstable();
        all.dedup();
        all
    };
    nodes(a) == nodes(b)
}

/// The nodes that a point follows.
pub(super) fn nodes_of(point: &Embedded) -> impl Iterator<Item = u32> {
    let pairs = point.nodes.into_iter().zip(point.weights);
    pairs.filter(|&(_, weight)| weight != 0.0).map(|(node, _)| node)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes 0 to 3 are a square, 4 is above it and 5 below. Nodes 6 to 9 are copies of the square.
    fn square() -> Vec<Point3<f32>> {
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let apexes = [[0.5, 0.5, 1.0], [0.5, 0.5, -1.0]];
        square.into_iter().chain(apexes).chain(square).map(Point3::from).collect()
    }

    /// The walls between two tets above the square and two below it, where the square has its
    /// other diagonal if `crossed`, and the copies of its nodes if `apart`. The tissue below may be
    /// taken out.
    fn between(crossed: bool, apart: bool, out: bool, positions: &[Point3<f32>]) -> usize {
        let first = if apart { 6 } else { 0 };
        let below = if crossed { [[0, 1, 3], [1, 2, 3]] } else { [[0, 1, 2], [0, 2, 3]] };
        let mut places = Places::new(1000.0);
        let mut faces = Faces::new(positions, &mut places);
        // Corner 2 follows the other three, as a point in the face of a tet does.
        let corner = |first: u32, v: u32| match v {
            2 => Embedded { nodes: [0, 1, 3, 3].map(|v| first + v), weights: [-1.0, 1.0, 1.0, 0.0] },
            v => Embedded::node(first + v),
        };
        let tet = |first, [a, b, c]: [u32; 3], apex| {
            [corner(first, a), corner(first, b), corner(first, c), Embedded::node(apex)]
        };
        for triangle in [[0, 1, 2], [0, 2, 3]] {
            faces.add(tet(0, triangle, 4), false);
        }
        for triangle in below {
            faces.add(tet(first, triangle, 5), out);
        }
        faces.walls(1.0).len()
    }

    /// A wall has two sides if the tissue on both of them is there. It does not matter how the
    /// square is divided on either side.
    #[test]
    fn a_wall_is_where_both_sides_do_not_move_together() {
        for crossed in [false, true] {
            assert_eq!(between(crossed, true, false, &square()), 4, "{crossed}");
            assert_eq!(between(crossed, true, true, &square()), 2, "{crossed}");
            assert_eq!(between(crossed, false, true, &square()), 2, "{crossed}");
            assert_eq!(between(crossed, false, false, &square()), 0, "{crossed}: control");
        }
    }

    /// Copies of nodes that rounding has moved are at the same place. Others are not.
    #[test]
    fn rounding_does_not_hide_a_wall() {
        let moved = |by: f32| {
            let mut positions = square();
            positions[6..].iter_mut().for_each(|place| *place += nalgebra::Vector3::repeat(by));
            positions
        };
        assert_eq!(between(false, true, false, &moved(1e-6)), 4);
        assert_eq!(between(true, true, false, &moved(1e-6)), 4);
        assert_eq!(between(false, true, false, &moved(0.1)), 0, "control");
    }

    /// A tet without an extent, at a copy of a node, makes no wall.
    #[test]
    fn a_flat_tet_separates_nothing() {
        let mut positions = square();
        // Node 7, the copy of node 1, lies at node 2.
        positions[7] = positions[2];
        let mut places = Places::new(1000.0);
        let mut faces = Faces::new(&positions, &mut places);
        for tet in [[0, 1, 2, 4], [0, 7, 2, 4]] {
            faces.add(tet.map(Embedded::node), false);
        }
        assert!(faces.walls(1.0).is_empty());
    }
}
