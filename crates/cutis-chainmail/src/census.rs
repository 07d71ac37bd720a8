//! How each element can be relaxed, looked up once: not at all, side by side with others, or by itself.

use rayon::prelude::*;

use crate::chain::{Body, NO_MATERIAL};

/// The element has links of several kinds, or fewer than six.
pub(crate) const MIXED: u8 = NO_MATERIAL - 1;
/// There is no element, or it is fixed or held.
pub(crate) const STILL: u8 = NO_MATERIAL;

/// For each place of the grid: the material of an element that is free and linked with six of the same material, [`MIXED`] for
/// other elements that are free, or [`STILL`].
pub(crate) fn census(body: &Body) -> Vec<u8> {
    let of = |element: u32| {
        let material = body.materials[element as usize];
        if material == NO_MATERIAL || body.links.is_held(element) {
            return STILL;
        }
        let alike = |neighbour: u32| body.materials[neighbour as usize] == material;
        let alike = body.links.of(element).filter(|n| alike(n.element)).count() == 6;
        if alike { material } else { MIXED }
    };
    (0..body.materials.len() as u32).into_par_iter().map(of).collect()
}
