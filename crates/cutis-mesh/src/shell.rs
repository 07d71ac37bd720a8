//! The layer of tets between the mesh and the air around it, which follows the mesh's motion.
//!
//! Skin thinner than a lattice step, and the outer half-step of all skin, lies in tets with some air corners. They are in no constraint, but a
//! deformed volume needs them: without them the outermost voxels of the body would stay behind.

use nalgebra::{Point3, Vector3};

use crate::cells::CornerBits;
use crate::neighbors::Neighbors;
use crate::{Cut, Frozen, Lattice, MeshError, NO_VERTEX, TetMesh};

/// Tets with one to three air corners and at least one corner in the mesh.
///
/// Corners below `first_extra` are mesh vertices; the others are the shell's own, `first_extra + n` at `positions[n]`.
#[derive(Clone, Debug)]
pub struct Shell {
    /// Number of mesh vertices, and so the index of the first extra vertex.
    pub first_extra: u32,
    /// Rest positions of the extra vertices, local meters, in lattice order.
    pub positions: Vec<Point3<f32>>,
    /// Tets that move along, positively oriented at rest.
    pub tets: Vec<[u32; 4]>,
    /// Tets that a slit takes: with a corner in it (removed mesh vertex, or extra vertex in the slit), or with an edge across it.
    pub removed: Vec<[u32; 4]>,
    /// Extra vertex `n` follows `neighbors[offsets[n]..offsets[n + 1]]`.
    pub offsets: Vec<u32>,
    /// Mesh vertices.
    pub neighbors: Vec<u32>,
    /// Vertices of the body that a region left out and that extra vertex `n` follows besides: they hold it back.
    pub held_by: Vec<u32>,
}

impl Shell {
    /// The shell of a mesh of this lattice. `air` is as for [`TetMesh::build`]; `cut` is what was cut out of the mesh.
    ///
    /// An extra vertex follows the mesh vertices that a lattice edge joins with it, except removed ones and those on the other side of a slit.
    ///
    /// Of a mesh within a region ([`TetMesh::frozen`]) the shell is that part of the whole body's shell that can move. What the region left out
    /// stays, and holds back what follows it, so that where the mesh moves as the whole body would, the shell does too.
    ///
    /// # Errors
    /// [`MeshError::Length`] if `air` has not one value per lattice point, or `cut` belongs to another mesh.
    pub fn new(mesh: &TetMesh, air: &[bool], cut: &Cut) -> Result<Self, MeshError> {
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
        let found = match &mesh.frozen {
            None => {
                let body: Vec<bool> = vertex_of.iter().map(|&vertex| vertex != NO_VERTEX).collect();
                mixed_tets(lattice, air, &body, &body)
            }
            Some(frozen) => {
                let body: Vec<bool> = vertex_of
                    .iter()
                    .zip(&frozen.points)
                    .map(|(&v, &frozen)| v != NO_VERTEX || frozen)
                    .collect();
                mixed_tets(lattice, air, &body, &moving(mesh, frozen, &body))
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
        let rows = Followed::by(mesh, cut, &vertex_of, &points, &positions);
        for (n, &point) in points.iter().enumerate() {
            vertex_of[point as usize] = (vertices + n) as u32;
        }
        let place = |v: u32| match (v as usize).checked_sub(vertices) {
            Some(extra) => positions[extra],
            None => mesh.positions[v as usize],
        };
        let gone: Vec<bool> = positions.iter().map(|&position| cut.holds(position)).collect();
        let is_gone = |v: u32| match (v as usize).checked_sub(vertices) {
            Some(extra) => gone[extra],
            None => cut.removed[v as usize],
        };
        let all = found.into_iter().map(|tet| tet.map(|point| vertex_of[point as usize]));
        let (removed, tets) = all.partition(|tet| {
            tet.iter().any(|&v| is_gone(v))
                || (0..4).any(|a| (0..a).any(|b| cut.crosses(place(tet[a]), place(tet[b]))))
        });
        let Followed { offsets, neighbors, held_by } = rows;
        Ok(Self { first_extra: vertices as u32, positions, tets, removed, offsets, neighbors, held_by })
    }

    /// Deformed positions of the extra vertices: rest plus the mean displacement of the vertices each one follows.
    ///
    /// `rest` and `deformed` hold a position per mesh vertex. A vertex that follows none stays.
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

/// Points that can move: mesh vertices within the region, and points outside the body that follow one.
fn moving(mesh: &TetMesh, frozen: &Frozen, body: &[bool]) -> Vec<bool> {
    let around = Neighbors::new(&mesh.lattice);
    let mut moving = vec![false; body.len()];
    for (&point, _) in mesh.lattice_index.iter().zip(&frozen.border).filter(|(_, border)| !**border) {
        moving[point as usize] = true;
        around.of(point as usize, |neighbor| moving[neighbor] |= !body[neighbor]);
    }
    moving
}

/// Lattice tets with an air corner, a corner in the body, and a corner that can move, as flat lattice indices.
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

/// Rows of mesh vertices, one row per extra vertex, and how many frozen ones each follows besides.
struct Followed {
    offsets: Vec<u32>,
    neighbors: Vec<u32>,
    held_by: Vec<u32>,
}

impl Followed {
    fn by(mesh: &TetMesh, cut: &Cut, vertex_of: &[u32], points: &[u32], positions: &[Point3<f32>]) -> Self {
        let around = Neighbors::new(&mesh.lattice);
        let frozen = |point: usize| mesh.frozen.as_ref().is_some_and(|frozen| frozen.points[point]);
        let mut rows = Self { offsets: vec![0], neighbors: Vec::new(), held_by: Vec::new() };
        for (&point, &position) in points.iter().zip(positions) {
            let mut held_by = 0;
            // What a region left out follows nobody.
            if !frozen(point as usize) {
                around.of(point as usize, |neighbor| match vertex_of[neighbor] {
                    NO_VERTEX => held_by += u32::from(frozen(neighbor)),
                    vertex if cut.removed[vertex as usize] => {}
                    vertex if cut.crosses(position, mesh.positions[vertex as usize]) => {}
                    vertex => rows.neighbors.push(vertex),
                });
            }
            rows.offsets.push(rows.neighbors.len() as u32);
            rows.held_by.push(held_by);
        }
        rows
    }
}
