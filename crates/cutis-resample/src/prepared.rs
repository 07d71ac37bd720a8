//! Tets that are prepared once each, for many lookups.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::raster::{Corners, GROUP, Rasters, RestMaps, TetRaster};

/// Distinct tets, with their barycentric coordinates and the maps to their rest shapes.
pub struct Prepared {
    /// Numbers of the tets, in ascending order.
    tets: Vec<u32>,
    groups: Vec<(Rasters, RestMaps)>,
}

impl Prepared {
    /// Prepares tets that may occur several times. `corners` gives the corners of a tet in
    /// continuous voxel indices: where it is looked up, and at rest.
    pub fn new(
        mut tets: Vec<u32>,
        tolerance: f64,
        corners: &(dyn Fn(u32) -> [[Point3<f64>; 4]; 2] + Sync),
    ) -> Self {
        tets.par_sort_unstable();
        tets.dedup();
        let prepare = |tets: &[u32]| {
            let empty: Corners = [[[0.0; GROUP]; 3]; 4];
            let mut places = [empty; 2];
            for (lane, &tet) in tets.iter().enumerate() {
                for (places, corners) in places.iter_mut().zip(corners(tet)) {
                    for (place, corner) in places.iter_mut().zip(corners) {
                        (0..3).for_each(|axis| place[axis][lane] = corner[axis]);
                    }
                }
            }
            let rasters = Rasters::new(&places[0], tolerance);
            let maps = RestMaps::new(&rasters, &places[1]);
            (rasters, maps)
        };
        let groups = tets.par_chunks(GROUP).map(prepare).collect();
        Self { tets, groups }
    }

    /// The numbers of the tets, in ascending order.
    pub fn numbers(&self) -> &[u32] {
        &self.tets
    }

    /// The place of a tet in the list, or where it would be.
    pub fn slot(&self, tet: u32) -> usize {
        self.tets.partition_point(|&other| other < tet)
    }

    /// The tet at a place in the list. `None` if it has no volume.
    #[inline(always)]
    pub fn raster(&self, slot: usize) -> Option<TetRaster<'_>> {
        self.groups[slot / GROUP].0.tet(slot % GROUP)
    }

    /// The rest index of an index in the tet at a place in the list.
    #[inline(always)]
    pub fn at_rest(&self, slot: usize, index: [f64; 3]) -> [f64; 3] {
        self.groups[slot / GROUP].1.at(slot % GROUP, index)
    }
}
