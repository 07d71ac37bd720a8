//! Lists of the tets that touch each tile.

use std::ops::Range;

use rayon::prelude::*;

use crate::tiling::{TileBox, Tiling};

/// Number of tets in a chunk that is sorted independently.
const CHUNK: usize = 1 << 16;

/// For each tile the tets that touch it, in ascending order.
///
/// Most tets touch one tile, which is also that of the tets next to them. So the lists hold runs of
/// tets. A counting sort of chunks with fixed sizes runs in parallel, so that the result does not
/// depend on the number of threads.
pub struct Buckets {
    chunks: Vec<Chunk>,
}

struct Chunk {
    /// First tet and end of each run, sorted by tile.
    runs: Vec<[u32; 2]>,
    /// The first run of each tile, and the end.
    offsets: Vec<u32>,
}

impl Buckets {
    /// Sorts the tets `0..count`. `tiles_of` gives the tiles that a tet touches; none for a tet
    /// that is left out.
    pub fn new(count: usize, tiling: &Tiling, tiles_of: impl Fn(usize) -> Option<TileBox> + Sync) -> Self {
        let tiles = tiling.len();
        let chunks = (0..count.div_ceil(CHUNK)).into_par_iter().filter_map(|chunk| {
            let mut found: Vec<(TileBox, [u32; 2])> = Vec::new();
            for tet in chunk * CHUNK..count.min((chunk + 1) * CHUNK) {
                let Some(touched) = tiles_of(tet) else { continue };
                match found.last_mut() {
                    Some((tiles, run)) if *tiles == touched && run[1] as usize == tet => run[1] += 1,
                    _ => found.push((touched, [tet as u32, tet as u32 + 1])),
                }
            }
            let mut offsets = vec![0_u32; tiles + 1];
            for (touched, _) in &found {
                tiling.each(touched, |tile| offsets[tile + 1] += 1);
            }
            for tile in 0..tiles {
                offsets[tile + 1] += offsets[tile];
            }
            if offsets[tiles] == 0 {
                return None;
            }
            let mut next = offsets.clone();
            let mut runs = vec![[0; 2]; offsets[tiles] as usize];
            for (touched, run) in &found {
                tiling.each(touched, |tile| {
                    runs[next[tile] as usize] = *run;
                    next[tile] += 1;
                });
            }
            Some(Chunk { runs, offsets })
        });
        Self { chunks: chunks.collect() }
    }

    /// Whether a tile has tets.
    pub fn any(&self, tile: usize) -> bool {
        self.chunks.iter().any(|chunk| chunk.offsets[tile] < chunk.offsets[tile + 1])
    }

    /// The tets of a tile in ascending order, as runs.
    pub fn tile(&self, tile: usize) -> impl Iterator<Item = Range<u32>> + '_ {
        self.chunks.iter().flat_map(move |chunk| {
            let runs = chunk.offsets[tile] as usize..chunk.offsets[tile + 1] as usize;
            chunk.runs[runs].iter().map(|&[first, end]| first..end)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tiling::{TILE, TilesNear};

    #[test]
    fn every_tile_lists_its_tets_in_ascending_order() {
        let count = CHUNK + 1000;
        let tiling = Tiling::new([TILE[0], TILE[1], 7 * TILE[2]]);
        let range = |tet: usize| (tet * 7 % 5)..(tet * 7 % 5 + tet % 3);
        let buckets = Buckets::new(count, &tiling, |tet| {
            let slices = range(tet);
            if slices.is_empty() {
                return None;
            }
            let [low, high] = [slices.start, slices.end - 1].map(|tile| (TILE[2] * tile) as f64 + 7.0);
            let corners = [[1.0, 1.0, low], [2.0, 2.0, high]].map(|corner| tiling.near(corner, 0.0));
            Some(TilesNear::around([0, 0, 1, 1].map(|n| corners[n])))
        });
        for tile in 0..7 {
            let expected: Vec<u32> =
                (0..count).filter(|&tet| range(tet).contains(&tile)).map(|tet| tet as u32).collect();
            assert!(buckets.tile(tile).flatten().eq(expected), "tile {tile}");
        }
    }
}
