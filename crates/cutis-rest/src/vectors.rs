//! Vectors of the multigrid levels: some unknowns per node, in single precision.
//!
//! A node has `L` numbers: its unknowns, and zeros up to the length of a SIMD register.

use rayon::prelude::*;

/// The unknowns of a node on each level, with zeros to a multiple of four.
pub(crate) type Vector<const L: usize> = Vec<[f32; L]>;

/// Nodes that a thread takes at once. Sums of parts are added in order, so that a result does not
/// depend on the number of threads.
pub(crate) const PART: usize = 4096;

/// The sum of a term of each node.
pub(crate) fn sum(nodes: usize, term: impl Fn(usize) -> f64 + Sync) -> f64 {
    let of_part = |part: usize| (part * PART..((part + 1) * PART).min(nodes)).map(&term).sum::<f64>();
    let parts: Vec<f64> = (0..nodes.div_ceil(PART)).into_par_iter().map(of_part).collect();
    parts.iter().sum()
}

/// The inner product of two vectors.
pub(crate) fn dot<const L: usize>(a: &[[f32; L]], b: &[[f32; L]]) -> f64 {
    let parts = a.par_chunks(PART).zip(b.par_chunks(PART));
    parts.map(|(a, b)| dot_of_part(a, b)).collect::<Vec<f64>>().iter().sum()
}

/// The inner product of two vectors of at most [`PART`] nodes.
pub(crate) fn dot_of_part<const L: usize>(a: &[[f32; L]], b: &[[f32; L]]) -> f64 {
    let mut sums = [0.0; L];
    for (a, b) in a.iter().zip(b) {
        for n in 0..L {
            sums[n] += f64::from(a[n]) * f64::from(b[n]);
        }
    }
    sums.iter().sum()
}
