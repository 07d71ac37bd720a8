//! Static incisions: what they take out of a mesh, and the lips they leave.

use std::collections::HashSet;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::gape::Gape;
use crate::neighbors::Neighbors;
use crate::slit::{Facet, Slit, check_indices};
use crate::{MeshError, NO_VERTEX, TetMesh};

/// A straight cut along a segment on or near the skin. World millimeters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Incision {
    /// Start of the segment, mm.
    pub from_mm: [f64; 3],
    /// End of the segment, mm.
    pub to_mm: [f64; 3],
    /// Depth below the local skin, mm.
    pub depth_mm: f64,
    /// Full width of what is taken out, mm.
    pub width_mm: f64,
}

/// Incisions planned on a mesh.
///
/// A vertex is *removed* if it lies in a slit: within half the width, between start and end, no deeper below the local skin than the depth.
/// Removed vertices leave all constraints (paper, §4.2). A tet, edge or triangle with an edge through the surface in the middle of a
/// slit goes as well, so that the lips part even where the slit is narrower than a lattice step or oblique to it. What then hangs
/// on no tet goes too: such vertices count as removed.
#[derive(Clone, Debug)]
pub struct Cut {
    /// Per mesh vertex: in no constraint any more.
    pub removed: Vec<bool>,
    /// The slits, in the order of the incisions.
    pub slits: Vec<Slit>,
    /// The gape of each, in the same order.
    pub gapes: Vec<Gape>,
    /// Per mesh vertex: could be a corner of something that a slit cuts.
    near: Vec<bool>,
}

/// What [`Cut::apply`] took out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Removed {
    /// The tets, in mesh vertices.
    pub tets: Vec<[u32; 4]>,
    /// The edges, in mesh vertices.
    pub edges: Vec<[u32; 2]>,
    /// Number of skin triangles.
    pub triangles: usize,
}

const EDGES: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

impl Cut {
    /// Plans incisions on an uncut mesh with its skin `triangles` (mesh vertices, outward oriented). No incision gives a cut that takes nothing.
    ///
    /// # Errors
    /// [`MeshError::VertexIndex`] for a triangle of vertices that are not there; [`MeshError::IncisionSize`] for a length, depth or width that is
    /// not finite and positive; [`MeshError::IncisionOffSkin`], [`MeshError::IncisionThroughSkin`], [`MeshError::IncisionEmpty`] and
    /// [`MeshError::IncisionWithoutLips`] as they say.
    pub fn plan(mesh: &TetMesh, triangles: &[[u32; 3]], incisions: &[Incision]) -> Result<Self, MeshError> {
        Self::of_slits(mesh, triangles, Slit::on_mesh(mesh, triangles, incisions)?)
    }

    /// As [`Cut::plan`], with slits that were placed before ([`Slit::on_lattice`]) and may lie on skin which the mesh does not have.
    ///
    /// # Errors
    /// As [`Cut::plan`], less those of placing; [`MeshError::IncisionBeyond`] if a slit touches what a region left out of the mesh,
    /// or the coarse part of a graded lattice.
    pub fn of_slits(mesh: &TetMesh, triangles: &[[u32; 3]], slits: Vec<Slit>) -> Result<Self, MeshError> {
        check_indices(triangles, mesh.positions.len())?;
        // Whatever a slit cuts has all corners within a cell's diagonal of it.
        let margin = mesh.lattice.grid().affine.spacing_mm().iter().sum::<f64>() / 1000.0;
        check_within(mesh, &slits, margin)?;
        let near = mesh.positions.iter().map(|&p| slits.iter().any(|slit| slit.near(p, margin))).collect();
        let removed = mesh.positions.iter().map(|&p| slits.iter().any(|slit| slit.holds(p))).collect();
        let mut cut = Self { removed, slits, gapes: Vec::new(), near };
        cut.check_cuts_something(mesh)?;
        cut.remove_loose(mesh);
        cut.gapes = cut.find_lips(mesh, triangles)?;
        Ok(cut)
    }

    /// Takes the incisions out of the mesh and its skin.
    ///
    /// Vertices keep their numbers, removed ones included. `mesh` and `triangles` are those of [`Cut::plan`].
    pub fn apply(&self, mesh: &mut TetMesh, triangles: &mut Vec<[u32; 3]>) -> Removed {
        if self.slits.is_empty() {
            return Removed::default();
        }
        let kept: Vec<bool> = mesh.tets.iter().map(|tet| !self.takes(&mesh.positions, tet)).collect();
        // An edge near a slit stays if a kept tet has it; far from the slits all edges stay.
        let mut held = HashSet::new();
        for (tet, _) in mesh.tets.iter().zip(&kept).filter(|(_, kept)| **kept) {
            for (a, b) in EDGES.map(|(a, b)| (tet[a], tet[b])) {
                if self.near[a as usize] && self.near[b as usize] {
                    held.insert([a.min(b), a.max(b)]);
                }
            }
        }
        let faces = triangles.len();
        let mut edges = Vec::new();
        mesh.edges.retain(|edge| {
            let stays = !edge.iter().all(|&v| self.near[v as usize]) || held.contains(edge);
            if !stays {
                edges.push(*edge);
            }
            stays
        });
        let taken = mesh.tets.iter().zip(&kept).filter(|(_, kept)| !**kept).map(|(tet, _)| *tet).collect();
        let mut stays = kept.iter();
        mesh.tets.retain(|_| stays.next() != Some(&false));
        triangles.retain(|triangle| !self.takes(&mesh.positions, triangle));
        Removed { tets: taken, edges, triangles: faces - triangles.len() }
    }

    /// Distance from a position at rest (local meters) to the nearest slit, mm; infinite without slits.
    pub fn distance_mm(&self, position: Point3<f32>) -> f64 {
        self.slits.iter().map(|slit| slit.distance(position) * 1000.0).fold(f64::INFINITY, f64::min)
    }

    /// True if the line between two positions at rest passes through the middle of a slit.
    pub(crate) fn crosses(&self, a: Point3<f32>, b: Point3<f32>) -> bool {
        self.slits.iter().any(|slit| slit.crosses(a, b))
    }

    /// True if a position at rest lies in a slit.
    pub(crate) fn holds(&self, position: Point3<f32>) -> bool {
        self.slits.iter().any(|slit| slit.holds(position))
    }

    /// True if a simplex has a removed corner or an edge through a slit.
    fn takes<const N: usize>(&self, positions: &[Point3<f32>], simplex: &[u32; N]) -> bool {
        if simplex.iter().any(|&v| self.removed[v as usize]) {
            return true;
        }
        simplex.iter().all(|&v| self.near[v as usize])
            && pairs(simplex).any(|(a, b)| self.crosses(positions[a as usize], positions[b as usize]))
    }

    fn check_cuts_something(&self, mesh: &TetMesh) -> Result<(), MeshError> {
        for (incision, slit) in self.slits.iter().enumerate() {
            let near = |&v: &u32| self.near[v as usize];
            let crosses =
                |[a, b]: &[u32; 2]| slit.crosses(mesh.positions[*a as usize], mesh.positions[*b as usize]);
            let held = mesh.positions.iter().zip(&self.near).any(|(&p, &near)| near && slit.holds(p));
            if !held && !mesh.edges.iter().any(|edge| edge.iter().all(near) && crosses(edge)) {
                return Err(MeshError::IncisionEmpty { incision, step_mm: mesh.lattice.longest_step_mm() });
            }
        }
        Ok(())
    }

    /// Vertices all of whose tets go are removed.
    fn remove_loose(&mut self, mesh: &TetMesh) {
        let mut held: Vec<bool> = self.near.iter().map(|near| !near).collect();
        for tet in mesh.tets.iter().filter(|tet| tet.iter().any(|&v| self.near[v as usize])) {
            if !self.takes(&mesh.positions, tet) {
                tet.iter().for_each(|&v| held[v as usize] = true);
            }
        }
        self.removed.iter_mut().zip(held).for_each(|(removed, held)| *removed |= !held);
    }

    /// Lip vertices: what is left of the skin triangles that a slit opens.
    fn find_lips(&self, mesh: &TetMesh, triangles: &[[u32; 3]]) -> Result<Vec<Gape>, MeshError> {
        let step = mesh.lattice.longest_step_mm() / 1000.0;
        let gape = |(incision, slit): (usize, &Slit)| {
            let opened = |triangle: &&[u32; 3]| {
                let corner = |&v: &u32| mesh.positions[v as usize];
                let touched = triangle.iter().all(|v| slit.near(corner(v), step))
                    && (triangle.iter().any(|v| self.removed[*v as usize])
                        || pairs(triangle).any(|(a, b)| slit.crosses(corner(&a), corner(&b))));
                touched
                    && Facet::of(triangle.map(|v| mesh.positions[v as usize])).area_vector.dot(&slit.inward)
                        < 0.0
            };
            let mut lips: Vec<u32> = triangles.iter().filter(opened).flatten().copied().collect();
            lips.sort_unstable();
            lips.dedup();
            lips.retain(|&v| !self.removed[v as usize]);
            Gape::new(mesh, incision, slit, &lips, step)
        };
        self.slits.iter().enumerate().map(gape).collect()
    }
}

/// Refuses slits that touch a vertex of the body that a region froze, or that lies where a lattice is coarse: a slit touches what
/// lies in it, what an edge joins with that, and both ends of an edge that it crosses. `margin`: how far from it that can be.
fn check_within(mesh: &TetMesh, slits: &[Slit], margin: f64) -> Result<(), MeshError> {
    let (lattice, grid) = (&mesh.lattice, mesh.lattice.grid());
    let (planes, frozen) = (lattice.planes(), mesh.frozen.as_ref());
    if slits.is_empty() || (planes.is_none() && frozen.is_none()) {
        return Ok(());
    }
    let around = Neighbors::new(lattice);
    let (vertex_of, place) =
        (mesh.vertex_of_point(), |point: usize| mesh.frame.to_local(lattice.mm(grid.point(point))));
    let is_frozen = |point: usize| frozen.is_some_and(|frozen| frozen.points[point]);
    let touches = |slit: &Slit, point: usize, position: Point3<f32>| {
        let mut touched = slit.holds(position);
        around.of(point, |other| {
            if vertex_of[other] != NO_VERTEX || is_frozen(other) {
                touched |= slit.holds(place(other)) || slit.crosses(position, place(other));
            }
        });
        touched
    };
    let refuse = |points: &mut dyn Iterator<Item = usize>, coarse: bool| {
        let touched = points.flat_map(|point| {
            let position = place(point);
            let near = slits.iter().enumerate().filter(move |(_, slit)| slit.near(position, margin));
            near.filter(move |(_, slit)| touches(slit, point, position))
                .map(move |(incision, slit)| (incision, slit.distance(position), position))
        });
        match touched.max_by(|(_, a, _), (_, b, _)| a.total_cmp(b)) {
            None => Ok(()),
            Some((incision, distance, position)) => Err(MeshError::IncisionBeyond {
                incision,
                distance_mm: distance * 1000.0,
                at_mm: mesh.frame.to_mm(position).into(),
                coarse,
            }),
        }
    };
    let vertices = || mesh.lattice_index.iter().map(|&point| point as usize);
    if let Some(frozen) = frozen {
        let border = vertices().zip(&frozen.border).filter(|(_, border)| **border).map(|(point, _)| point);
        refuse(&mut border.chain((0..grid.len()).filter(|&point| frozen.points[point])), false)?;
    }
    if let Some(planes) = planes {
        refuse(&mut vertices().filter(|&point| !planes.is_fine(grid.point(point))), true)?;
    }
    Ok(())
}

/// The edges of a simplex.
fn pairs<const N: usize>(simplex: &[u32; N]) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..N).flat_map(move |a| (a + 1..N).map(move |b| (simplex[a], simplex[b])))
}
