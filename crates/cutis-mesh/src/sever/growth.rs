//! Cuts that grow: the elements of a wound while its blades have not reached their ends.
//!
//! The nodes are always those of the finished wound, so that they keep their numbers while it
//! grows. Nodes that a blade has not separated yet are one: all but the lowest *follow* it. The
//! elements depend only on how far each blade has come, not on the steps in which it came there.

mod elements;
mod virtual_nodes;

use super::axis_edges::AxisEdge;
use super::components::EDGES;
use super::divide::Divided;
use super::lip_pairs::LipSite;
use super::nodes::Classes;
use super::section::{Border, Section};
use super::severing::{Severing, Sides};
use super::wound::{DividedTriangle, EdgeCopy, TetCopy, TooManyBlades, TriangleCopy, Wound};
use crate::TetMesh;

pub use virtual_nodes::VirtualNode;

/// What a wound needs to know to grow. [`Growth::stage`] returns its elements.
#[derive(Debug)]
pub struct Growth {
    blades: Vec<GrowingBlade>,
    pub(super) tets: Vec<GrowingTet>,
    edges: Vec<GrowingEdge>,
    triangles: Vec<DividedTriangle>,
    /// The corners of the divided tets and the nodes of their copies, ascending.
    nodes: Vec<u32>,
    /// What each tet needs to name pairs of points for the contact of the lips.
    pub(super) sites: Vec<LipSite>,
    /// The edges along the axes of the lattice that each blade severs.
    axis_edges: Vec<Vec<AxisEdge>>,
}

#[derive(Clone, Copy, Debug)]
struct GrowingBlade {
    border: Border,
    length: f64,
}

/// A tet that the finished wound divides.
#[derive(Debug)]
pub(super) struct GrowingTet {
    tet: u32,
    /// Its corners, as positions in [`Growth::nodes`].
    corners: [u32; 4],
    /// The part of each corner in the finished wound.
    pub(super) parts: [u8; 4],
    /// For each part: the number of its copy, and its nodes as positions in [`Growth::nodes`].
    copies: [Option<(u8, [u32; 4])>; 4],
    /// Share of the volume of each part.
    volumes: [f64; 4],
    /// The section along each blade that cuts it.
    sections: Vec<(u32, Section)>,
    /// For several blades: the edges that each severs, and how far along its path.
    crossings: Vec<(u8, u32, f64)>,
    /// The edges whose ends are on different sides of each blade.
    apart: Vec<(u32, u8)>,
    /// Divided tets across its faces: number, and the corners of the face here and there.
    across: Vec<(u32, [[u8; 2]; 3])>,
    /// For each part: the blade that takes it out.
    gone: [Option<u32>; 4],
}

/// An edge of divided tets.
#[derive(Debug)]
struct GrowingEdge {
    /// Its ends, as positions in [`Growth::nodes`].
    ends: [u32; 2],
    /// Volume that it has from whole tets, in m³.
    whole: f64,
    /// The divided tets around it: number, corners of the ends, volume in m³.
    tets: Vec<(u32, [u8; 2], f64)>,
}

/// The elements of a wound that has grown up to some point. They replace those that
/// [`TetMesh::divide`] adds to a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stage {
    /// Nodes that are not separated from a lower one yet: the node, and the one that it follows.
    /// No element has them.
    pub follows: Vec<[u32; 2]>,
    /// The tets that the finished wound divides, or their copies.
    pub tets: Vec<TetCopy>,
    /// The edges of these tets.
    pub edges: Vec<EdgeCopy>,
    /// The triangles of the skin on these tets, numbered in the order of the skin. A triangle that
    /// is not cut has one copy, of share 1.
    pub triangles: Vec<TriangleCopy>,
}

/// A tet at a stage: the share of its section that is cut, and the group of each part. Parts of one
/// group are not separated yet. None if it is not cut.
pub(super) type Cut = Option<(f64, [u8; 4])>;

impl Severing {
    /// The wound after all blades have cut to their ends, and what it needs to grow to that.
    /// `triangles` is the skin of the mesh.
    ///
    /// # Errors
    /// [`TooManyBlades`].
    pub fn grow(&mut self, mesh: &TetMesh, triangles: &[[u32; 3]]) -> Result<(Wound, Growth), TooManyBlades> {
        self.cut_all();
        let divided = self.divided(mesh)?;
        let wound = self.wound_of(mesh, &divided);
        let growth = self.growth(mesh, &divided, &wound, triangles);
        Ok((wound, growth))
    }

    fn growth(&self, mesh: &TetMesh, divided: &[Divided], wound: &Wound, triangles: &[[u32; 3]]) -> Growth {
        let of_tets = wound.split.iter().flat_map(|split| mesh.tets[split.tet as usize]);
        let mut nodes: Vec<u32> = of_tets.chain(wound.copies.iter().flat_map(|copy| copy.nodes)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |node: u32| nodes.partition_point(|&other| other < node) as u32;
        let blades =
            self.blades.iter().map(|sides| GrowingBlade { border: sides.border, length: sides.length });
        let mut tets: Vec<GrowingTet> = Vec::with_capacity(divided.len());
        for (split, tet) in wound.split.iter().zip(divided) {
            let copies = [0, 1, 2, 3].map(|part| {
                let copy = &wound.copies[wound.copy_of(split, part)?];
                Some((copy.number, copy.nodes.map(local)))
            });
            let of_blade = |&blade: &u32| {
                let sections = &self.blades[blade as usize].sections;
                let found = sections.binary_search_by_key(&tet.tet, |section| section.tet).ok()?;
                Some((blade, sections[found].section))
            };
            let several = tet.blades.len() > 1;
            tets.push(GrowingTet {
                tet: tet.tet,
                corners: mesh.tets[tet.tet as usize].map(local),
                parts: tet.parts,
                copies,
                volumes: tet.volumes,
                sections: tet.blades.iter().filter_map(of_blade).collect(),
                crossings: if several { self.crossings_of(mesh, tet) } else { Vec::new() },
                apart: tet.blades.iter().copied().zip(tet.distances.iter().map(apart)).collect(),
                across: self.divided_across(mesh, tet, wound),
                gone: tet.gone,
            });
        }
        let edges = self.growing_edges(mesh, wound, &local);
        let triangles = wound.areas(mesh, triangles);
        let (axis_edges, sites) = (self.axis_edges(mesh), self.lip_sites(mesh, wound));
        Growth { blades: blades.collect(), tets, edges, triangles, nodes, axis_edges, sites }
    }

    /// Divided tets across the faces of one: number, and the corners of the face here and there.
    fn divided_across(&self, mesh: &TetMesh, tet: &Divided, wound: &Wound) -> Vec<(u32, [[u8; 2]; 3])> {
        let corners = &mesh.tets[tet.tet as usize];
        let across = |face: usize| {
            let (cell, number) = self.index.across(tet.cell, tet.number, face)?;
            let other = self.index.position(cell, number);
            let split = wound.split.binary_search_by_key(&other, |split| split.tet).ok()?;
            let there = &mesh.tets[other as usize];
            let corner = |step: usize| {
                let here = (face + step) % 4;
                Some([here as u8, there.iter().position(|&v| v == corners[here])? as u8])
            };
            Some((split as u32, [corner(1)?, corner(2)?, corner(3)?]))
        };
        (0..4).filter_map(across).collect()
    }

    /// The edges of a tet that blades sever, and how far along their paths.
    fn crossings_of(&self, mesh: &TetMesh, tet: &Divided) -> Vec<(u8, u32, f64)> {
        let corners = &mesh.tets[tet.tet as usize];
        let mut found = Vec::new();
        for (edge, &(a, b)) in (0..).zip(&EDGES) {
            let [low, high] = [corners[a].min(corners[b]), corners[a].max(corners[b])];
            let direction = self.direction(mesh, low, high) as u8;
            let crossing =
                |(blade, sides): (u32, &Sides)| Some((edge, blade, sides.crossing(low, direction)?));
            found.extend((0..).zip(&self.blades).filter_map(crossing));
        }
        found
    }

    fn growing_edges(&self, mesh: &TetMesh, wound: &Wound, local: &dyn Fn(u32) -> u32) -> Vec<GrowingEdge> {
        let mut all: Vec<([u32; 2], u32, [u8; 2], f64)> = Vec::new();
        for (number, split) in (0..).zip(&wound.split) {
            let corners = &mesh.tets[split.tet as usize];
            for (a, b) in EDGES {
                let (low, high) = if corners[a] < corners[b] { (a, b) } else { (b, a) };
                let volume = mesh.edge_share(corners, [a, b]);
                all.push(([corners[low], corners[high]], number, [low as u8, high as u8], volume));
            }
        }
        all.sort_by_key(|(ends, number, ..)| (*ends, *number));
        let of_edge = |same: &[([u32; 2], u32, [u8; 2], f64)]| GrowingEdge {
            ends: same[0].0.map(local),
            whole: self.whole_volume(mesh, wound, same[0].0),
            tets: same.iter().map(|&(_, number, corners, volume)| (number, corners, volume)).collect(),
        };
        all.chunk_by(|a, b| a.0 == b.0).map(of_edge).collect()
    }
}

/// The edges whose ends are on different sides, as a mask.
fn apart(distances: &[f32; 4]) -> u8 {
    let differ = |(a, b): (usize, usize)| u8::from((distances[a] >= 0.0) != (distances[b] >= 0.0));
    EDGES.into_iter().enumerate().fold(0, |mask, (n, edge)| mask | differ(edge) << n)
}

impl Growth {
    /// Lengths of the paths of the blades in m, in their order.
    pub fn lengths(&self) -> Vec<f64> {
        self.blades.iter().map(|blade| blade.length).collect()
    }

    /// The corners of the divided tets and the nodes of their copies, ascending. Other nodes never
    /// change.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Whether a blade has come so far that it takes out what it encloses.
    pub(super) fn takes_out(&self, blade: u32, reached: &[f64]) -> bool {
        reached[blade as usize] >= self.blades[blade as usize].length
    }

    /// The wound after each blade has cut up to a length in m along its path. A blade that has not
    /// begun has a length of 0.
    ///
    /// # Panics
    /// If there is not one length per blade.
    pub fn stage(&self, reached: &[f64]) -> Stage {
        let cuts = self.cuts(reached);
        let root = self.roots(&cuts);
        let node = |local: u32| self.nodes[root[local as usize]];
        let taken = |blade: u32| self.takes_out(blade, reached);
        let mut stage = Stage::default();
        let apart = (0..self.nodes.len()).filter(|&n| root[n] != n);
        stage.follows = apart.map(|n| [self.nodes[n], self.nodes[root[n]]]).collect();
        // The copies of each tet: first, number.
        let mut of_tet = Vec::with_capacity(self.tets.len());
        for (tet, cut) in self.tets.iter().zip(&cuts) {
            let first = stage.tets.len();
            tet.copies_at(cut, &node, &taken, &mut stage.tets);
            of_tet.push(first..stage.tets.len());
        }
        for edge in &self.edges {
            edge.copies_at(&stage.tets, &of_tet, &node, &mut stage.edges);
        }
        for (number, triangle) in (0..).zip(&self.triangles) {
            let split = triangle.split as usize;
            let tet = &self.tets[split];
            triangle.copies_at(number, tet, &cuts[split], &node, &taken, &mut stage.triangles);
        }
        stage
    }

    /// How far the blades have cut each tet.
    pub(super) fn cuts(&self, reached: &[f64]) -> Vec<Cut> {
        assert_eq!(reached.len(), self.blades.len(), "one length per blade");
        self.tets.iter().map(|tet| tet.cut(&self.blades, reached)).collect()
    }

    /// For each of [`Growth::nodes`], the position of the lowest node that is one with it.
    pub(super) fn roots(&self, cuts: &[Cut]) -> Vec<usize> {
        let mut classes = Classes::new(self.nodes.len());
        for (tet, cut) in self.tets.iter().zip(cuts) {
            tet.join(cut, &mut classes);
            for (other, face) in &tet.across {
                let (other, cut_there) = (&self.tets[*other as usize], &cuts[*other as usize]);
                // Each corner of the face names the copies that hold it on both sides.
                for [here, there] in face {
                    let named = (tet.holding(cut, *here), other.holding(cut_there, *there));
                    let (Some(a), Some(b)) = named else { continue };
                    face.iter().for_each(|[p, q]| {
                        classes.join(a[usize::from(*p)] as usize, b[usize::from(*q)] as usize);
                    });
                }
            }
        }
        (0..self.nodes.len()).map(|node| classes.root(node)).collect()
    }
}
