//! Lists of the tets that touch each z-slab.

use std::ops::Range;

use rayon::prelude::*;

/// Number of tets in a chunk that is sorted independently.
const CHUNK: usize = 1 << 17;

/// For each slab the tets that touch it, in ascending order. A counting sort of chunks with fixed
/// sizes runs in parallel, so that the result does not depend on the number of threads.
pub struct Buckets {
    chunks: Vec<Chunk>,
}

struct Chunk {
    order: Vec<u32>,
    offsets: Vec<u32>,
}

impl Buckets {
    /// Sorts the tets `0..count`. `slabs_of` gives the slabs that a tet touches, a range within
    /// `0..slabs` that may be empty.
    pub fn new(count: usize, slabs: usize, slabs_of: impl Fn(usize) -> Range<usize> + Sync) -> Self {
        let chunks = (0..count.div_ceil(CHUNK)).into_par_iter().map(|chunk| {
            let tets = chunk * CHUNK..count.min((chunk + 1) * CHUNK);
            let touched: Vec<(u32, u32)> =
                tets.clone().map(&slabs_of).map(|range| (range.start as u32, range.end as u32)).collect();
            let mut offsets = vec![0_u32; slabs + 1];
            for &(start, end) in &touched {
                for slab in start..end {
                    offsets[slab as usize + 1] += 1;
                }
            }
            for slab in 0..slabs {
                offsets[slab + 1] += offsets[slab];
            }
            let mut next = offsets.clone();
            let mut order = vec![0; offsets[slabs] as usize];
            for (tet, &(start, end)) in tets.zip(&touched) {
                for slab in start..end {
                    let slot = &mut next[slab as usize];
                    order[*slot as usize] = tet as u32;
                    *slot += 1;
                }
            }
            Chunk { order, offsets }
        });
        Self { chunks: chunks.collect() }
    }

    /// The tets of a slab in ascending order.
    pub fn slab(&self, slab: usize) -> impl Iterator<Item = usize> + '_ {
        self.chunks.iter().flat_map(move |chunk| {
            let range = chunk.offsets[slab] as usize..chunk.offsets[slab + 1] as usize;
            chunk.order[range].iter().map(|&tet| tet as usize)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_slab_lists_its_tets_in_ascending_order() {
        let count = CHUNK + 1000;
        let range = |tet: usize| (tet * 7 % 5)..(tet * 7 % 5 + tet % 3);
        let buckets = Buckets::new(count, 7, range);
        for slab in 0..7 {
            let expected: Vec<usize> = (0..count).filter(|&tet| range(tet).contains(&slab)).collect();
            assert!(buckets.slab(slab).eq(expected), "slab {slab}");
        }
    }
}
