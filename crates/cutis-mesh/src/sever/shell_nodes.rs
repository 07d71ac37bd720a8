//! The nodes of the parts of divided shell tets.
//!
//! As in the body, two parts on both sides of a face share its three corners where tissue passes
//! through the face. So the shell stays in one piece on each side of a cut, and stays on the body.
//!
//! At the end and the bottom of a cut a few corners of one side still come apart with `five`. The
//! cause is not known. It may be that tets which share only an edge are joined through those around
//! it, and that the shell has no closed ring of tets around edges in the air.

use std::collections::HashMap;

use super::components::count;
use super::nodes::Classes;
use crate::TetMesh;

/// A shell tet that blades divide.
pub(super) struct DividedTet {
    pub corners: [u32; 4],
    /// The part of each corner.
    pub parts: [u8; 4],
    /// Number of the copy with its first part, among the copies of all divided tets.
    pub first_copy: usize,
}

/// The nodes of the copies of divided shell tets.
pub(super) struct ShellNodes {
    /// Nodes of each copy, in the order of the corners of its tet. Those from the number of
    /// vertices on are followers.
    pub copies: Vec<[u32; 4]>,
    /// For each follower: the vertex at its place, and the corners on its side of the cut of the
    /// tets that share it, in ascending order.
    pub followers: Vec<(u32, Vec<u32>)>,
}

/// The tets around the divided ones.
pub(super) struct Surroundings<'a> {
    /// The shell tets that no blade divides.
    pub whole: &'a [[u32; 4]],
    /// The divided mesh of the body.
    pub mesh: &'a TetMesh,
    /// The vertex at the place of each virtual node of the mesh.
    pub virtual_nodes: &'a [u32],
    /// Number of vertices of mesh and shell.
    pub vertices: usize,
}

/// Divided tets at a face: number of the tet.
type Faces = HashMap<[u32; 3], Vec<usize>>;

/// Finds the nodes of all copies.
pub(super) fn shell_nodes(divided: &[DividedTet], around: &Surroundings<'_>) -> ShellNodes {
    let mut faces = Faces::new();
    for (n, tet) in divided.iter().enumerate() {
        faces_of(&tet.corners).for_each(|face| faces.entry(face).or_default().push(n));
    }
    let mut joined = Joined::new(divided, around);
    for at_face in faces.values() {
        if let [one, other] = at_face[..] {
            joined.join_divided(&divided[one], &divided[other]);
        }
    }
    let mut near = vec![false; around.vertices];
    divided.iter().flat_map(|tet| tet.corners).for_each(|v| near[v as usize] = true);
    let (whole, copies) = around.mesh.tets.split_at(around.mesh.whole_tets());
    for tet in around.whole.iter().chain(whole) {
        // At least three corners must be those of divided tets.
        if tet.iter().filter(|&&v| near[v as usize]).count() < 3 {
            continue;
        }
        for face in faces_of(tet) {
            faces.get(&face).into_iter().flatten().for_each(|&n| joined.join_whole(&divided[n], face));
        }
    }
    let mut of_body: HashMap<[u32; 3], Vec<[u32; 4]>> = HashMap::new();
    for copy in copies {
        for face in faces_of(&copy.map(|node| around.vertex_at(node))) {
            if faces.contains_key(&face) {
                of_body.entry(face).or_default().push(*copy);
            }
        }
    }
    for (face, copies) in &of_body {
        for &n in faces.get(face).into_iter().flatten() {
            joined.join_body(&divided[n], *face, copies, around);
        }
    }
    joined.nodes(divided, around.vertices)
}

impl Surroundings<'_> {
    /// The vertex at the place of a node of the mesh.
    fn vertex_at(&self, node: u32) -> u32 {
        let first = self.mesh.positions.len() - self.virtual_nodes.len();
        (node as usize).checked_sub(first).map_or(node, |number| self.virtual_nodes[number])
    }
}

/// The faces of a tet, each with its corners in ascending order.
fn faces_of(tet: &[u32; 4]) -> impl Iterator<Item = [u32; 3]> {
    (0..4).map(move |opposite| {
        let mut face = [1, 2, 3].map(|step| tet[(opposite + step) % 4]);
        face.sort_unstable();
        face
    })
}

impl DividedTet {
    fn place(&self, vertex: u32) -> Option<usize> {
        self.corners.iter().position(|&corner| corner == vertex)
    }

    /// The copy that holds the corner at a place.
    fn copy_at(&self, place: usize) -> usize {
        self.first_copy + usize::from(self.parts[place])
    }
}

/// Classes of the corners of copies that are one node.
struct Joined {
    /// Vertices that may be nodes, in ascending order. They come before the corners of copies, so
    /// that they are the roots of their classes.
    real: Vec<u32>,
    classes: Classes,
}

impl Joined {
    fn new(divided: &[DividedTet], around: &Surroundings<'_>) -> Self {
        let mut real: Vec<u32> = divided.iter().flat_map(|tet| tet.corners).collect();
        real.sort_unstable();
        real.dedup();
        let first = around.mesh.positions.len() - around.virtual_nodes.len();
        let at_corner = |(_, vertex): &(usize, &u32)| real.binary_search(vertex).is_ok();
        let nodes = around.virtual_nodes.iter().enumerate().filter(at_corner);
        let nodes: Vec<u32> = nodes.map(|(n, _)| (first + n) as u32).collect();
        real.extend(nodes);
        real.sort_unstable();
        let copies = divided.last().map_or(0, |last| last.first_copy + usize::from(count(&last.parts)));
        let classes = Classes::new(real.len() + 4 * copies);
        let mut joined = Self { real, classes };
        for tet in divided {
            for (place, &vertex) in tet.corners.iter().enumerate() {
                joined.join_real(tet.copy_at(place), place, vertex);
            }
        }
        joined
    }

    fn slot(&self, copy: usize, place: usize) -> usize {
        self.real.len() + 4 * copy + place
    }

    fn join_real(&mut self, copy: usize, place: usize, node: u32) {
        if let Ok(real) = self.real.binary_search(&node) {
            let slot = self.slot(copy, place);
            self.classes.join(slot, real);
        }
    }

    /// Joins two divided tets with a common face. Each of its corners names a part on both sides.
    fn join_divided(&mut self, one: &DividedTet, other: &DividedTet) {
        let common = || (0..4).filter_map(|place| Some((place, other.place(one.corners[place])?)));
        for (named, across) in common() {
            for (place, there) in common() {
                let slot = self.slot(one.copy_at(named), place);
                let across = self.slot(other.copy_at(across), there);
                self.classes.join(slot, across);
            }
        }
    }

    /// Joins a divided tet to one with the same face that is not divided.
    fn join_whole(&mut self, tet: &DividedTet, face: [u32; 3]) {
        for named in face.into_iter().filter_map(|vertex| tet.place(vertex)) {
            for vertex in face {
                if let Some(place) = tet.place(vertex) {
                    self.join_real(tet.copy_at(named), place, vertex);
                }
            }
        }
    }

    /// Joins a divided tet to the copies of the body's tet at its face.
    fn join_body(
        &mut self,
        tet: &DividedTet,
        face: [u32; 3],
        copies: &[[u32; 4]],
        around: &Surroundings<'_>,
    ) {
        let at_face = |copy: &[u32; 4], vertex: u32| {
            copy.iter().copied().find(|&node| around.vertex_at(node) == vertex)
        };
        for named in face {
            // Where a tet is divided in part, the last of its copies has all of its corners. It
            // stands for tissue that is not yet cut, which has no shape of its own.
            let copy = copies.iter().find(|copy| copy.contains(&named));
            let (Some(copy), Some(own)) = (copy, tet.place(named)) else { continue };
            for vertex in face {
                if let (Some(node), Some(place)) = (at_face(copy, vertex), tet.place(vertex)) {
                    self.join_real(tet.copy_at(own), place, node);
                }
            }
        }
    }

    fn nodes(mut self, divided: &[DividedTet], vertices: usize) -> ShellNodes {
        let mut number: HashMap<usize, usize> = HashMap::new();
        let mut followers: Vec<(u32, Vec<u32>)> = Vec::new();
        let mut copies = Vec::new();
        for tet in divided {
            for part in 0..count(&tet.parts) {
                let own_side = (0..4).filter(|&place| tet.parts[place] == part).map(|n| tet.corners[n]);
                copies.push(std::array::from_fn(|place| {
                    let slot = self.slot(tet.first_copy + usize::from(part), place);
                    let root = self.classes.root(slot);
                    if let Some(&node) = self.real.get(root) {
                        return node;
                    }
                    let follower = *number.entry(root).or_insert_with(|| {
                        followers.push((tet.corners[place], Vec::new()));
                        followers.len() - 1
                    });
                    followers[follower].1.extend(own_side.clone());
                    (vertices + follower) as u32
                }));
            }
        }
        for (_, own_side) in &mut followers {
            own_side.sort_unstable();
            own_side.dedup();
        }
        ShellNodes { copies, followers }
    }
}
