//! The boxes of voxels around the tets of a group.

use std::ops::Range;

use crate::lanes::{ceil, floor, integer, less, more};
use crate::raster::{GROUP, Rasters};

/// The columns, rows and slices of a region that come near each tet of a group, by axis.
pub struct Spans {
    /// The first voxel of each box.
    pub first: [[u32; GROUP]; 3],
    /// Number of voxels along each axis; 0 for an empty box.
    pub length: [[u32; GROUP]; 3],
}

impl Spans {
    /// A group without tets.
    pub fn empty() -> Self {
        Self { first: [[0; GROUP]; 3], length: [[0; GROUP]; 3] }
    }

    /// Finds the boxes within a region.
    #[inline(always)]
    pub fn fill(&mut self, rasters: &Rasters, region: &[Range<usize>; 3]) {
        for axis in 0..3 {
            let (start, last) = (region[axis].start as f64, region[axis].end as f64 - 1.0);
            for n in 0..GROUP {
                let low = more(rasters.low[axis][n], start);
                let high = less(rasters.high[axis][n], last);
                let (first, end) = (ceil(low), floor(high) + 1.0);
                let some = (low <= high) & (first < end);
                self.first[axis][n] = integer(if some { first } else { start }) as u32;
                self.length[axis][n] = integer(if some { end - first } else { 0.0 }) as u32;
            }
        }
    }

    /// The box of a tet, as first voxel and end along each axis. `None` if it is empty.
    #[inline(always)]
    pub fn of(&self, lane: usize) -> Option<[(usize, usize); 3]> {
        let mut spans = [(0, 0); 3];
        for axis in 0..3 {
            let length = self.length[axis][lane] as usize;
            if length == 0 {
                return None;
            }
            let first = self.first[axis][lane] as usize;
            spans[axis] = (first, first + length);
        }
        Some(spans)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_keep_both_ends_and_stay_within() {
        let covered = |low: f64, high: f64, within: Range<usize>| {
            // A tet with this extent along each axis.
            let at = |x: f64| [[x; GROUP]; 3];
            let mut corners = [at(low), at(low), at(low), at(high)];
            corners[1][0] = [high; GROUP];
            corners[2][1] = [high; GROUP];
            let mut spans = Spans::empty();
            spans.fill(&Rasters::new(&corners, 0.0), &[within.clone(), within.clone(), within]);
            spans.of(GROUP - 1).map(|[(first, end), ..]| first..end)
        };
        assert_eq!(covered(1.0, 3.0, 0..10), Some(1..4));
        assert_eq!(covered(1.1, 2.9, 0..10), Some(2..3));
        assert_eq!(covered(-7.0, 99.0, 2..5), Some(2..5));
        for (low, high) in [(3.2, 3.8), (12.0, 14.0), (-3.0, -1.0)] {
            assert_eq!(covered(low, high, 0..10), None);
        }
    }
}
