//! Finds the largest face-connected component of tets.

use crate::cells::CellMasks;

/// The largest component of a set of tets.
pub(crate) struct Largest {
    pub masks: CellMasks,
    /// One flag per lattice point: true if the point is a corner of such a tet.
    pub points: Vec<bool>,
    /// Number of all components.
    pub components: usize,
}

/// Finds the component with the most tets. Of several such components, the first in lattice order
/// is chosen.
pub(crate) fn largest(masks: CellMasks) -> Largest {
    let flood = Flood::new(&masks);
    let mut seen = vec![0u8; masks.bytes.len()];
    let (mut components, mut best) = (0, None::<(usize, usize, usize, usize)>);
    for k in 0..masks.shape[2] {
        masks.for_layer(k, |cell, flat, mask| {
            let parity = cell.iter().sum::<usize>() & 1;
            while mask & !seen[flat] != 0 {
                let tet = (mask & !seen[flat]).trailing_zeros() as usize;
                let size = flood.fill(&mut seen, flat, parity, tet);
                components += 1;
                if best.is_none_or(|(largest, ..)| size > largest) {
                    best = Some((size, flat, parity, tet));
                }
            }
        });
    }
    let masks = match best {
        Some((_, flat, parity, tet)) if components > 1 => {
            seen.fill(0);
            flood.fill(&mut seen, flat, parity, tet);
            CellMasks { stencil: masks.stencil, shape: masks.shape, bytes: seen }
        }
        _ => masks,
    };
    Largest { points: masks.used_points(), masks, components }
}

/// A face that a tet shares with a tet of another cell.
struct Crossing {
    tet: u8,
    delta: isize,
    other: u8,
}

struct Flood<'a> {
    masks: &'a CellMasks,
    /// `[parity][mask][tet]`: the tets of the mask that are connected to `tet` within the cell.
    parts: [Vec<[u8; 6]>; 2],
    crossings: [Vec<Crossing>; 2],
}

impl<'a> Flood<'a> {
    fn new(masks: &'a CellMasks) -> Self {
        let stencil = masks.stencil;
        let inside = |parity: usize, tet: usize| {
            let own_cell = stencil.neighbors[parity][tet].iter().filter(|n| n.offset == [0; 3]);
            own_cell.fold(0u8, |mask, n| mask | 1 << n.tet)
        };
        let part = |parity: usize, mask: u8, tet: usize| {
            let mut part = mask & 1 << tet;
            loop {
                let tets = (0..stencil.tets[parity].len()).filter(|t| part >> t & 1 == 1);
                let grown = tets.fold(part, |grown, t| grown | mask & inside(parity, t));
                if grown == part {
                    return part;
                }
                part = grown;
            }
        };
        let tets = stencil.tets[0].len();
        let parts = [0, 1].map(|parity| {
            (0..64u8)
                .map(|mask| std::array::from_fn(|t| if t < tets { part(parity, mask, t) } else { 0 }))
                .collect()
        });
        let crossings = stencil.neighbors.each_ref().map(|tets| {
            let faces = tets.iter().enumerate().flat_map(|(t, faces)| faces.iter().map(move |n| (t, n)));
            let leaving = faces.filter(|(_, n)| n.offset != [0; 3]);
            leaving
                .map(|(t, n)| Crossing { tet: t as u8, delta: masks.delta(n.offset), other: n.tet })
                .collect()
        });
        Self { masks, parts, crossings }
    }

    /// Marks all tets connected to a tet in `seen`. Returns their number.
    fn fill(&self, seen: &mut [u8], flat: usize, parity: usize, tet: usize) -> usize {
        let part = |flat: usize, parity: usize, tet: usize| {
            self.parts[parity][usize::from(self.masks.bytes[flat])][tet]
        };
        let first = part(flat, parity, tet);
        seen[flat] |= first;
        let (mut size, mut stack) = (0, vec![(flat, parity, first)]);
        while let Some((flat, parity, tets)) = stack.pop() {
            size += tets.count_ones() as usize;
            for crossing in self.crossings[parity].iter().filter(|c| tets >> c.tet & 1 == 1) {
                let to = flat.wrapping_add_signed(crossing.delta);
                let bit = 1u8 << crossing.other;
                if self.masks.bytes[to] & !seen[to] & bit != 0 {
                    let reached = part(to, parity ^ 1, usize::from(crossing.other));
                    seen[to] |= reached;
                    stack.push((to, parity ^ 1, reached));
                }
            }
        }
        size
    }
}
