//! The elements of a tet, an edge and a triangle of a growing wound at a stage.

use super::{Cut, GrowingBlade, GrowingEdge, GrowingTet};
use crate::sever::components::{EDGES, count, parts_of};
use crate::sever::divide::{LEAST_CUT, share_of_cut};
use crate::sever::nodes::Classes;
use crate::sever::section::Section;
use crate::sever::wound::{DividedTriangle, EdgeCopy, TetCopy, TriangleCopy};

impl GrowingTet {
    /// How far the blades have cut it.
    pub(super) fn cut(&self, blades: &[GrowingBlade], reached: &[f64]) -> Cut {
        let share = |&(blade, section): &(u32, Section)| {
            let GrowingBlade { border, length } = &blades[blade as usize];
            let reached = reached[blade as usize].clamp(0.0, *length);
            (blade, share_of_cut(section.cut(border, reached)))
        };
        let cuts = self.sections.iter().map(share).filter(|(_, cut)| *cut >= LEAST_CUT);
        let deepest = cuts.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let severed = self
            .crossings
            .iter()
            .fold(0, |mask, &(edge, blade, at)| mask | u8::from(at <= reached[blade as usize]) << edge);
        let (cut, groups) = match self.groups(severed) {
            groups if self.sections.len() > 1 && count(&groups) > 1 => (1.0, groups),
            _ => {
                let mask = self.apart.iter().find(|(blade, _)| *blade == deepest.0)?.1;
                (deepest.1, self.groups(mask))
            }
        };
        (count(&groups) > 1).then_some((cut, groups))
    }

    /// The group of each part, if these edges are severed: parts that hold together are in one
    /// group, whose number is that of its lowest part.
    fn groups(&self, severed: u8) -> [u8; 4] {
        let now = parts_of(severed);
        let mut group = [0, 1, 2, 3];
        // At most four parts: three rounds pass the lowest number on to all.
        for _ in 0..3 {
            for (a, b) in EDGES {
                if now[a] == now[b] {
                    let [a, b] = [a, b].map(|corner| usize::from(self.parts[corner]));
                    let lowest = group[a].min(group[b]);
                    (group[a], group[b]) = (lowest, lowest);
                }
            }
        }
        // Numbers that no part has count as part 0.
        let parts = count(&self.parts);
        std::array::from_fn(|part| if (part as u8) < parts { group[part] } else { 0 })
    }

    /// The nodes of the copy that holds a corner. None if its part is too thin for a copy.
    pub(in crate::sever) fn holding(&self, cut: &Cut, corner: u8) -> Option<[u32; 4]> {
        let Some((_, groups)) = cut else { return Some(self.corners) };
        let group = groups[usize::from(self.parts[usize::from(corner)])];
        let mut held = (0..4).filter(|&part| groups[part] == group);
        held.find_map(|part| self.copies[part]).map(|(_, nodes)| nodes)
    }

    /// Joins the nodes of copies that are one at this stage.
    pub(in crate::sever) fn join(&self, cut: &Cut, classes: &mut Classes) {
        for (part, copy) in self.copies.iter().enumerate() {
            let Some((_, nodes)) = copy else { continue };
            let with = match cut {
                None => Some(self.corners),
                Some((_, groups)) => (0..part)
                    .find(|&lower| groups[lower] == groups[part] && self.copies[lower].is_some())
                    .and_then(|lower| self.copies[lower].map(|(_, nodes)| nodes)),
            };
            for (a, b) in nodes.iter().zip(with.iter().flatten()) {
                classes.join(*a as usize, *b as usize);
            }
        }
    }

    /// Whether a part is taken out of the body, by the blades that have taken out their pieces.
    pub(in crate::sever) fn is_gone(&self, part: usize, taken: &dyn Fn(u32) -> bool) -> bool {
        self.gone[part].is_some_and(taken)
    }

    /// Whether the whole tet is taken out.
    fn is_all_gone(&self, taken: &dyn Fn(u32) -> bool) -> bool {
        self.parts.iter().all(|&part| self.is_gone(usize::from(part), taken))
    }

    /// Adds the copies of the tet.
    pub(in crate::sever) fn copies_at(
        &self,
        cut: &Cut,
        node: &dyn Fn(u32) -> u32,
        taken: &dyn Fn(u32) -> bool,
        copies: &mut Vec<TetCopy>,
    ) {
        let mut add = |number, nodes: [u32; 4], share: f64, whole| {
            copies.push(TetCopy {
                tet: self.tet,
                number,
                nodes: nodes.map(node),
                share: share as f32,
                whole,
                gone: None,
            });
        };
        let all_gone = self.is_all_gone(taken);
        let Some((cut, groups)) = cut else {
            if !all_gone {
                add(0, self.corners, 1.0, true);
            }
            return;
        };
        for (part, copy) in self.copies.iter().enumerate() {
            let Some((number, nodes)) = copy else { continue };
            if self.is_gone(part, taken) {
                continue;
            }
            if let Some(share) = self.share_of_group(part, groups, &self.volumes) {
                add(*number, *nodes, cut * share, false);
            }
        }
        if *cut < 1.0 && !all_gone {
            let number = self.copies.iter().flatten().count() as u8;
            add(number, self.corners, 1.0 - cut, true);
        }
    }

    /// The sum of the shares of a group, if this part is the first of the group with a copy.
    fn share_of_group(&self, part: usize, groups: &[u8; 4], shares: &[f64; 4]) -> Option<f64> {
        let held = |other: usize| groups[other] == groups[part] && self.copies[other].is_some();
        let first = (0..part).all(|lower| !held(lower));
        first.then(|| (0..4).filter(|&other| held(other)).map(|other| shares[other]).sum())
    }
}

impl GrowingEdge {
    /// Adds the copies of the edge. `of_tet` are the copies of each divided tet.
    pub(in crate::sever) fn copies_at(
        &self,
        tets: &[TetCopy],
        of_tet: &[std::ops::Range<usize>],
        node: &dyn Fn(u32) -> u32,
        edges: &mut Vec<EdgeCopy>,
    ) {
        let mut copies: Vec<([u32; 2], f64)> = Vec::new();
        let mut add = |nodes: [u32; 2], volume: f64| match copies.iter_mut().find(|copy| copy.0 == nodes) {
            Some((_, sum)) => *sum += volume,
            None => copies.push((nodes, volume)),
        };
        if self.whole > 0.0 {
            add(self.ends.map(node), self.whole);
        }
        for &(split, corners, volume) in &self.tets {
            for copy in &tets[of_tet[split as usize].clone()] {
                let nodes = corners.map(|corner| copy.nodes[usize::from(corner)]);
                add(nodes, volume * f64::from(copy.share));
            }
        }
        copies.sort_by_key(|(nodes, _)| *nodes);
        let numbered = copies.into_iter().zip(0..);
        edges.extend(numbered.map(|((nodes, volume), number)| EdgeCopy {
            nodes,
            number,
            volume: volume as f32,
        }));
    }
}

impl DividedTriangle {
    /// Adds the copies of the triangle, as those of triangle `number`.
    pub(in crate::sever) fn copies_at(
        &self,
        number: u32,
        tet: &GrowingTet,
        cut: &Cut,
        node: &dyn Fn(u32) -> u32,
        taken: &dyn Fn(u32) -> bool,
        copies: &mut Vec<TriangleCopy>,
    ) {
        let mut add = |nodes: &[u32; 4], part, share: f64| {
            let nodes = self.corners.map(|corner| node(nodes[usize::from(corner)]));
            let share = share as f32;
            copies.push(TriangleCopy { triangle: number, split: self.split, part, nodes, share });
        };
        let all_gone = tet.is_all_gone(taken);
        let Some((cut, groups)) = cut else {
            if !all_gone {
                add(&tet.corners, None, 1.0);
            }
            return;
        };
        for (part, copy) in tet.copies.iter().enumerate() {
            let Some((_, nodes)) = copy else { continue };
            if tet.is_gone(part, taken) {
                continue;
            }
            if let Some(share) = tet.share_of_group(part, groups, &self.areas).filter(|share| *share > 0.0) {
                add(nodes, Some(part as u8), cut * share);
            }
        }
        if *cut < 1.0 && !all_gone {
            add(&tet.corners, None, 1.0 - cut);
        }
    }
}
