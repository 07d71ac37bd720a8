//! ChainMail's relaxation.

use crate::link;

/// The name of the entry point of [`relax`].
pub const RELAX: &str = "relax";
/// Words of a sweep in the buffer that counts moves.
pub const SWEEP_WORDS: usize = 64;
/// How many of them count: one for each coordinate and each half of a sweep, `2 · coordinate + odd`.
pub const SWEEP_HALVES: usize = 6;

/// One coordinate of half the elements of a slab.
pub fn relax() -> String {
    link(&[include_str!("../wgsl/chainmail/relax.wgsl")])
}
