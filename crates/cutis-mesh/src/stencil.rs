//! Tables that are the same for every cell of a lattice: tets, their neighbors across faces, and
//! edge directions.

use std::sync::LazyLock;

use crate::Split;

/// The tet on the other side of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Neighbor {
    /// Offset of its cell. Zero for a tet of the same cell.
    pub offset: [i8; 3],
    /// Number of the tet within that cell.
    pub tet: u8,
    /// The corner of the tet that is not in the face, as a corner number of that cell.
    pub opposite: u8,
}

/// A direction of edges from a point to a point of higher flat index.
#[derive(Clone, Debug)]
pub(crate) struct Direction {
    pub step: [i8; 3],
    /// Number of the direction within the split, for colors.
    pub number: u16,
    /// Cells around the edge, as offsets from its first point, each with a mask of its tets that
    /// have the edge.
    pub cells: Vec<([i8; 3], u8)>,
}

/// Tables for one split and handedness. The index `[parity]` is `(i + j + k) & 1` of the cell or
/// point.
#[derive(Debug)]
pub(crate) struct Stencil {
    pub tets: [Vec<[u8; 4]>; 2],
    /// `[parity][corners]`: mask of the tets whose four corners are all in the mask `corners`.
    pub kept: [[u8; 256]; 2],
    /// `[parity][tets]`: mask of the corners of the tets in the mask `tets`.
    pub corners: [[u8; 64]; 2],
    /// `[parity][air]`: number of tets with 0, 1, 2, 3 and 4 corners in the mask `air`.
    pub air_corners: [[[u8; 5]; 256]; 2],
    /// `[parity][tet][f]`: the neighbor across the face opposite to corner `f` of the tet.
    pub neighbors: [Vec<[Neighbor; 4]>; 2],
    /// `[parity]` of the first point: the directions, ascending by the flat index of the second
    /// point.
    pub directions: [Vec<Direction>; 2],
}

const TABLES: [(Split, bool); 4] =
    [(Split::Kuhn6, false), (Split::Kuhn6, true), (Split::Five, false), (Split::Five, true)];
static STENCILS: LazyLock<[Stencil; 4]> =
    LazyLock::new(|| TABLES.map(|(split, left)| Stencil::new(split, left)));

impl Stencil {
    pub fn of(split: Split, left_handed: bool) -> &'static Self {
        &STENCILS[2 * usize::from(split == Split::Five) + usize::from(left_handed)]
    }

    fn new(split: Split, left_handed: bool) -> Self {
        let mut tets = match split {
            Split::Kuhn6 => [kuhn6(), kuhn6()],
            Split::Five => [five(0), five(7)],
        };
        for tet in tets.iter_mut().flatten() {
            if (orientation(tet) < 0) != left_handed {
                tet.swap(2, 3);
            }
        }
        let bits = |tet: &[u8; 4]| tet.iter().fold(0u8, |bits, corner| bits | 1 << corner);
        let kept = tets.each_ref().map(|tets| {
            std::array::from_fn(|present| {
                let has = |tet: &[u8; 4]| present as u8 & bits(tet) == bits(tet);
                tets.iter().enumerate().fold(0u8, |mask, (t, tet)| mask | u8::from(has(tet)) << t)
            })
        });
        let corners = tets.each_ref().map(|tets| {
            std::array::from_fn(|mask| {
                tets.iter()
                    .enumerate()
                    .fold(0u8, |used, (t, tet)| if mask >> t & 1 == 1 { used | bits(tet) } else { used })
            })
        });
        let air_corners = tets.each_ref().map(|tets| {
            std::array::from_fn(|air| {
                let mut histogram = [0u8; 5];
                tets.iter().for_each(|tet| histogram[(air as u8 & bits(tet)).count_ones() as usize] += 1);
                histogram
            })
        });
        let neighbors = [0, 1].map(|parity| neighbors(&tets, parity));
        let directions = directions(&tets);
        Self { tets, kept, corners, air_corners, neighbors, directions }
    }
}

/// One tet for each order of the three axis steps from corner 0 to corner 7, in ascending order.
fn kuhn6() -> Vec<[u8; 4]> {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    orders.iter().map(|[a, b, _]| [0, 1 << a, 1 << a | 1 << b, 7]).collect()
}

/// The middle tet and the four tets at its faces. `mirror` is 0 or 7.
fn five(mirror: u8) -> Vec<[u8; 4]> {
    let middle = [0, 3, 5, 6].map(|corner| corner ^ mirror);
    let at_corner = |apex: u8| [apex, apex ^ 1, apex ^ 2, apex ^ 4];
    std::iter::once(middle).chain([1, 2, 4, 7].map(|corner| at_corner(corner ^ mirror))).collect()
}

fn place(corner: u8) -> [i8; 3] {
    [0, 1, 2].map(|axis| (corner >> axis & 1) as i8)
}

fn orientation(tet: &[u8; 4]) -> i32 {
    let [a, b, c, d] = tet.map(place);
    let from_a = |p: [i8; 3]| [0, 1, 2].map(|axis| i32::from(p[axis] - a[axis]));
    let ([x, y, z], [u, v, w], [p, q, r]) = (from_a(b), from_a(c), from_a(d));
    x * (v * r - w * q) - y * (u * r - w * p) + z * (u * q - v * p)
}

fn neighbors(tets: &[Vec<[u8; 4]>; 2], parity: usize) -> Vec<[Neighbor; 4]> {
    let across = |tet: usize, f: usize| {
        let own = tets[parity][tet];
        let face: Vec<[i8; 3]> = (0..4).filter(|&v| v != f).map(|v| place(own[v])).collect();
        // A face whose three corners have the same coordinate along an axis is between two cells.
        let plane = (0..3).find(|&axis| face.iter().all(|p| p[axis] == face[0][axis]));
        let mut offset = [0i8; 3];
        if let Some(axis) = plane {
            offset[axis] = 2 * face[0][axis] - 1;
        }
        let other_parity = parity ^ usize::from(plane.is_some());
        tets[other_parity].iter().enumerate().find_map(|(t, other)| {
            if plane.is_none() && t == tet {
                return None;
            }
            let in_face = |corner: u8| {
                let p = place(corner);
                face.contains(&[0, 1, 2].map(|axis| p[axis] + offset[axis]))
            };
            let mut outside = other.iter().filter(|&&corner| !in_face(corner));
            match (outside.next(), outside.next()) {
                (Some(&opposite), None) => Some(Neighbor { offset, tet: t as u8, opposite }),
                _ => None,
            }
        })
    };
    (0..tets[parity].len())
        .map(|tet| {
            std::array::from_fn(|f| {
                across(tet, f).expect("the splits of neighboring cells share their faces")
            })
        })
        .collect()
}

fn directions(tets: &[Vec<[u8; 4]>; 2]) -> [Vec<Direction>; 2] {
    let mut found: [Vec<Direction>; 2] = [Vec::new(), Vec::new()];
    for parity in 0..2 {
        for first in 0..8u8 {
            // The cell whose corner `first` is the point.
            let offset = place(first).map(|p| -p);
            let cell_parity = parity ^ (first.count_ones() as usize & 1);
            for (t, tet) in tets[cell_parity].iter().enumerate().filter(|(_, tet)| tet.contains(&first)) {
                for &second in tet.iter().filter(|&&corner| corner != first) {
                    let (p, q) = (place(first), place(second));
                    let step = [0, 1, 2].map(|axis| q[axis] - p[axis]);
                    if flat_order(step) < 0 {
                        continue;
                    }
                    let all = &mut found[parity];
                    let at = all.iter().position(|d| d.step == step).unwrap_or_else(|| {
                        all.push(Direction { step, number: 0, cells: Vec::new() });
                        all.len() - 1
                    });
                    let cells = &mut all[at].cells;
                    match cells.iter_mut().find(|(cell, _)| *cell == offset) {
                        Some((_, mask)) => *mask |= 1 << t,
                        None => cells.push((offset, 1 << t)),
                    }
                }
            }
        }
        found[parity].sort_by_key(|d| flat_order(d.step));
    }
    let mut steps: Vec<[i8; 3]> = found.iter().flatten().map(|d| d.step).collect();
    steps.sort_by_key(|&step| flat_order(step));
    steps.dedup();
    for direction in found.iter_mut().flatten() {
        direction.number = steps.iter().position(|&step| step == direction.step).unwrap_or(0) as u16;
    }
    found
}

/// A sort key that orders steps by their flat index: by `k`, then `j`, then `i`.
fn flat_order([i, j, k]: [i8; 3]) -> i32 {
    i32::from(i) + 4 * i32::from(j) + 16 * i32::from(k)
}
