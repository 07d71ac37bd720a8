//! Neighborhood classes: groups of elements that relaxation can move together with SIMD
//! instructions.
//!
//! Two elements belong to one class if both have six links, their materials are equal, and so are
//! the materials of their neighbors. Only the most frequent classes are kept.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::chain::{NO_MATERIAL, Structure};
use crate::limits::Bounds;
use crate::links::{BEFORE, NEXT};

/// A free element without a class: it has fewer than six links, or its neighborhood is rare.
pub(crate) const UNCLASSIFIED: u8 = MAX_CLASSES as u8;
/// No element, or one that is fixed or held.
pub(crate) const IMMOBILE: u8 = NO_MATERIAL;
/// Largest number of classes: a set of them fits into 64 bits.
const MAX_CLASSES: usize = 64;

/// The classes of a chain, and the class of each element.
#[derive(Clone, Debug, Default)]
pub(crate) struct NeighborhoodClasses {
    /// For each grid point the number of its class, [`UNCLASSIFIED`] or [`IMMOBILE`]. Empty until
    /// the first relaxation.
    pub(crate) class_of: Vec<u8>,
    /// The classes, the most frequent one first.
    pub(crate) classes: Vec<NeighborhoodClass>,
}

/// The limits that all elements of a class share, in units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NeighborhoodClass {
    /// By coordinate and axis: bounds of the links to the element before and to the one after.
    pub(crate) bounds: [[[Bounds; 2]; 3]; 3],
    /// Smallest move that relaxation makes.
    pub(crate) k: i32,
}

/// The material of an element, and those of the elements before and after it along each axis.
type Materials = (u8, [[u8; 2]; 3]);

/// The materials of an element and of its neighbors, if it has six links.
fn materials(structure: &Structure, element: usize) -> Option<Materials> {
    const ALL: u8 = NEXT[0] | NEXT[1] | NEXT[2] | BEFORE[0] | BEFORE[1] | BEFORE[2];
    if structure.links.bits_of(element) & ALL != ALL {
        return None;
    }
    let [nx, ny, _] = structure.links.shape();
    let neighbors =
        [1, nx, nx * ny].map(|far| [element - far, element + far].map(|at| structure.materials[at]));
    Some((structure.materials[element], neighbors))
}

impl NeighborhoodClass {
    fn new(structure: &Structure, (material, neighbors): Materials) -> Self {
        let limits = &structure.limits;
        let of = |coordinate, axis: usize| {
            neighbors[axis].map(|other| limits.of(coordinate, limits.pair(material, other), axis))
        };
        let bounds = [0, 1, 2].map(|coordinate| [0, 1, 2].map(|axis| of(coordinate, axis)));
        Self { bounds, k: limits.k(material) }
    }
}

impl NeighborhoodClasses {
    /// Finds the classes of a chain with its present links.
    pub(crate) fn new(structure: &Structure) -> Self {
        let places = 0..structure.materials.len();
        let is_immobile = |element: usize| {
            structure.materials[element] == NO_MATERIAL || structure.links.is_held(element as u32)
        };
        type Counts = HashMap<Materials, usize>;
        let count = |mut counts: Counts, element: usize| {
            if let Some(found) = materials(structure, element).filter(|_| !is_immobile(element)) {
                *counts.entry(found).or_default() += 1;
            }
            counts
        };
        let merge = |a: Counts, b: Counts| {
            let (mut larger, smaller) = if a.len() < b.len() { (b, a) } else { (a, b) };
            smaller.into_iter().for_each(|(found, count)| *larger.entry(found).or_default() += count);
            larger
        };
        let counts = places.clone().into_par_iter().fold(HashMap::new, count).reduce(HashMap::new, merge);
        let mut counts: Vec<(Materials, usize)> = counts.into_iter().collect();
        counts.sort_unstable_by_key(|&(found, count)| (usize::MAX - count, found));
        counts.truncate(MAX_CLASSES);
        let numbers: HashMap<Materials, u8> = counts.iter().map(|&(found, _)| found).zip(0..).collect();
        let class = |element: usize| match materials(structure, element) {
            _ if is_immobile(element) => IMMOBILE,
            Some(found) => numbers.get(&found).copied().unwrap_or(UNCLASSIFIED),
            None => UNCLASSIFIED,
        };
        Self {
            class_of: places.into_par_iter().map(class).collect(),
            classes: counts.into_iter().map(|(found, _)| NeighborhoodClass::new(structure, found)).collect(),
        }
    }
}
