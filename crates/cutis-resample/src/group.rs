//! A group of tets over a tile, with all that follows from their corners. Its memory is used for
//! one group after another.

use std::ops::Range;

use nalgebra::Point3;

use crate::clear_rows::ClearFaces;
use crate::raster::{Corners, GROUP, Rasters, RestMaps};
use crate::spans::Spans;

/// A group of tets over a tile.
pub struct Group {
    /// Corners where the tets are rasterized.
    corners: Corners,
    /// Corners at rest.
    pub rest: Corners,
    pub rasters: Rasters,
    pub spans: Spans,
    pub faces: ClearFaces,
    /// Maps from rasterized to rest indices.
    pub maps: RestMaps,
}

impl Group {
    pub fn new() -> Self {
        let corners = [[[0.0; GROUP]; 3]; 4];
        Self {
            corners,
            rest: corners,
            rasters: Rasters::empty(),
            spans: Spans::empty(),
            faces: ClearFaces::empty(),
            maps: RestMaps::empty(),
        }
    }

    /// Rasterizes the tets with these vertices at these places.
    #[inline(always)]
    pub fn rasterize(
        &mut self,
        places: &[Point3<f64>],
        tets: &[[u32; 4]; GROUP],
        region: &[Range<usize>; 3],
        tolerance: f64,
    ) {
        gather(places, tets, &mut self.corners);
        self.rasters.fill(&self.corners, tolerance);
        self.spans.fill(&self.rasters, region);
        self.faces.fill(&self.rasters, &self.spans, tolerance);
    }

    /// Finds only the boxes of the tets with these vertices at these places.
    #[inline(always)]
    pub fn surround(
        &mut self,
        places: &[Point3<f64>],
        tets: &[[u32; 4]; GROUP],
        region: &[Range<usize>; 3],
        tolerance: f64,
    ) {
        gather(places, tets, &mut self.corners);
        self.rasters.surround(&self.corners, tolerance);
        self.spans.fill(&self.rasters, region);
    }

    /// Finds the maps of the tets to these places at rest.
    #[inline(always)]
    pub fn map_to(&mut self, rest: &[Point3<f64>], tets: &[[u32; 4]; GROUP]) {
        gather(rest, tets, &mut self.rest);
        self.maps.fill(&self.rasters, &self.rest);
    }
}

/// Gathers the places of the corners of a group of tets.
#[inline(always)]
fn gather(places: &[Point3<f64>], tets: &[[u32; 4]; GROUP], corners: &mut Corners) {
    for (n, tet) in tets.iter().enumerate() {
        for corner in 0..4 {
            let place = &places[tet[corner] as usize];
            for axis in 0..3 {
                corners[corner][axis][n] = place[axis];
            }
        }
    }
}
