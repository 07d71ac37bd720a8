//! Which edges of a lattice mesh are severed.

use nalgebra::Point3;
use rayon::prelude::*;

use super::blade::{Blade, signed};
use super::components::EDGES;
use super::section::{Border, Section};
use super::tet_index::TetIndex;
use crate::{Lattice, NO_VERTEX, TetMesh};

/// How far blades have cut a mesh. Cuts only grow.
///
/// An edge is severed if its ends are on different sides of a blade, and if the zero of the
/// distance along it is on the part of the blade that cuts. A tet is cut by the share of its
/// section along the blade that the blade has passed.
pub struct Severing {
    pub(super) index: TetIndex,
    /// Mesh vertex of each lattice point.
    pub(super) vertex_of: Vec<u32>,
    /// One bit per direction for each vertex: whether the edge that starts there is severed.
    pub(super) edges: Vec<u16>,
    pub(super) blades: Vec<Sides>,
}

/// The sides of a blade, and the edges that it crosses.
pub(super) struct Sides {
    /// Vertices near the blade in ascending order, with their signed distances in m.
    near: Vec<(u32, f32)>,
    /// Edges that the blade crosses, in the order in which they are cut.
    crossings: Vec<Crossing>,
    /// Tets on both sides of the surface that the blade cuts, in ascending order.
    pub sections: Vec<TetSection>,
    /// Vertices in the piece that the blade cuts out, in ascending order.
    pub inside: Vec<u32>,
    /// True if this blade and the next one cut a piece out: what is negative for both.
    pub with_next: bool,
    /// Length of the blade's path in m.
    pub length: f64,
    /// The border of the whole cut.
    pub border: Border,
    /// Length in m up to which the blade has cut.
    pub reached: f64,
    /// Number of crossings that are severed.
    cut: usize,
}

/// The section of a tet along a blade.
pub(super) struct TetSection {
    /// Number of the tet in the mesh.
    pub tet: u32,
    pub cell: [usize; 3],
    /// Number of the tet in its cell.
    pub number: usize,
    pub section: Section,
}

/// A place where a blade crosses an edge.
#[derive(Clone, Copy)]
struct Crossing {
    /// Length along the path in m.
    at: f64,
    vertex: u32,
    direction: u8,
}

impl Sides {
    /// Signed distance of a vertex in m. None if it is not near.
    pub fn distance(&self, vertex: u32) -> Option<f32> {
        let found = self.near.binary_search_by_key(&vertex, |(near, _)| *near).ok()?;
        Some(self.near[found].1)
    }

    /// How far along its path the blade severs the edge that starts at a vertex in a direction.
    pub fn crossing(&self, vertex: u32, direction: u8) -> Option<f64> {
        let same = |crossing: &&Crossing| crossing.vertex == vertex && crossing.direction == direction;
        self.crossings.iter().find(same).map(|crossing| crossing.at)
    }

    /// The edges that the blade severs, in this order: vertex, direction, and length along the path
    /// in m.
    pub fn all_crossings(&self) -> impl Iterator<Item = (u32, u8, f64)> {
        self.crossings.iter().map(|crossing| (crossing.vertex, crossing.direction, crossing.at))
    }
}

impl Severing {
    /// No edge of the mesh is severed.
    pub fn new(mesh: &TetMesh) -> Self {
        Self {
            index: TetIndex::new(mesh),
            vertex_of: mesh.vertex_of_point(),
            edges: vec![0; mesh.positions.len()],
            blades: Vec::new(),
        }
    }

    /// Adds a blade that has not cut yet. Returns its number, and the number of edges that it
    /// crosses. `mesh` is the mesh of [`Severing::new`].
    pub fn add(&mut self, mesh: &TetMesh, blade: &Blade) -> (usize, usize) {
        let reach = longest_edge(&mesh.lattice);
        let distance = |(vertex, position): (usize, &Point3<f32>)| {
            let position = position.cast::<f64>();
            let distance = blade.near(&position, reach).then(|| blade.distance(position, reach)).flatten()?;
            Some((vertex as u32, signed(distance)))
        };
        let near: Vec<(u32, f32)> = mesh.positions.par_iter().enumerate().filter_map(distance).collect();
        let length = blade.length();
        let border = blade.border(finest_step(mesh));
        let inside = |(vertex, position): (usize, &Point3<f32>)| {
            blade.encloses(position.cast()).then_some(vertex as u32)
        };
        let inside = mesh.positions.par_iter().enumerate().filter_map(inside).collect();
        let (crossings, sections) = (Vec::new(), Vec::new());
        let with_next = blade.with_next;
        let mut sides =
            Sides { near, crossings, sections, inside, with_next, length, border, reached: 0.0, cut: 0 };
        let of_vertex =
            |&(vertex, distance): &(u32, f32)| self.crossings(mesh, blade, &sides, vertex, distance, reach);
        let mut crossings: Vec<Crossing> = sides.near.par_iter().flat_map_iter(of_vertex).collect();
        crossings.par_sort_by(|a, b| a.at.total_cmp(&b.at));
        let count = crossings.len();
        sides.crossings = crossings;
        sides.sections = self.sections(mesh, blade, &sides, reach);
        self.blades.push(sides);
        (self.blades.len() - 1, count)
    }

    /// The crossings of the edges that start at a vertex.
    fn crossings(
        &self,
        mesh: &TetMesh,
        blade: &Blade,
        sides: &Sides,
        vertex: u32,
        distance: f32,
        reach: f64,
    ) -> Vec<Crossing> {
        let point = mesh.lattice_index[vertex as usize] as usize;
        let at = mesh.point(vertex);
        let shape = mesh.lattice.grid().shape;
        let directions = self.index.stencil().directions[at.iter().sum::<usize>() & 1].iter().enumerate();
        let crossing = |(direction, step): (usize, [i8; 3])| {
            let to: [isize; 3] = std::array::from_fn(|axis| at[axis] as isize + isize::from(step[axis]));
            let within = to.iter().zip(shape).all(|(&c, n)| c >= 0 && (c as usize) < n);
            let strides = [1, shape[0] as isize, (shape[0] * shape[1]) as isize];
            let delta: isize = step.iter().zip(strides).map(|(&s, stride)| isize::from(s) * stride).sum();
            let other = within.then(|| self.vertex_of[point.wrapping_add_signed(delta)])?;
            let there = (other != NO_VERTEX).then(|| sides.distance(other)).flatten()?;
            let ends = [vertex, other].map(|v| mesh.positions[v as usize].cast::<f64>());
            let at = blade.crosses(ends, [distance, there], reach)?;
            Some(Crossing { at, vertex, direction: direction as u8 })
        };
        directions.filter_map(|(n, direction)| crossing((n, direction.step))).collect()
    }

    /// The tets whose section the whole blade cuts at least in part.
    fn sections(&self, mesh: &TetMesh, blade: &Blade, sides: &Sides, reach: f64) -> Vec<TetSection> {
        let mut around: Vec<(u32, [usize; 3], usize)> = Vec::new();
        for &(vertex, _) in &sides.near {
            self.index.around_point(mesh.point(vertex), |cell, number| {
                around.push((self.index.position(cell, number), cell, number));
            });
        }
        around.par_sort_unstable();
        around.dedup();
        let section = |&(tet, cell, number): &(u32, [usize; 3], usize)| {
            let corners = &mesh.tets[tet as usize];
            let mut distances = [0.0; 4];
            for (distance, &corner) in distances.iter_mut().zip(corners) {
                *distance = sides.distance(corner)?;
            }
            let positions = corners.map(|v| mesh.positions[v as usize].cast::<f64>());
            let crossing = |(a, b): (usize, usize)| {
                let (d, e) = (f64::from(distances[a]), f64::from(distances[b]));
                blade.place(positions[a] + (positions[b] - positions[a]) * (d / (d - e)), reach)
            };
            let places: Option<Vec<[f64; 2]>> =
                around_section(&distances).into_iter().map(crossing).collect();
            let section = Section::new(&places.filter(|places| places.len() > 2)?);
            let cut = section.cut(&sides.border, sides.length) > 0.0;
            cut.then_some(TetSection { tet, cell, number, section })
        };
        around.par_iter().filter_map(section).collect()
    }

    /// Cuts with a blade up to a length in m along its path. Returns the number of edges that were
    /// severed. A shorter length than before severs nothing.
    pub fn cut_to(&mut self, blade: usize, length: f64) -> usize {
        let sides = &mut self.blades[blade];
        let end = sides.crossings.partition_point(|crossing| crossing.at <= length);
        let new = sides.cut.min(end)..end;
        let mut severed = 0;
        for crossing in &sides.crossings[new] {
            let edges = &mut self.edges[crossing.vertex as usize];
            severed += usize::from(*edges >> crossing.direction & 1 == 0);
            *edges |= 1 << crossing.direction;
        }
        sides.cut = sides.cut.max(end);
        sides.reached = sides.reached.max(length.min(sides.length));
        severed
    }

    /// Cuts with all blades to their ends.
    pub fn cut_all(&mut self) {
        for blade in 0..self.blades.len() {
            self.cut_to(blade, self.blades[blade].length);
        }
    }
}

/// The edges of a tet whose ends are on different sides, in order around the section.
pub(super) fn around_section(distances: &[f32; 4]) -> Vec<(usize, usize)> {
    let positive = |corner: usize| distances[corner] >= 0.0;
    let mut edges: Vec<(usize, usize)> =
        EDGES.into_iter().filter(|&(a, b)| positive(a) != positive(b)).collect();
    if edges.len() == 4 {
        // The edges are ac, ad, bc, bd for the sides ab and cd: neighbors share a corner.
        let shares = |(a, b): (usize, usize), (c, d): (usize, usize)| a == c || a == d || b == c || b == d;
        let opposite = (1..4).find(|&n| !shares(edges[0], edges[n])).unwrap_or(3);
        edges.swap(2, opposite);
    }
    edges
}

/// Smallest step of the lattice in m.
pub(super) fn finest_step(mesh: &TetMesh) -> f64 {
    mesh.lattice.grid().affine.spacing_mm().into_iter().fold(f64::INFINITY, f64::min) / 1000.0
}

/// Longest edge of the lattice in m. On a graded lattice it is that of the largest cell.
pub(crate) fn longest_edge(lattice: &Lattice) -> f64 {
    let spacing = lattice.grid().affine.spacing_mm();
    let coarsest = lattice.planes().map_or(1.0, |planes| {
        let steps = planes.axes().iter().flat_map(|axis| axis.windows(2).map(|pair| pair[1] - pair[0]));
        steps.fold(1.0, f64::max)
    });
    // The main diagonal is at most the sum of the three steps, also in a sheared lattice.
    (coarsest * spacing.iter().sum::<f64>()).max(lattice.longest_moved_edge_mm()) / 1000.0
}
