//! The shell: the layer of tets between the mesh and the surrounding air. It follows the motion of
//! the mesh.
//!
//! Skin thinner than a lattice step, and the outermost half-step of all skin, is in tets that have
//! air corners. These tets are in no constraint. Resampling a deformed volume needs them, because
//! otherwise the outermost voxels of the body would not move.

use nalgebra::{Point3, Vector3};

use crate::cells::CornerBits;
use crate::neighbors::Neighbors;
use crate::sever::{DividedShell, Pieces, Severed, divide_shell, longest_edge};
use crate::{Cut, InactiveTissue, Lattice, MeshError, NO_VERTEX, TetMesh};

/// The tets with one to three air corners and at least one corner in the mesh.
///
/// Corners below `first_extra` are mesh vertices. Corner `first_extra + n` is the extra vertex at
/// `positions[n]`.
#[derive(Clone, Debug)]
pub struct Shell {
    /// Index of the first extra vertex, equal to the number of mesh vertices.
    pub first_extra: u32,
    /// Rest positions of the extra vertices in local meters: those at lattice points in their
    /// order, then those of divided tets.
    pub positions: Vec<Point3<f32>>,
    /// Tets that follow the mesh, positively oriented at rest.
    pub tets: Vec<[u32; 4]>,
    /// Tets that a slit cuts: those with a removed mesh vertex, with an extra vertex in the slit,
    /// or with an edge through its middle surface.
    pub removed: Vec<[u32; 4]>,
    /// The parts of the tets that cuts of no width divide. Corners from
    /// `first_extra + positions.len()` on are points.
    pub pieces: Pieces<4>,
    /// For each blade of [`Severed`]: the tets and the parts of tets that it takes out with a
    /// piece, with the corners of `pieces`.
    pub taken_out: Vec<Vec<[u32; 4]>>,
    /// Extra vertex `n` follows the mesh vertices `neighbors[offsets[n]..offsets[n + 1]]`.
    pub offsets: Vec<u32>,
    /// The followed mesh vertices of all extra vertices.
    pub neighbors: Vec<u32>,
    /// Number of inactive vertices that extra vertex `n` also follows. These do not move, and so
    /// reduce its motion.
    pub held_by: Vec<u32>,
}

impl Shell {
    /// Builds the shell of a mesh. `air` has one flag per lattice point, as in
    /// [`Tissue`](crate::Tissue). `cut` is the cut of the mesh, and `severed` what its slits
    /// without a width changed.
    ///
    /// An extra vertex follows the mesh vertices to which a lattice edge joins it, except removed
    /// vertices and vertices on the other side of a slit.
    ///
    /// For a mesh of a region ([`TetMesh::inactive`]), the shell is the part of the shell of the
    /// whole body that can move. Inactive vertices count as followed vertices that do not move.
    /// Therefore the shell moves like that of the whole body if the mesh does.
    ///
    /// # Errors
    /// [`MeshError::Length`] if `air` does not have one value per lattice point, or if `cut`
    /// belongs to another mesh. [`MeshError::LatticeSize`] if there are too many vertices for
    /// 32-bit indices.
    pub fn new(
        mesh: &TetMesh,
        air: &[bool],
        cut: &Cut,
        severed: Option<&Severed>,
    ) -> Result<Self, MeshError> {
        let (grid, lattice) = (mesh.lattice.grid(), &mesh.lattice);
        if air.len() != grid.len() {
            return Err(MeshError::Length { array: "air", expected: grid.len(), found: air.len() });
        }
        let vertices = mesh.positions.len();
        if cut.removed.len() != vertices {
            return Err(MeshError::Length {
                array: "cut.removed",
                expected: vertices,
                found: cut.removed.len(),
            });
        }
        let mut vertex_of = mesh.vertex_of_point();
        let found = match &mesh.inactive {
            None => {
                let body: Vec<bool> = vertex_of.iter().map(|&vertex| vertex != NO_VERTEX).collect();
                mixed_tets(lattice, air, &body, &body)
            }
            Some(inactive) => {
                let body: Vec<bool> = vertex_of
                    .iter()
                    .zip(&inactive.points)
                    .map(|(&v, &inactive)| v != NO_VERTEX || inactive)
                    .collect();
                mixed_tets(lattice, air, &body, &moving(mesh, inactive, &body))
            }
        };
        let mut points: Vec<u32> = found.iter().flatten().copied().collect();
        points.sort_unstable();
        points.dedup();
        points.retain(|&point| vertex_of[point as usize] == NO_VERTEX);
        if vertices + points.len() >= NO_VERTEX as usize {
            return Err(MeshError::LatticeSize { shape: grid.shape, max: Lattice::MAX_POINTS });
        }
        let positions: Vec<Point3<f32>> =
            points.iter().map(|&point| mesh.frame.to_local(lattice.mm(grid.point(point as usize)))).collect();
        let blades = severed.map(|severed| severed.blades.as_slice()).unwrap_or_default();
        let virtual_nodes = severed.map(|severed| severed.virtual_nodes.as_slice()).unwrap_or_default();
        let reach = longest_edge(lattice);
        let separates = |a: Point3<f32>, b: Point3<f32>| {
            let ends = [a.cast(), b.cast()];
            cut.crosses(a, b) || blades.iter().any(|blade| blade.separates(ends, reach))
        };
        let rows = Followed::by(mesh, &cut.removed, &separates, &vertex_of, &points, &positions);
        for (n, &point) in points.iter().enumerate() {
            vertex_of[point as usize] = (vertices + n) as u32;
        }
        let position = |v: u32| match (v as usize).checked_sub(vertices) {
            Some(extra) => positions[extra],
            None => mesh.positions[v as usize],
        };
        let in_slit: Vec<bool> = positions.iter().map(|&position| cut.contains(position)).collect();
        let taken_by = |v: u32| blades.iter().position(|blade| blade.encloses(position(v).cast()));
        let is_removed = |v: u32| match (v as usize).checked_sub(vertices) {
            Some(extra) => in_slit[extra],
            None => cut.removed[v as usize] && taken_by(v).is_none(),
        };
        let all = found.into_iter().map(|tet| tet.map(|point| vertex_of[point as usize]));
        let (removed, tets): (Vec<_>, Vec<_>) = all.partition(|tet| {
            tet.iter().any(|&v| is_removed(v))
                || (0..4).any(|a| (0..a).any(|b| cut.crosses(position(tet[a]), position(tet[b]))))
        });
        let count = vertices + positions.len();
        let (enclosed, tets): (Vec<[u32; 4]>, Vec<_>) =
            tets.into_iter().partition(|tet| tet.iter().all(|&v| taken_by(v).is_some()));
        let DividedShell { whole, followers, pieces, mut taken_out } =
            divide_shell(tets, mesh, virtual_nodes, count, &position, blades, reach);
        for tet in enclosed {
            if let Some(blade) = taken_by(tet[0]) {
                taken_out[blade].push(tet);
            }
        }
        let mut rows = rows;
        let mut positions = positions;
        for follower in followers {
            rows.follow_corners(vertices, &follower.own_side);
            positions.push(follower.rest);
        }
        let Followed { offsets, neighbors, held_by } = rows;
        let first_extra = vertices as u32;
        Ok(Self {
            first_extra,
            positions,
            tets: whole,
            removed,
            pieces,
            taken_out,
            offsets,
            neighbors,
            held_by,
        })
    }

    /// Deformed positions of the extra vertices. Each moves by the mean displacement of the
    /// vertices that it follows.
    ///
    /// `rest` and `deformed` hold one position per mesh vertex in local meters. An extra vertex
    /// that follows no vertex does not move.
    ///
    /// # Panics
    /// If there are fewer positions than mesh vertices.
    pub fn follow(&self, rest: &[Point3<f32>], deformed: &[Point3<f32>]) -> Vec<Point3<f32>> {
        let moved = |(n, position): (usize, &Point3<f32>)| {
            let followed = &self.neighbors[self.offsets[n] as usize..self.offsets[n + 1] as usize];
            let displacement = |&v: &u32| deformed[v as usize] - rest[v as usize];
            let sum =
                followed.iter().map(displacement).fold(Vector3::zeros(), |sum: Vector3<f32>, d| sum + d);
            position + sum / (followed.len() + self.held_by[n] as usize).max(1) as f32
        };
        self.positions.iter().enumerate().map(moved).collect()
    }
}

/// One flag per lattice point: true if the point can move. These are the mesh vertices in the
/// region and the points outside the body that follow them.
fn moving(mesh: &TetMesh, inactive: &InactiveTissue, body: &[bool]) -> Vec<bool> {
    let around = Neighbors::new(&mesh.lattice);
    let mut moving = vec![false; body.len()];
    for (&point, _) in mesh.lattice_index.iter().zip(&inactive.border).filter(|(_, border)| !**border) {
        moving[point as usize] = true;
        around.of(point as usize, |neighbor| moving[neighbor] |= !body[neighbor]);
    }
    moving
}

/// The lattice tets with an air corner, a corner in the body and a corner that can move, as flat
/// lattice indices.
fn mixed_tets(lattice: &Lattice, air: &[bool], body: &[bool], moving: &[bool]) -> Vec<[u32; 4]> {
    let (grid, [_, cy, cz]) = (lattice.grid(), lattice.cells());
    let corners = [air, body, moving].map(|points| CornerBits::new(lattice, points));
    let mut found = Vec::new();
    let mut row = vec![[0u8; 3]; grid.shape[0] - 1];
    for k in 0..cz {
        for j in 0..cy {
            for (n, corners) in corners.iter().enumerate() {
                corners.for_row(j, k, |i, bits| row[i][n] = bits);
            }
            for (i, cell) in row.iter().enumerate().filter(|(_, cell)| cell.iter().all(|&bits| bits != 0)) {
                for tet in lattice.cell_tets(i, j, k) {
                    let any = |bits: &u8| tet.iter().any(|corner| bits >> corner & 1 == 1);
                    if cell.iter().all(any) {
                        found.push(tet.map(|corner| grid.index(Lattice::corner([i, j, k], corner)) as u32));
                    }
                }
            }
        }
    }
    found
}

/// The vertices that the extra vertices follow: see the fields of [`Shell`].
struct Followed {
    offsets: Vec<u32>,
    neighbors: Vec<u32>,
    held_by: Vec<u32>,
}

impl Followed {
    /// Adds a row that follows some corners: the mesh vertices among them, or else what the others
    /// follow.
    fn follow_corners(&mut self, vertices: usize, corners: &[u32]) {
        let first = self.neighbors.len();
        self.neighbors.extend(corners.iter().filter(|&&v| (v as usize) < vertices));
        let mut held_by = 0;
        if self.neighbors.len() == first {
            for extra in corners.iter().map(|&v| v as usize - vertices) {
                let row = self.offsets[extra] as usize..self.offsets[extra + 1] as usize;
                self.neighbors.extend_from_within(row);
                held_by += self.held_by[extra];
            }
        }
        self.offsets.push(self.neighbors.len() as u32);
        self.held_by.push(held_by);
    }

    /// `separates` tells whether a cut is between two rest positions.
    fn by(
        mesh: &TetMesh,
        removed: &[bool],
        separates: &dyn Fn(Point3<f32>, Point3<f32>) -> bool,
        vertex_of: &[u32],
        points: &[u32],
        positions: &[Point3<f32>],
    ) -> Self {
        let around = Neighbors::new(&mesh.lattice);
        let is_inactive =
            |point: usize| mesh.inactive.as_ref().is_some_and(|inactive| inactive.points[point]);
        let mut rows = Self { offsets: vec![0], neighbors: Vec::new(), held_by: Vec::new() };
        for (&point, &position) in points.iter().zip(positions) {
            let mut held_by = 0;
            // Inactive vertices follow no vertex.
            if !is_inactive(point as usize) {
                around.of(point as usize, |neighbor| match vertex_of[neighbor] {
                    NO_VERTEX => held_by += u32::from(is_inactive(neighbor)),
                    vertex if removed[vertex as usize] => {}
                    vertex if separates(position, mesh.positions[vertex as usize]) => {}
                    vertex => rows.neighbors.push(vertex),
                });
            }
            rows.offsets.push(rows.neighbors.len() as u32);
            rows.held_by.push(held_by);
        }
        rows
    }
}
