//! Tets that are prepared once each, for many lookups.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::raster::{Corners, GROUP, Rasters, RestMaps, TetRaster};

/// Distinct tets, with their barycentric coordinates.
pub struct Prepared {
    /// Numbers of the tets, in ascending order.
    tets: Vec<u32>,
    groups: Vec<Rasters>,
}

/// The corners of a tet, in continuous voxel indices.
pub type CornersOf<'a> = &'a (dyn Fn(u32) -> [Point3<f64>; 4] + Sync);

impl Prepared {
    /// Prepares tets in ascending order, with their corners where they are looked up.
    pub fn new(tets: Vec<u32>, tolerance: f64, corners: CornersOf<'_>) -> Self {
        let raster = |tets: &[u32]| Rasters::new(&gather(tets, corners), tolerance);
        let groups = tets.par_chunks(GROUP).map(raster).collect();
        Self { tets, groups }
    }

    /// The maps to the rest shapes, a group after the other. `corners` are those at rest.
    pub fn rest_maps(&self, corners: CornersOf<'_>) -> Vec<RestMaps> {
        let groups = self.tets.par_chunks(GROUP).zip(&self.groups);
        groups.map(|(tets, rasters)| RestMaps::new(rasters, &gather(tets, corners))).collect()
    }

    /// The numbers of the tets, in ascending order.
    pub fn numbers(&self) -> &[u32] {
        &self.tets
    }

    /// The tet at a place in the list. `None` if it has no volume.
    #[inline(always)]
    pub fn raster(&self, slot: usize) -> Option<TetRaster<'_>> {
        self.groups[slot / GROUP].tet(slot % GROUP)
    }
}

/// The corners of a group of tets.
fn gather(tets: &[u32], corners: CornersOf<'_>) -> Corners {
    let mut places: Corners = [[[0.0; GROUP]; 3]; 4];
    for (lane, &tet) in tets.iter().enumerate() {
        for (place, corner) in places.iter_mut().zip(corners(tet)) {
            (0..3).for_each(|axis| place[axis][lane] = corner[axis]);
        }
    }
    places
}
