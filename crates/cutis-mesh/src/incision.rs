//! Static incisions: the vertices and elements that they remove, and the lips that they leave.

use std::collections::HashSet;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::gape::Gape;
use crate::neighbors::Neighbors;
use crate::piece::Piece;
use crate::pocket::Pocket;
use crate::sever::{Blade, longest_edge};
use crate::skin_surface::{Facet, check_indices};
use crate::slit::Slit;
use crate::{MeshError, NO_VERTEX, TetMesh};

/// An incision along straight segments on or near the skin, in world millimeters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Incision {
    /// Ends of the segments in mm: two points or more.
    pub path_mm: Vec<[f64; 3]>,
    /// Depth below the local skin in mm.
    pub depth_mm: f64,
    /// Full width of the slit in mm. Without it the cut has no width: it removes nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width_mm: Option<f64>,
}

/// Incisions planned on a mesh.
///
/// A vertex is *removed* if it is in a slit: within half the width, between start and end, and not
/// deeper below the local skin than the depth. Removed vertices are in no constraint (paper, §4.2).
///
/// Tets, edges and triangles with an edge through the middle surface of a slit are removed as well.
/// Therefore the lips separate even if the slit is narrower than a lattice step or oblique to the
/// lattice. Vertices that have no tet after that are also removed.
///
/// A slit without a width removes nothing. [`Cut::sever`] cuts along it.
#[derive(Clone, Debug)]
pub struct Cut {
    /// One flag per mesh vertex: true if the vertex is removed.
    pub removed: Vec<bool>,
    /// The slits: one for each segment, in the order of the incisions.
    pub slits: Vec<Slit>,
    /// The gape of each incision, in their order. Those of incisions without a width are missing
    /// until [`Cut::sever`]. Then those of pieces follow.
    pub gapes: Vec<Gape>,
    /// Underminings.
    pub pockets: Vec<Pocket>,
    /// Excisions.
    pub pieces: Vec<Piece>,
    /// One flag per mesh vertex: true if a slit can cut an element with this corner.
    near: Vec<bool>,
}

/// The elements that [`Cut::apply`] removed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Removed {
    /// Removed tets, in mesh vertices.
    pub tets: Vec<[u32; 4]>,
    /// Removed edges, in mesh vertices.
    pub edges: Vec<[u32; 2]>,
    /// Removed skin triangles, in mesh vertices, in the order of the uncut skin.
    pub triangles: Vec<[u32; 3]>,
}

const EDGES: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

impl Cut {
    /// Plans the incisions of some slits ([`Slit::on_lattice`]) on an uncut mesh with its skin
    /// `triangles` (mesh vertices, oriented outwards). Without slits the cut removes nothing.
    ///
    /// # Errors
    /// [`MeshError::VertexIndex`] if a triangle names a vertex that does not exist.
    /// [`MeshError::IncisionBeyond`] if a slit touches tissue outside the region of the mesh or the
    /// coarse part of a graded lattice. [`MeshError::IncisionEmpty`] if a slit cuts nothing.
    /// [`MeshError::IncisionWithoutLips`] if it leaves no skin on one side.
    pub fn of_slits(mesh: &TetMesh, triangles: &[[u32; 3]], slits: Vec<Slit>) -> Result<Self, MeshError> {
        check_indices(triangles, mesh.positions.len())?;
        // All corners of a cut element are within the diagonal of a cell from the slit.
        let spacing_mm = mesh.lattice.grid().affine.spacing_mm();
        let longest_edge_mm = spacing_mm.iter().sum::<f64>().max(mesh.lattice.longest_moved_edge_mm());
        let margin = longest_edge_mm / 1000.0;
        check_within(mesh, &slits, margin)?;
        let removes = |p| slits.iter().any(|slit| !slit.removes_nothing() && slit.near(p, margin));
        let near = mesh.positions.iter().map(|&p| removes(p)).collect();
        let removed = mesh.positions.iter().map(|&p| slits.iter().any(|slit| slit.contains(p))).collect();
        let (gapes, pockets, pieces) = (Vec::new(), Vec::new(), Vec::new());
        let mut cut = Self { removed, slits, gapes, pockets, pieces, near };
        cut.check_each_slit_cuts(mesh)?;
        cut.remove_vertices_without_tets(mesh);
        cut.gapes = cut.find_lips(mesh, triangles)?;
        Ok(cut)
    }

    /// Adds underminings and excisions, which [`Cut::sever`] makes.
    ///
    /// # Errors
    /// [`MeshError::Undermining`] or [`MeshError::Excision`] if one touches tissue outside the
    /// region of the mesh or the coarse part of a graded lattice.
    pub fn with(
        mut self,
        mesh: &TetMesh,
        pockets: Vec<Pocket>,
        pieces: Vec<Piece>,
    ) -> Result<Self, MeshError> {
        let beyond = |blade: &Blade| blade_beyond(mesh, blade);
        if let Some((undermining, why)) =
            pockets.iter().enumerate().find_map(|(n, pocket)| Some((n, beyond(&pocket.blade)?)))
        {
            return Err(MeshError::Undermining { undermining, why });
        }
        if let Some((excision, why)) =
            pieces.iter().enumerate().find_map(|(n, piece)| Some((n, piece.blades.iter().find_map(beyond)?)))
        {
            return Err(MeshError::Excision { excision, why });
        }
        (self.pockets, self.pieces) = (pockets, pieces);
        Ok(self)
    }

    /// Removes the cut elements from the mesh and its skin.
    ///
    /// All vertices keep their numbers, including the removed ones. `mesh` and `triangles` must be
    /// those of [`Cut::of_slits`].
    pub fn apply(&self, mesh: &mut TetMesh, triangles: &mut Vec<[u32; 3]>) -> Removed {
        if self.slits.is_empty() {
            return Removed::default();
        }
        let kept: Vec<bool> = mesh.tets.iter().map(|tet| !self.cuts(&mesh.positions, tet)).collect();
        // An edge near a slit stays if a kept tet has it. All edges far from the slits stay.
        let mut held = HashSet::new();
        for (tet, _) in mesh.tets.iter().zip(&kept).filter(|(_, kept)| **kept) {
            for (a, b) in EDGES.map(|(a, b)| (tet[a], tet[b])) {
                if self.near[a as usize] && self.near[b as usize] {
                    held.insert([a.min(b), a.max(b)]);
                }
            }
        }
        let mut edges = Vec::new();
        mesh.edges.retain(|edge| {
            let stays = !edge.iter().all(|&v| self.near[v as usize]) || held.contains(edge);
            if !stays {
                edges.push(*edge);
            }
            stays
        });
        let removed = mesh.tets.iter().zip(&kept).filter(|(_, kept)| !**kept).map(|(tet, _)| *tet).collect();
        let mut stays = kept.iter();
        mesh.tets.retain(|_| stays.next() != Some(&false));
        let skin = std::mem::take(triangles);
        let (cut, kept) = skin.into_iter().partition(|triangle| self.cuts(&mesh.positions, triangle));
        *triangles = kept;
        Removed { tets: removed, edges, triangles: cut }
    }

    /// Distance in mm from a rest position (local meters) to the nearest slit, pocket or piece.
    /// Infinite without any.
    pub fn distance_mm(&self, position: Point3<f32>) -> f64 {
        let slits = self.slits.iter().map(|slit| slit.distance(position));
        let pockets = self.pockets.iter().map(|pocket| pocket.distance(position));
        let pieces = self.pieces.iter().map(|piece| piece.distance(position));
        slits.chain(pockets).chain(pieces).fold(f64::INFINITY, f64::min) * 1000.0
    }

    /// True if a rest position (local meters) continues an incision beyond one of its ends, within
    /// `reach_mm` along it and to its sides.
    pub fn is_beyond_an_end(&self, position: Point3<f32>, reach_mm: f64) -> bool {
        let reach = reach_mm / 1000.0;
        self.incisions().any(|slits| {
            let [first, last] = [&slits[0], &slits[slits.len() - 1]];
            let [start, end] = [first, last].map(|slit| slit.coordinates(position.cast()));
            let beyond = [(-start.along, start.lateral), (end.along - last.length(), end.lateral)];
            beyond.iter().any(|&(past, lateral)| past > 0.0 && past <= reach && lateral.abs() <= reach)
        })
    }

    /// True if the line between two rest positions passes through the middle surface of a slit with
    /// a width.
    pub(crate) fn crosses(&self, a: Point3<f32>, b: Point3<f32>) -> bool {
        self.slits.iter().any(|slit| !slit.removes_nothing() && slit.crosses(a, b))
    }

    /// True if a rest position is in a slit.
    pub(crate) fn contains(&self, position: Point3<f32>) -> bool {
        self.slits.iter().any(|slit| slit.contains(position))
    }

    /// True if a simplex has a removed corner or an edge through the middle surface of a slit.
    fn cuts<const N: usize>(&self, positions: &[Point3<f32>], simplex: &[u32; N]) -> bool {
        if simplex.iter().any(|&v| self.removed[v as usize]) {
            return true;
        }
        simplex.iter().all(|&v| self.near[v as usize])
            && pairs(simplex).any(|(a, b)| self.crosses(positions[a as usize], positions[b as usize]))
    }

    fn check_each_slit_cuts(&self, mesh: &TetMesh) -> Result<(), MeshError> {
        for slits in self.removing() {
            let near = |&v: &u32| self.near[v as usize];
            let crosses = |[a, b]: &[u32; 2]| {
                let [a, b] = [a, b].map(|&v| mesh.positions[v as usize]);
                slits.iter().any(|slit| slit.crosses(a, b))
            };
            let contains = |p: Point3<f32>| slits.iter().any(|slit| slit.contains(p));
            let held = mesh.positions.iter().zip(&self.near).any(|(&p, &near)| near && contains(p));
            if !held && !mesh.edges.iter().any(|edge| edge.iter().all(near) && crosses(edge)) {
                let incision = slits[0].incision;
                return Err(MeshError::IncisionEmpty { incision, step_mm: mesh.lattice.longest_step_mm() });
            }
        }
        Ok(())
    }

    /// The slits of each incision, in order.
    pub fn incisions(&self) -> impl Iterator<Item = &[Slit]> {
        self.slits.chunk_by(|a, b| a.incision == b.incision)
    }

    /// The slits of each incision with a width.
    fn removing(&self) -> impl Iterator<Item = &[Slit]> {
        self.incisions().filter(|slits| !slits[0].removes_nothing())
    }

    /// Removes the vertices whose tets are all cut.
    fn remove_vertices_without_tets(&mut self, mesh: &TetMesh) {
        let mut held: Vec<bool> = self.near.iter().map(|near| !near).collect();
        for tet in mesh.tets.iter().filter(|tet| tet.iter().any(|&v| self.near[v as usize])) {
            if !self.cuts(&mesh.positions, tet) {
                tet.iter().for_each(|&v| held[v as usize] = true);
            }
        }
        self.removed.iter_mut().zip(held).for_each(|(removed, held)| *removed |= !held);
    }

    /// The gape of each incision with a width. The lips are the remaining vertices of the skin
    /// triangles that it opens.
    fn find_lips(&self, mesh: &TetMesh, triangles: &[[u32; 3]]) -> Result<Vec<Gape>, MeshError> {
        let step = mesh.lattice.longest_step_mm() / 1000.0;
        let opens = |slit: &Slit, triangle: &[u32; 3]| {
            let corner = |&v: &u32| mesh.positions[v as usize];
            let touched = triangle.iter().all(|v| slit.near(corner(v), step))
                && (triangle.iter().any(|v| self.removed[*v as usize])
                    || pairs(triangle).any(|(a, b)| slit.crosses(corner(&a), corner(&b))));
            touched
                && Facet::of(triangle.map(|v| mesh.positions[v as usize])).area_vector.dot(&slit.inward) < 0.0
        };
        let gape = |slits: &[Slit]| {
            let opened = |triangle: &&[u32; 3]| slits.iter().any(|slit| opens(slit, triangle));
            let mut lips: Vec<u32> = triangles.iter().filter(opened).flatten().copied().collect();
            lips.sort_unstable();
            lips.dedup();
            lips.retain(|&v| !self.removed[v as usize]);
            Gape::of_vertices(mesh, slits, &lips, step)
        };
        self.removing().map(gape).collect()
    }
}

/// Returns an error if a slit touches a vertex of the body outside the region or in the coarse part
/// of a lattice.
///
/// A slit touches the vertices in it, their neighbors along edges, and both ends of each edge that
/// it crosses. These are at most `margin` from the slit.
fn check_within(mesh: &TetMesh, slits: &[Slit], margin: f64) -> Result<(), MeshError> {
    let (lattice, grid) = (&mesh.lattice, mesh.lattice.grid());
    let (planes, inactive) = (lattice.planes(), mesh.inactive.as_ref());
    if slits.is_empty() || (planes.is_none() && inactive.is_none()) {
        return Ok(());
    }
    let around = Neighbors::new(lattice);
    let (vertex_of, position_of) =
        (mesh.vertex_of_point(), |point: usize| mesh.frame.to_local(lattice.mm(grid.point(point))));
    let is_inactive = |point: usize| inactive.is_some_and(|inactive| inactive.points[point]);
    let touches = |slit: &Slit, point: usize, position: Point3<f32>| {
        let mut touched = slit.contains(position);
        around.of(point, |other| {
            if vertex_of[other] != NO_VERTEX || is_inactive(other) {
                touched |= slit.contains(position_of(other)) || slit.crosses(position, position_of(other));
            }
        });
        touched
    };
    let refuse = |points: &mut dyn Iterator<Item = usize>, coarse: bool| {
        let touched = points.flat_map(|point| {
            let position = position_of(point);
            let near = slits.iter().filter(move |slit| slit.near(position, margin));
            near.filter(move |slit| touches(slit, point, position))
                .map(move |slit| (slit.incision, slit.distance(position), position))
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
    if let Some(inactive) = inactive {
        let border = vertices().zip(&inactive.border).filter(|(_, border)| **border).map(|(point, _)| point);
        refuse(&mut border.chain((0..grid.len()).filter(|&point| inactive.points[point])), false)?;
    }
    if let Some(planes) = planes {
        refuse(&mut vertices().filter(|&point| !planes.is_fine(grid.point(point))), true)?;
    }
    Ok(())
}

/// Where a blade cuts outside the region or in the coarse part of a lattice, as text. None if it
/// does not.
///
/// A blade touches the vertices in its piece and both ends of each edge that it severs.
fn blade_beyond(mesh: &TetMesh, blade: &Blade) -> Option<String> {
    let (lattice, grid, inactive) = (&mesh.lattice, mesh.lattice.grid(), mesh.inactive.as_ref());
    if lattice.planes().is_none() && inactive.is_none() {
        return None;
    }
    let (reach, around) = (longest_edge(lattice), Neighbors::new(lattice));
    let (vertex_of, position_of) =
        (mesh.vertex_of_point(), |point: usize| mesh.frame.to_local(lattice.mm(grid.point(point))).cast());
    let in_body = |point: usize| {
        vertex_of[point] != NO_VERTEX || inactive.is_some_and(|inactive| inactive.points[point])
    };
    let touched = |point: usize| {
        let position = position_of(point);
        if !blade.near(&position, reach) {
            return false;
        }
        let mut touched = blade.encloses(position);
        around.of(point, |other| {
            touched |= in_body(other) && blade.separates([position, position_of(other)], reach);
        });
        touched
    };
    let vertices = || mesh.lattice_index.iter().map(|&point| point as usize);
    let refuse = |point: usize, place: &str| {
        let at_mm: [f64; 3] = lattice.mm(grid.point(point)).into();
        format!("it touches a vertex of the body at {at_mm:.1?} mm that lies {place}; make that larger")
    };
    if let Some(inactive) = inactive {
        let border = vertices().zip(&inactive.border).filter(|(_, border)| **border).map(|(point, _)| point);
        let outside = (0..grid.len()).filter(|&point| inactive.points[point]);
        if let Some(point) = border.chain(outside).find(|&point| touched(point)) {
            return Some(refuse(point, "outside the region (lattice.region)"));
        }
    }
    let planes = lattice.planes()?;
    let coarse = |&point: &usize| !planes.is_fine(grid.point(point));
    let point = vertices().filter(coarse).find(|&point| touched(point))?;
    Some(refuse(point, "in the coarse part of the lattice (lattice.grading)"))
}

/// The edges of a simplex.
fn pairs<const N: usize>(simplex: &[u32; N]) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..N).flat_map(move |a| (a + 1..N).map(move |b| (simplex[a], simplex[b])))
}
