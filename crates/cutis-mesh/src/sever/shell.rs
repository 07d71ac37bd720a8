//! The shell of air around a body along cuts of no width.

use nalgebra::Point3;

use super::blade::Blade;
use super::components::{count, parts_of};
use super::pieces::{Builder, Pieces, unit};
use super::walls::Walls;

/// A vertex that follows others, at the place of a corner on the other side of a cut.
pub(crate) struct Follower {
    pub rest: Point3<f32>,
    /// The corners of its tet on its side of the cut.
    pub own_side: Vec<u32>,
}

/// The shell without the tets that blades divide, and what replaces these.
pub(crate) struct DividedShell {
    pub whole: Vec<[u32; 4]>,
    /// New vertices. The first one has the number `vertices`.
    pub followers: Vec<Follower>,
    /// The shapes of the parts of divided tets. Corners from `vertices + followers` on are points.
    pub pieces: Pieces<4>,
    /// For each blade: the parts that it takes out, with the corners of `pieces`.
    pub taken_out: Vec<Vec<[u32; 4]>>,
}

/// Divides the tets of a shell along blades. `vertices` is the number of vertices of mesh and
/// shell, `position` their rest positions in local meters, and `reach` the longest lattice edge in
/// m.
///
/// The part of a tet on one side of a blade moves with its own corners: the other corners are
/// replaced by followers.
pub(crate) fn divide_shell(
    tets: Vec<[u32; 4]>,
    vertices: usize,
    position: &dyn Fn(u32) -> Point3<f32>,
    blades: &[Blade],
    reach: f64,
) -> DividedShell {
    let (mut whole, mut followers) = (Vec::new(), Vec::new());
    let mut copies = Vec::new();
    for tet in tets {
        let corners = tet.map(|v| position(v).cast::<f64>());
        let (mut distances, mut severed) = (Vec::new(), 0);
        for (row, mask) in blades.iter().filter_map(|blade| blade.across(&corners, reach)).take(Walls::MOST) {
            distances.push(row);
            severed |= mask;
        }
        let parts = parts_of(severed);
        if count(&parts) == 1 {
            whole.push(tet);
            continue;
        }
        for part in 0..count(&parts) {
            let own_side: Vec<u32> = (0..4).filter(|&n| parts[n] == part).map(|n| tet[n]).collect();
            let nodes: [u32; 4] = std::array::from_fn(|n| {
                if parts[n] == part {
                    return tet[n];
                }
                followers.push(Follower { rest: position(tet[n]), own_side: own_side.clone() });
                (vertices + followers.len() - 1) as u32
            });
            let own = (0..4).find(|&n| parts[n] == part);
            let taken = own.and_then(|n| blades.iter().position(|blade| blade.encloses(corners[n])));
            copies.push((nodes, part, parts, distances.clone(), taken));
        }
    }
    let mut builder = Builder::new(vertices + followers.len());
    let mut taken = Vec::with_capacity(copies.len());
    for (number, (nodes, own, parts, distances, gone)) in copies.into_iter().enumerate() {
        taken.push(gone);
        let walls = Walls { distances: &distances, parts, kept: u8::MAX };
        walls.pieces([0, 1, 2, 3].map(unit), |part, piece| {
            if part == own {
                builder.push(number, piece, nodes);
            }
        });
    }
    let (pieces, taken_out) = builder.pieces.apart(blades.len(), |copy| taken[copy as usize]);
    DividedShell { whole, followers, pieces, taken_out }
}
