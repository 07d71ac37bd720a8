//! The walls of wounds: faces of the tissue that a cut has laid open.

use std::collections::HashMap;

use cutis_mesh::sever::Embedded;
use nalgebra::Point3;

use super::ends::Ends;
use crate::body::Body;

/// The faces of a positively oriented tet. Seen from outside, their corners turn to the left.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

/// A face by the bits of the positions of its corners in the scan, in ascending order.
type Key = [[u32; 3]; 3];

/// One side of a face.
struct Side {
    corners: [Embedded; 3],
    /// Whether the tissue behind it was taken out.
    out: bool,
}

/// The triangles of the walls, with the outside on the left of their corners' order.
///
/// Two tets, or parts of tets, meet at a face in the scan. The face is a wall where they do not
/// follow the same nodes, and where one of them was taken out.
pub(super) fn walls(body: &Body, ends: &Ends<'_>) -> Vec<[Embedded; 3]> {
    let mesh = &body.mesh;
    let (whole, copies) = mesh.tets.split_at(mesh.whole_tets());
    let mut near = vec![false; mesh.positions.len()];
    let touched = copies.iter().chain(&body.removed.tets).flatten();
    touched.for_each(|&v| near[v as usize] = true);
    if let Some(severed) = &body.severed {
        severed.virtual_nodes.iter().for_each(|&v| near[v as usize] = true);
    }
    let mut faces = Faces { positions: &mesh.positions, open: HashMap::new(), walls: Vec::new() };
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
    faces.walls
}

/// Faces of which one side is known, and the walls found so far.
struct Faces<'a> {
    positions: &'a [Point3<f32>],
    open: HashMap<Key, Side>,
    walls: Vec<[Embedded; 3]>,
}

impl Faces<'_> {
    fn add(&mut self, tet: [Embedded; 4], out: bool) {
        let at = tet.map(|corner| corner.at(self.positions));
        let [a, b, c, d] = at.map(|at| at.cast::<f64>());
        let turned = (b - a).cross(&(c - a)).dot(&(d - a)) < 0.0;
        for [i, j, k] in FACES {
            let face = if turned { [i, k, j] } else { [i, j, k] };
            let mut key = face.map(|n| <[f32; 3]>::from(at[n]).map(f32::to_bits));
            key.sort_unstable();
            let side = Side { corners: face.map(|n| tet[n]), out };
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
