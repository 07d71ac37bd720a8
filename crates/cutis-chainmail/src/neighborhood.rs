//! How each element can be relaxed, looked up once: not at all, side by side with others, or by itself.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::chain::{Body, NO_MATERIAL};
use crate::limits::Bounds;
use crate::links::{BEFORE, NEXT};

/// An element that is free and of no common kind: it has fewer than six links, or such materials around it as few have.
pub(crate) const MIXED: u8 = MOST_KINDS as u8;
/// There is no element, or it is fixed or held.
pub(crate) const STILL: u8 = NO_MATERIAL;
/// A bit for each fits into a word.
const MOST_KINDS: usize = 64;

/// The kinds of elements that are relaxed side by side, and which element is of which.
#[derive(Clone, Debug, Default)]
pub(crate) struct Census {
    /// For each place of the grid the number of its kind, [`MIXED`] or [`STILL`]; empty before it was first asked.
    pub(crate) of: Vec<u8>,
    /// The most frequent first.
    pub(crate) kinds: Vec<Kind>,
}

/// What elements of a kind may do, in units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kind {
    /// By coordinate and axis, bounds of the links before and after.
    pub(crate) bounds: [[[Bounds; 2]; 3]; 3],
    /// How near they may be left to where they are asked to be.
    pub(crate) k: i32,
}

/// The material of an element with six links, and those of the elements before and after along each axis.
type Materials = (u8, [[u8; 2]; 3]);

/// Of an element, if it has six links.
fn materials(body: &Body, element: usize) -> Option<Materials> {
    const ALL: u8 = NEXT[0] | NEXT[1] | NEXT[2] | BEFORE[0] | BEFORE[1] | BEFORE[2];
    if body.links.bits_of(element) & ALL != ALL {
        return None;
    }
    let [nx, ny, _] = body.links.shape();
    let around = [1, nx, nx * ny].map(|far| [element - far, element + far].map(|at| body.materials[at]));
    Some((body.materials[element], around))
}

impl Kind {
    fn new(body: &Body, (material, around): Materials) -> Self {
        let limits = &body.limits;
        let of = |coordinate, axis: usize| {
            around[axis].map(|other| limits.of(coordinate, limits.pair(material, other), axis))
        };
        let bounds = [0, 1, 2].map(|coordinate| [0, 1, 2].map(|axis| of(coordinate, axis)));
        Self { bounds, k: limits.k(material) }
    }
}

impl Census {
    /// Of a body as it is linked now.
    pub(crate) fn new(body: &Body) -> Self {
        let places = 0..body.materials.len();
        let still =
            |element: usize| body.materials[element] == NO_MATERIAL || body.links.is_held(element as u32);
        type Counts = HashMap<Materials, usize>;
        let count = |mut counts: Counts, element: usize| {
            if let Some(around) = materials(body, element).filter(|_| !still(element)) {
                *counts.entry(around).or_default() += 1;
            }
            counts
        };
        let both = |a: Counts, b: Counts| {
            let (mut more, less) = if a.len() < b.len() { (b, a) } else { (a, b) };
            less.into_iter().for_each(|(around, count)| *more.entry(around).or_default() += count);
            more
        };
        let counts = places.clone().into_par_iter().fold(HashMap::new, count).reduce(HashMap::new, both);
        let mut counts: Vec<(Materials, usize)> = counts.into_iter().collect();
        counts.sort_unstable_by_key(|&(around, count)| (usize::MAX - count, around));
        counts.truncate(MOST_KINDS);
        let numbers: HashMap<Materials, u8> = counts.iter().map(|&(around, _)| around).zip(0..).collect();
        let state = |element: usize| match materials(body, element) {
            _ if still(element) => STILL,
            Some(around) => numbers.get(&around).copied().unwrap_or(MIXED),
            None => MIXED,
        };
        Self {
            of: places.into_par_iter().map(state).collect(),
            kinds: counts.into_iter().map(|(around, _)| Kind::new(body, around)).collect(),
        }
    }
}
