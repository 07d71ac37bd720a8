//! The relaxation of the ChainMail model.

use crate::link;

/// Name of the entry point of [`relax`].
pub const RELAX: &str = "relax";
/// Number of words of a sweep in the buffer that counts moved elements.
pub const SWEEP_WORDS: usize = 64;
/// Number of words in use: one per coordinate and parity, with the index `2 · coordinate + odd`.
pub const SWEEP_HALVES: usize = 6;

/// Returns the source that relaxes one coordinate of the elements of one parity in a slab.
pub fn relax() -> String {
    link(&[include_str!("../wgsl/chainmail/relax.wgsl")])
}
