//! Which tets moved, and which of them left the tiles that they touch at rest.

use rayon::prelude::*;

use crate::buckets::Buckets;
use crate::tiling::{TilesNear, Tiling};
use crate::warp::Warp;

/// Bit of a vertex or tet that moved by any amount.
const MOVED: u8 = 1;
/// Bit of one that may touch a tile that it does not touch at rest.
const STRAY: u8 = 2;

/// The motion of a mesh over the tiles of a grid.
///
/// Most tets that moved still touch only tiles that they touch at rest. The lists of tets at rest
/// serve for them, so that only the others are sorted into tiles.
pub struct Motion {
    /// For each tet whether a corner has moved by any amount.
    pub is_moved: Vec<bool>,
    /// All tiles of the moved tets that may touch a tile that they do not touch at rest.
    pub strays: Buckets,
}

impl Motion {
    /// Finds the motion of a warp. `near` gives the tiles around a vertex at rest and deformed.
    pub fn new(
        warp: &Warp<'_>,
        tiling: &Tiling,
        near: impl Fn(usize) -> (TilesNear, TilesNear) + Sync,
    ) -> Self {
        let pairs = warp.rest.par_iter().zip(warp.deformed).enumerate();
        let vertices: Vec<u8> = pairs
            .map(|(vertex, (rest, deformed))| {
                if rest == deformed {
                    return 0;
                }
                let (rest, deformed) = near(vertex);
                if deformed.is_within(&rest) { MOVED } else { MOVED | STRAY }
            })
            .collect();
        let tets: Vec<u8> = warp
            .tets
            .par_iter()
            .map(|tet| tet.iter().fold(0, |bits, &corner| bits | vertices[corner as usize]))
            .collect();
        let strays = Buckets::new(warp.tets.len(), tiling, |tet| {
            let is_stray = tets[tet] & STRAY != 0;
            is_stray.then(|| TilesNear::around(warp.tets[tet].map(|corner| near(corner as usize).1)))
        });
        Self { is_moved: tets.into_par_iter().map(|bits| bits & MOVED != 0).collect(), strays }
    }
}
