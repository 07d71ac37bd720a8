//! The order of the vertices that can move.

use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

use cutis_coloring::Tuples;
use rayon::prelude::*;

/// Tuples that a thread takes at once.
const TUPLES: usize = 4096;
/// A vertex whose first neighbor is this many times farther away in the list than usual moves.
const FAR: u32 = 4;

/// Moves vertices that are far from their neighbors in the list to them. Meshes have most neighbors
/// near each other, but copies along a cut come last. `vertices` are ascending, and `tuples` have
/// the neighbors among all `count` vertices.
pub(crate) fn near_neighbors(vertices: Vec<u32>, tuples: &[Tuples<'_>], count: usize) -> Vec<u32> {
    let first: Vec<AtomicU32> = (0..count as u32).map(AtomicU32::new).collect();
    for of_kind in tuples {
        let tuples = of_kind.vertices.par_chunks_exact(of_kind.arity.max(1)).with_min_len(TUPLES);
        tuples.for_each(|tuple| {
            let lowest = tuple.iter().copied().min().unwrap_or_default();
            for &v in tuple {
                let first = &first[v as usize];
                if lowest < first.load(Relaxed) {
                    first.fetch_min(lowest, Relaxed);
                }
            }
        });
    }
    let first = |v: u32| first[v as usize].load(Relaxed);
    let mut gaps: Vec<u32> = vertices.iter().map(|&v| v - first(v)).collect();
    if gaps.is_empty() {
        return vertices;
    }
    let middle = gaps.len() / 2;
    let usual = *gaps.select_nth_unstable(middle).1;
    let place = |v: u32| {
        let first = first(v);
        if v - first > FAR.saturating_mul(usual) { first + usual } else { v }
    };
    let mut placed: Vec<(u32, u32)> = vertices.into_iter().map(|v| (place(v), v)).collect();
    placed.sort_unstable();
    placed.into_iter().map(|(_, v)| v).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of vertices, and a copy of one in its middle, which comes last.
    #[test]
    fn a_copy_comes_after_its_vertex() {
        let count = 100;
        let mut pairs: Vec<u32> = (0..count - 1).flat_map(|v| [v, v + 1]).collect();
        pairs.extend([49, count]);
        let tuples = [Tuples { vertices: &pairs, arity: 2 }];
        let order = near_neighbors((1..=count).collect(), &tuples, count as usize + 1);
        let expected: Vec<u32> = (1..=50).chain([count]).chain(51..count).collect();
        assert_eq!(order, expected);
        assert!(near_neighbors(Vec::new(), &tuples, count as usize + 1).is_empty());
    }
}
