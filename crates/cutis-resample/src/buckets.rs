//! Lists of the tets that touch each tile.

use rayon::prelude::*;

use crate::tiling::{TileBox, Tiling};

/// Number of tets in a chunk that is sorted independently.
const CHUNK: usize = 1 << 16;

/// The number of no tile.
const NONE: u32 = u32::MAX;

/// For each tile the tets that touch it, in ascending order. A counting sort of chunks with fixed
/// sizes runs in parallel, so that the result does not depend on the number of threads.
pub struct Buckets {
    chunks: Vec<Chunk>,
}

struct Chunk {
    order: Vec<u32>,
    offsets: Vec<u32>,
}

impl Buckets {
    /// Sorts the tets `0..count`. `tiles_of` gives the tiles that a tet touches; none for a tet
    /// that is left out.
    pub fn new(count: usize, tiling: &Tiling, tiles_of: impl Fn(usize) -> Option<TileBox> + Sync) -> Self {
        let tiles = tiling.len();
        let chunks = (0..count.div_ceil(CHUNK)).into_par_iter().filter_map(|chunk| {
            let tets = chunk * CHUNK..count.min((chunk + 1) * CHUNK);
            let mut offsets = vec![0_u32; tiles + 1];
            // Most tets touch one tile, which the second pass need not find again.
            let mut only = vec![NONE; tets.len()];
            let mut several = Vec::new();
            for (only, tet) in only.iter_mut().zip(tets.clone()) {
                let Some(touched) = tiles_of(tet) else { continue };
                if let Some(tile) = tiling.only(&touched) {
                    *only = tile as u32;
                    offsets[tile + 1] += 1;
                } else {
                    tiling.each(&touched, |tile| offsets[tile + 1] += 1);
                    several.push((tet, touched));
                }
            }
            for tile in 0..tiles {
                offsets[tile + 1] += offsets[tile];
            }
            if offsets[tiles] == 0 {
                return None;
            }
            let mut next = offsets.clone();
            let mut order = vec![0; offsets[tiles] as usize];
            let mut several = several.into_iter().peekable();
            for (&only, tet) in only.iter().zip(tets) {
                let mut put = |tile: usize| {
                    let slot = &mut next[tile];
                    order[*slot as usize] = tet as u32;
                    *slot += 1;
                };
                if only != NONE {
                    put(only as usize);
                } else if let Some((_, touched)) = several.next_if(|(of, _)| *of == tet) {
                    tiling.each(&touched, put);
                }
            }
            Some(Chunk { order, offsets })
        });
        Self { chunks: chunks.collect() }
    }

    /// Whether a tile has tets.
    pub fn any(&self, tile: usize) -> bool {
        self.chunks.iter().any(|chunk| chunk.offsets[tile] < chunk.offsets[tile + 1])
    }

    /// The tets of a tile in ascending order.
    pub fn tile(&self, tile: usize) -> impl Iterator<Item = u32> + '_ {
        self.chunks.iter().flat_map(move |chunk| {
            let range = chunk.offsets[tile] as usize..chunk.offsets[tile + 1] as usize;
            chunk.order[range].iter().copied()
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
            Some(TilesNear::around(&corners, &[0, 0, 1, 1]))
        });
        for tile in 0..7 {
            let expected: Vec<u32> =
                (0..count).filter(|&tet| range(tet).contains(&tile)).map(|tet| tet as u32).collect();
            assert!(buckets.tile(tile).eq(expected), "tile {tile}");
        }
    }
}
