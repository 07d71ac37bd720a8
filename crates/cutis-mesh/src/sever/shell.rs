//! The shell of air around a body along cuts of no width.

use nalgebra::Point3;

use super::blade::{Across, Blade};
use super::components::{count, parts_of};
use super::pieces::{Builder, Pieces, unit};
use super::section::Border;
use super::severing::finest_step;
use super::shell_nodes::{DividedTet, Surroundings, shell_nodes};
use super::walls::Walls;
use crate::TetMesh;

/// A vertex that follows others, at the place of a corner on the other side of a cut.
pub(crate) struct Follower {
    pub rest: Point3<f32>,
    /// The corners on its side of the cut of the tets that share it.
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

/// A part of a divided tet.
struct Part {
    number: u8,
    parts: [u8; 4],
    distances: Vec<[f32; 4]>,
    /// The blade that takes it out.
    taken: Option<usize>,
    /// The first of two rows of distances around a piece, and its blade.
    piece: Option<(u8, usize)>,
}

/// Divides the tets of a shell along blades. `vertices` is the number of vertices of mesh and
/// shell, `position` their rest positions in local meters, and `reach` the longest lattice edge in
/// m. `virtual_nodes` are those of the divided mesh.
///
/// The part of a tet on one side of a blade moves with its own corners. The other corners are
/// replaced by nodes that it shares with its neighbors on its side: virtual nodes of the mesh, or
/// followers.
pub(crate) fn divide_shell(
    tets: Vec<[u32; 4]>,
    mesh: &TetMesh,
    virtual_nodes: &[u32],
    vertices: usize,
    position: &dyn Fn(u32) -> Point3<f32>,
    blades: &[Blade],
    reach: f64,
) -> DividedShell {
    let borders: Vec<Border> = blades.iter().map(|blade| blade.border(finest_step(mesh))).collect();
    let (mut whole, mut divided, mut copies) = (Vec::new(), Vec::new(), Vec::new());
    for corners in tets {
        let places = corners.map(|v| position(v).cast::<f64>());
        let across = blades.iter().zip(&borders).enumerate();
        let across =
            across.filter_map(|(n, (blade, border))| Some((n, blade.across(&places, border, reach)?)));
        let (numbers, across): (Vec<usize>, Vec<Across>) = across.take(Walls::MOST).unzip();
        let Some(deepest) = across.iter().max_by(|a, b| a.cut.total_cmp(&b.cut)) else {
            whole.push(corners);
            continue;
        };
        // As in the body: one blade divides a tet by the sides of its corners, several divide it by
        // the edges that they sever.
        let mut parts = parts_of(across.iter().fold(0, |severed, one| severed | one.severed));
        let mut distances: Vec<[f32; 4]> = across.iter().map(|one| one.distances).collect();
        let around = |pair: &[usize]| pair[1] == pair[0] + 1 && blades[pair[0]].with_next;
        let mut piece = numbers.windows(2).position(around).map(|row| (row as u8, numbers[row]));
        if across.len() == 1 || count(&parts) == 1 {
            (parts, distances, piece) = (parts_of(deepest.apart), vec![deepest.distances], None);
        }
        divided.push(DividedTet { corners, parts, first_copy: copies.len() });
        for number in 0..count(&parts) {
            let own = (0..4).find(|&n| parts[n] == number);
            let taken = own.and_then(|n| blades.iter().position(|blade| blade.encloses(places[n])));
            copies.push(Part { number, parts, distances: distances.clone(), taken, piece });
        }
    }
    let around = Surroundings { whole: &whole, mesh, virtual_nodes, vertices };
    let nodes = shell_nodes(&divided, &around);
    let mut builder = Builder::new(vertices + nodes.followers.len());
    for (copy, (part, nodes)) in copies.iter().zip(&nodes.copies).enumerate() {
        let first_row = part.piece.map(|(row, _)| row);
        let walls = Walls { distances: &part.distances, parts: part.parts, kept: u8::MAX, piece: first_row };
        walls.pieces([0, 1, 2, 3].map(unit), |number, piece| match (number, part.piece) {
            (Some(number), _) if number == part.number => builder.push(copy, piece, *nodes),
            // What is taken out and has no corner goes with the first part.
            (None, Some((_, blade))) if part.number == 0 => {
                builder.push(copies.len() + blade, piece, *nodes);
            }
            _ => {}
        });
    }
    let taken = |copy: u32| match copies.get(copy as usize) {
        Some(part) => part.taken,
        None => Some(copy as usize - copies.len()),
    };
    let (pieces, taken_out) = builder.pieces.apart(blades.len(), taken);
    let follower = |(vertex, own_side)| Follower { rest: position(vertex), own_side };
    let followers = nodes.followers.into_iter().map(follower).collect();
    DividedShell { whole, followers, pieces, taken_out }
}
