//! Pairs of points on both sides of a cut, for the contact of its lips.
//!
//! A blade severs a lattice edge at one point. After the cut there are two such points, one on each
//! side, which coincide at rest. A [`LipPair`] names the nodes that move them.

use nalgebra::{Point3, Vector3};

use super::components::EDGES;
use super::growth::{Cut, GrowingTet, Growth};
use super::severing::{Severing, around_section};
use super::wound::{SplitTet, Wound};
use crate::TetMesh;

/// Two points that coincide at rest, on both sides of a cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LipPair {
    /// The lattice edge on which they lie, in vertices of the mesh, the lower one first.
    pub edge: [u32; 2],
    /// Number among the pairs of this edge, for colors.
    pub number: u8,
    /// Number of the blade, as in [`Severed::blades`](super::Severed::blades).
    pub blade: u32,
    /// The nodes at the ends of the edge: both on the positive side of the blade, then both on the
    /// negative side. All four are different.
    pub nodes: [u32; 4],
    /// Part of the edge before the points, from 0 to 1.
    pub part: f32,
    /// Unit normal of the cut at rest, from the negative to the positive side.
    pub normal: [f32; 3],
    /// Area of the cut in m² for which the pair stands. The pairs share the area of the cut.
    pub area: f32,
}

/// What a divided tet needs to name pairs at any stage of its cut.
#[derive(Debug)]
pub(super) struct LipSite {
    /// Its corners, as vertices of the mesh.
    vertices: [u32; 4],
    /// The edges that whole tets have too, as a mask. Only for tets with a part without a copy.
    firm: u8,
    /// The edges that pass through a piece which is taken out, as a mask.
    through: u8,
    walls: Vec<Wall>,
}

/// A blade in a divided tet.
#[derive(Debug)]
struct Wall {
    blade: u32,
    /// Distances of the corners in m.
    distances: [f32; 4],
    /// Unit normal, towards positive distances.
    normal: Vector3<f64>,
    /// Area of the section in m².
    area: f64,
    /// The edges that the blade severs, and how far along its path. Empty if it is alone.
    severed: Vec<(u8, f64)>,
}

/// A divided tet at a stage.
struct Divided {
    /// Share of its section that is cut.
    cut: f64,
    /// The nodes of the copy that holds each corner. None for a part without a copy.
    held: [Option<[u32; 4]>; 4],
}

impl Wall {
    fn is_positive(&self, corner: usize) -> bool {
        self.distances[corner] >= 0.0
    }

    fn divides(&self, (a, b): (usize, usize)) -> bool {
        self.is_positive(a) != self.is_positive(b)
    }
}

impl Severing {
    /// The pairs of a finished wound, ordered by their edges.
    pub fn lip_pairs(&self, mesh: &TetMesh, wound: &Wound) -> Vec<LipPair> {
        let sites = self.lip_sites(mesh, wound);
        let reached: Vec<f64> = self.blades.iter().map(|blade| blade.reached).collect();
        let of_split = |n: usize| {
            let split = &wound.split[n];
            let copy = |part| wound.copy_of(split, part).map(|copy| &wound.copies[copy]);
            let held =
                split.parts.map(|part| copy(part).filter(|copy| copy.gone.is_none()).map(|copy| copy.nodes));
            Some(Divided { cut: split.cut, held })
        };
        pairs(&sites, &reached, of_split)
    }

    /// The sites of the divided tets of a wound.
    pub(super) fn lip_sites(&self, mesh: &TetMesh, wound: &Wound) -> Vec<LipSite> {
        wound.split.iter().map(|split| self.lip_site(mesh, wound, split)).collect()
    }

    fn lip_site(&self, mesh: &TetMesh, wound: &Wound, split: &SplitTet) -> LipSite {
        let vertices = mesh.tets[split.tet as usize];
        let corners = vertices.map(|v| mesh.positions[v as usize].cast::<f64>());
        let ends = |(a, b): (usize, usize)| [vertices[a].min(vertices[b]), vertices[a].max(vertices[b])];
        let is_thin = split.parts.iter().any(|part| split.kept >> part & 1 == 0);
        let firm = |edge: &(usize, usize)| is_thin && self.whole_volume(mesh, wound, ends(*edge)) > 0.0;
        let firm = (0..).zip(&EDGES).fold(0, |mask, (n, edge)| mask | u8::from(firm(edge)) << n);
        let rows = wound.walls_of(split);
        let through = split.piece.map_or(0, |row| {
            let [(_, first), (_, second)] = [0, 1].map(|n| &rows[usize::from(row) + n]);
            (0..).zip(&EDGES).fold(0, |mask, (n, &edge)| mask | u8::from(passes(first, second, edge)) << n)
        });
        let alone = rows.len() == 1;
        let wall = |(blade, distances): (u32, [f32; 4])| {
            let severed = (0..).zip(&EDGES).filter_map(|(n, edge)| {
                let [low, high] = ends(*edge);
                let direction = self.direction(mesh, low, high) as u8;
                Some((n, self.blades[blade as usize].crossing(low, direction)?))
            });
            let severed = if alone { Vec::new() } else { severed.collect() };
            let (normal, area) = section(&corners, &distances)?;
            Some(Wall { blade, distances, normal, area, severed })
        };
        LipSite { vertices, firm, through, walls: rows.into_iter().filter_map(wall).collect() }
    }
}

impl Growth {
    /// The pairs after each blade has cut up to a length in m along its path, ordered by their
    /// edges. They depend only on these lengths. Sides that still share a node have no pair.
    ///
    /// # Panics
    /// If there is not one length per blade.
    pub fn lip_pairs(&self, reached: &[f64]) -> Vec<LipPair> {
        let cuts = self.cuts(reached);
        let root = self.roots(&cuts);
        let node = |local: u32| self.nodes()[root[local as usize]];
        let taken = |blade: u32| self.takes_out(blade, reached);
        let of_tet = |(tet, cut): (&GrowingTet, &Cut)| {
            let share = cut.as_ref()?.0;
            let there = |corner: &u8| !tet.is_gone(usize::from(tet.parts[usize::from(*corner)]), &taken);
            let held = [0, 1, 2, 3].map(|n| Some(n).filter(there));
            let held = held.map(|corner| Some(tet.holding(cut, corner?)?.map(node)));
            Some(Divided { cut: share, held })
        };
        pairs(&self.sites, reached, |n| of_tet((&self.tets[n], &cuts[n])))
    }
}

/// A pair in a tet. `edge` are corners of the tet.
struct Candidate<'a> {
    wall: &'a Wall,
    edge: [usize; 2],
    nodes: [u32; 4],
    part: f32,
}

/// A share of a tet in a pair.
struct Contribution {
    edge: [u32; 2],
    blade: u32,
    nodes: [u32; 4],
    part: f32,
    /// Normal times area.
    area: Vector3<f64>,
}

/// The pairs of all sites.
fn pairs(sites: &[LipSite], reached: &[f64], at: impl Fn(usize) -> Option<Divided>) -> Vec<LipPair> {
    let mut all: Vec<Contribution> = Vec::new();
    for (n, site) in sites.iter().enumerate() {
        if let Some(divided) = at(n) {
            site.contribute(&divided, reached, &mut all);
        }
    }
    // Contributions to one pair stay in the order of their tets.
    all.sort_by_key(|one| (one.edge, one.blade, one.nodes));
    let mut pairs: Vec<LipPair> = Vec::new();
    for same in all.chunk_by(|a, b| (a.edge, a.blade, a.nodes) == (b.edge, b.blade, b.nodes)) {
        let sum: Vector3<f64> = same.iter().map(|one| one.area).sum();
        let Contribution { edge, blade, nodes, part, .. } = same[0];
        let Some(normal) = sum.try_normalize(0.0) else { continue };
        let area: f64 = same.iter().map(|one| one.area.norm()).sum();
        let number = pairs.last().filter(|last| last.edge == edge).map_or(0, |last| last.number + 1);
        let normal = normal.map(|n| n as f32).into();
        pairs.push(LipPair { edge, number, blade, nodes, part, normal, area: area as f32 });
    }
    pairs
}

impl LipSite {
    /// Adds what a tet contributes to pairs.
    ///
    /// Each edge between copies has a pair where the blade severs it. A part without a copy is so
    /// thin that the blade passes along its corners. Behind it is the whole tissue that has these
    /// corners too. There the pairs are in the middle of the edges along the blade.
    fn contribute(&self, divided: &Divided, reached: &[f64], all: &mut Vec<Contribution>) {
        let held = &divided.held;
        let mut found: Vec<Candidate<'_>> = Vec::new();
        for (n, &(a, b)) in (0..).zip(&EDGES) {
            let [low, high] = if self.vertices[a] < self.vertices[b] { [a, b] } else { [b, a] };
            let (wall, [own, other], part) = match (held[a], held[b]) {
                (Some(own), Some(other)) if own != other && self.through >> n & 1 == 0 => {
                    let Some(wall) = self.wall(n, (a, b), reached) else { continue };
                    let (d, e) = (f64::from(wall.distances[low]), f64::from(wall.distances[high]));
                    (wall, [own, other], (d / (d - e)) as f32)
                }
                (None, None) if self.firm >> n & 1 == 1 => {
                    let Some(wall) = self.walls.first() else { continue };
                    let beyond = (0..4).find(|&corner| wall.divides((a, corner)));
                    let Some(copy) = beyond.and_then(|corner| held[corner]) else { continue };
                    (wall, [self.vertices, copy], 0.5)
                }
                _ => continue,
            };
            let [plus, minus] = if wall.is_positive(a) { [own, other] } else { [other, own] };
            let nodes = [plus[low], plus[high], minus[low], minus[high]];
            found.push(Candidate { wall, edge: [low, high], nodes, part });
        }
        for &Candidate { wall, edge, nodes, part } in &found {
            let of_wall = found.iter().filter(|other| other.wall.blade == wall.blade).count();
            let area = wall.normal * (wall.area * divided.cut / of_wall as f64);
            let apart = nodes[0] != nodes[2] && nodes[1] != nodes[3];
            if apart && area != Vector3::zeros() {
                let edge = edge.map(|corner| self.vertices[corner]);
                all.push(Contribution { edge, blade: wall.blade, nodes, part, area });
            }
        }
    }

    /// The blade that severs an edge: of several the first one that has passed it.
    fn wall(&self, number: u8, edge: (usize, usize), reached: &[f64]) -> Option<&Wall> {
        let mut dividing = self.walls.iter().filter(|wall| wall.divides(edge));
        let passed = |wall: &&Wall| {
            let reached = reached[wall.blade as usize];
            wall.severed.iter().any(|&(severed, at)| severed == number && at <= reached)
        };
        let begun = |wall: &&Wall| reached[wall.blade as usize] > 0.0;
        dividing.clone().find(passed).or_else(|| dividing.find(begun))
    }
}

/// Whether an edge is negative in its middle part for both of two blades, and not at its ends.
fn passes(first: &[f32; 4], second: &[f32; 4], (a, b): (usize, usize)) -> bool {
    let differ = |distances: &[f32; 4]| (distances[a] >= 0.0) != (distances[b] >= 0.0);
    let inside = |n: usize| first[n] < 0.0 && second[n] < 0.0;
    let at_zero = || {
        let part = f64::from(first[a]) / (f64::from(first[a]) - f64::from(first[b]));
        f64::from(second[a]) + part * (f64::from(second[b]) - f64::from(second[a]))
    };
    differ(first) && differ(second) && !inside(a) && !inside(b) && at_zero() < 0.0
}

/// Unit normal and area in m² of the section on which the linear interpolation of distances is
/// zero. None without a section.
fn section(corners: &[Point3<f64>; 4], distances: &[f32; 4]) -> Option<(Vector3<f64>, f64)> {
    let point = |(a, b): (usize, usize)| {
        let (d, e) = (f64::from(distances[a]), f64::from(distances[b]));
        corners[a] + (corners[b] - corners[a]) * (d / (d - e))
    };
    let around: Vec<Point3<f64>> = around_section(distances).into_iter().map(point).collect();
    let first = *around.first()?;
    let fan = around.windows(2).map(|pair| (pair[0] - first).cross(&(pair[1] - first)));
    let area = fan.sum::<Vector3<f64>>() / 2.0;
    // The gradient of the distance, from its values at the corners.
    let [e1, e2, e3] = [1, 2, 3].map(|n| corners[n] - corners[0]);
    let [d1, d2, d3] = [1, 2, 3].map(|n| f64::from(distances[n]) - f64::from(distances[0]));
    let slope = (e2.cross(&e3) * d1 + e3.cross(&e1) * d2 + e1.cross(&e2) * d3) / e1.dot(&e2.cross(&e3));
    Some((slope.try_normalize(0.0)?, area.norm()))
}
