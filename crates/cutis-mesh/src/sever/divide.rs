//! Which tets blades divide, and into which parts.

use rayon::prelude::*;

use super::components::{EDGES, count, parts_of};
use super::severing::{Severing, Sides};
use super::walls::{Walls, raise};
use super::wound::{SplitTet, TetCopy, TooManyBlades, Wound};
use crate::TetMesh;

/// A part with a smaller share of its tet gets no copy. It holds no voxel, and the other parts take
/// its volume.
const LEAST_SHARE: f64 = 1e-3;

/// Least share of mass and stiffness that a copy gets. Thinner parts would slow solvers down: with
/// vertex block descent of 2 × 2 steps a wound opened by a sixth less in the same time.
pub(super) const THIN: f64 = 0.02;

/// A tet is divided if this share of its section along a blade is cut, and not held together by
/// less than this share.
pub(super) const LEAST_CUT: f64 = 0.01;

/// The share that is cut, or 1 if less than the least share holds the tet together.
pub(super) fn share_of_cut(share: f64) -> f64 {
    if share > 1.0 - LEAST_CUT { 1.0 } else { share }
}

/// A divided tet while its nodes are not known.
pub(super) struct Divided {
    pub cell: [usize; 3],
    pub number: usize,
    pub tet: u32,
    pub parts: [u8; 4],
    kept: u8,
    /// Share of the section that is cut.
    cut: f64,
    pub volumes: [f64; 4],
    pub distances: Vec<[f32; 4]>,
    pub blades: Vec<u32>,
    /// For each part: the blade that takes it out.
    pub gone: [Option<u32>; 4],
}

impl Divided {
    /// The blade that takes the whole tet out.
    pub fn gone_whole(&self) -> Option<u32> {
        let parts = self.parts.map(|part| self.gone[usize::from(part)]);
        parts.iter().all(Option::is_some).then_some(parts[0]).flatten()
    }
}

/// A tet that blades cut: its cell, its number in the cell, and the share of its section that each
/// blade has cut.
struct Touched {
    tet: u32,
    cell: [usize; 3],
    number: usize,
    cuts: Vec<(u32, f64)>,
}

impl Severing {
    /// Finds the divided tets, their copies, and the nodes of the copies.
    ///
    /// # Errors
    /// [`TooManyBlades`].
    pub fn wound(&self, mesh: &TetMesh) -> Result<Wound, TooManyBlades> {
        Ok(self.wound_of(mesh, &self.divided(mesh)?))
    }

    /// The wound of these divided tets.
    pub(super) fn wound_of(&self, mesh: &TetMesh, divided: &[Divided]) -> Wound {
        let mut wound = Wound::default();
        for tet in divided {
            let walls = (wound.distances.len() as u32, tet.distances.len() as u8);
            wound.distances.extend(&tet.distances);
            wound.blades.extend(&tet.blades);
            let Divided { tet: number, parts, kept, cut, .. } = *tet;
            let first_copy = wound.copies.len() as u32;
            let around = |pair: &[u32]| pair[1] == pair[0] + 1 && self.blades[pair[0] as usize].with_next;
            let piece = tet.blades.windows(2).position(around).map(|row| row as u8);
            wound.split.push(SplitTet { tet: number, parts, kept, first_copy, cut, walls, piece });
            let copy = |of_tet: u8, nodes, share: f64, whole, gone: Option<u32>| TetCopy {
                tet: number,
                number: of_tet,
                nodes,
                share: share as f32,
                whole,
                gone,
            };
            for (of_tet, part) in (0..).zip((0..4).filter(|part| kept >> part & 1 == 1)) {
                let share = tet.cut * tet.volumes[part];
                wound.copies.push(copy(of_tet, [0; 4], share, false, tet.gone[part]));
            }
            if tet.cut < 1.0 {
                let corners = mesh.tets[number as usize];
                let gone = tet.gone_whole();
                wound.copies.push(copy(kept.count_ones() as u8, corners, 1.0 - tet.cut, true, gone));
            }
        }
        self.join(mesh, divided, &mut wound);
        self.edges(mesh, &mut wound);
        wound
    }

    /// The severed edges of a tet as a mask.
    fn severed(&self, mesh: &TetMesh, corners: &[u32; 4]) -> u8 {
        EDGES.iter().enumerate().fold(0, |mask, (n, &(a, b))| {
            let [low, high] = [corners[a].min(corners[b]), corners[a].max(corners[b])];
            let bits = self.edges[low as usize];
            mask | u8::from(bits != 0 && bits >> self.direction(mesh, low, high) & 1 == 1) << n
        })
    }

    /// The direction of the edge between two vertices.
    pub(super) fn direction(&self, mesh: &TetMesh, low: u32, high: u32) -> usize {
        let (p, q) = (mesh.point(low), mesh.point(high));
        let step: [i8; 3] = std::array::from_fn(|axis| (q[axis] as isize - p[axis] as isize) as i8);
        let directions = &self.index.stencil().directions[p.iter().sum::<usize>() & 1];
        directions.iter().position(|d| d.step == step).expect("corners of a tet are joined by lattice edges")
    }

    /// The tets that blades have cut, in ascending order.
    fn touched(&self) -> Vec<Touched> {
        let mut touched: Vec<Touched> = Vec::new();
        for (blade, sides) in (0..).zip(&self.blades) {
            for own in &sides.sections {
                let cut = own.section.cut(&sides.border, sides.reached);
                if cut >= LEAST_CUT {
                    let cuts = vec![(blade, share_of_cut(cut))];
                    touched.push(Touched { tet: own.tet, cell: own.cell, number: own.number, cuts });
                }
            }
        }
        touched.sort_by_key(|touched| touched.tet);
        touched.dedup_by(|next, first| {
            let same = next.tet == first.tet;
            if same {
                first.cuts.append(&mut next.cuts);
            }
            same
        });
        touched
    }

    /// The tets of pieces that are taken out and that no blade has cut.
    fn within_pieces(&self, mesh: &TetMesh, touched: &[Touched]) -> Vec<Touched> {
        let mut within = Vec::new();
        let taken = self.blades.iter().filter(|sides| sides.reached >= sides.length);
        for &vertex in taken.flat_map(|sides| &sides.inside) {
            self.index.around_point(mesh.point(vertex), |cell, number| {
                let tet = self.index.position(cell, number);
                if touched.binary_search_by_key(&tet, |touched| touched.tet).is_err() {
                    within.push(Touched { tet, cell, number, cuts: Vec::new() });
                }
            });
        }
        within.sort_by_key(|touched| touched.tet);
        within.dedup_by_key(|touched| touched.tet);
        within
    }

    pub(super) fn divided(&self, mesh: &TetMesh) -> Result<Vec<Divided>, TooManyBlades> {
        let mut touched = self.touched();
        touched.extend(self.within_pieces(mesh, &touched));
        touched.sort_by_key(|touched| touched.tet);
        let divide = |touched: &Touched| self.divide(mesh, touched).transpose();
        touched.par_iter().filter_map(divide).collect()
    }

    /// The blade that has taken out the piece that holds a vertex.
    fn taken_by(&self, vertex: u32) -> Option<u32> {
        let takes =
            |sides: &Sides| sides.reached >= sides.length && sides.inside.binary_search(&vertex).is_ok();
        self.blades.iter().position(takes).map(|blade| blade as u32)
    }

    /// Divides a tet. One blade divides it by the sides of the corners, as far as it has cut the
    /// section. Several blades divide it by the edges that they have severed.
    fn divide(&self, mesh: &TetMesh, touched: &Touched) -> Result<Option<Divided>, TooManyBlades> {
        let Touched { tet, cell, number, ref cuts } = *touched;
        let corners = &mesh.tets[tet as usize];
        let distances = |blades: &[u32]| -> Vec<[f32; 4]> {
            let sides = blades.iter().map(|&blade| &self.blades[blade as usize]);
            sides.map(|sides| corners.map(|v| sides.distance(v).unwrap_or_default())).collect()
        };
        let mut blades: Vec<u32> = cuts.iter().map(|(blade, _)| *blade).collect();
        if blades.len() > Walls::MOST {
            return Err(TooManyBlades { tet, blades: blades.len() });
        }
        let (mut cut, mut parts) = (1.0, parts_of(self.severed(mesh, corners)));
        let deepest = cuts.iter().max_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some(deepest) = deepest.filter(|_| blades.len() == 1 || count(&parts) == 1) {
            (blades, cut) = (vec![deepest.0], deepest.1);
            let [row] = distances(&blades)[..] else { return Ok(None) };
            let apart =
                |(n, &(a, b)): (usize, &(usize, usize))| u8::from((row[a] >= 0.0) != (row[b] >= 0.0)) << n;
            parts = parts_of(EDGES.iter().enumerate().map(apart).fold(0, |mask, bit| mask | bit));
        }
        let distances = distances(&blades);
        let all = Walls { distances: &distances, parts, kept: 15, piece: None };
        let shares = all.volumes();
        let kept = (0..4).fold(0, |kept, n| kept | u8::from(shares[n] >= LEAST_SHARE) << n);
        let mut volumes = Walls { kept, ..all }.volumes();
        raise(&mut volumes, kept, THIN);
        let gone = |part: u8| {
            let first = parts.iter().position(|&other| other == part)?;
            self.taken_by(corners[first])
        };
        let gone = [0, 1, 2, 3].map(gone);
        Ok(Some(Divided { cell, number, tet, parts, kept, cut, volumes, distances, blades, gone }))
    }
}
