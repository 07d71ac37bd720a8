//! Samples of the input at many positions.

use std::ops::Range;

use crate::lanes::{floor, integer};
use crate::sample::{Sampler, nearest, trilinear};
use crate::tiling::TILE;

/// Samples that are taken at once. Their numbers fit the first cache of a processor.
const BLOCK: usize = 128;

/// Voxels that are added or located at once.
const LANES: usize = 8;

/// Most voxels at a time: those of a tile, because each has one owner.
const MOST: usize = TILE[0] * TILE[1] * TILE[2];

/// Voxels of a tile, and their places at rest.
///
/// All arrays are longer than needed by [`LANES`], so that loops may run beyond the last voxel.
pub struct Samples {
    count: usize,
    /// Place of each voxel in the values of the tile.
    places: Vec<u32>,
    /// Continuous voxel index at rest, by axis.
    rest: [Vec<f64>; 3],
}

impl Samples {
    pub fn new() -> Self {
        let length = MOST + LANES;
        Self { count: 0, places: vec![0; length], rest: [0; 3].map(|_| vec![0.0; length]) }
    }

    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Adds the voxels of a row of the tile whose bits are set.
    #[inline(always)]
    pub fn add(&mut self, row: usize, mut bits: u64) {
        let start = (row * TILE[0]) as u32;
        // A tet is convex, so the bits are in one run, unless another tet owns some of them.
        while bits != 0 {
            let first = bits.trailing_zeros();
            let run = (bits >> first).trailing_ones().min(LANES as u32);
            let next = &mut self.places[self.count..][..LANES];
            for (n, place) in (0..).zip(next) {
                *place = start + first + n;
            }
            self.count += run as usize;
            bits &= (u64::MAX << (run - 1)) << first << 1;
        }
    }

    /// Computes the places at rest of the voxels from number `first` on, by the map of their tet.
    #[inline(always)]
    pub fn locate(
        &mut self,
        (linear, offset): &([[f64; 3]; 3], [f64; 3]),
        first: usize,
        region: &[Range<usize>; 3],
    ) {
        let start = [region[0].start as u32, region[1].start as u32, region[2].start as u32];
        for n in (first..self.count).step_by(LANES) {
            let places = &self.places[n..][..LANES];
            let mut at = [[0.0; LANES]; 3];
            for n in 0..LANES {
                let (column, row) = (places[n] % TILE[0] as u32, places[n] / TILE[0] as u32);
                at[0][n] = f64::from(start[0] + column);
                at[1][n] = f64::from(start[1] + row % TILE[1] as u32);
                at[2][n] = f64::from(start[2] + row / TILE[1] as u32);
            }
            for axis in 0..3 {
                let [by_x, by_y, by_z] = linear[axis];
                let rest = &mut self.rest[axis][n..][..LANES];
                for n in 0..LANES {
                    rest[n] = ((by_x * at[0][n] + by_y * at[1][n]) + by_z * at[2][n]) + offset[axis];
                }
            }
        }
    }

    /// Writes the values that [`trilinear`] has at all places.
    #[inline(always)]
    pub fn write(&self, sampler: &Sampler<'_>, values: &mut [i16]) {
        let mut first = 0;
        while first < self.count {
            let end = self.count.min(first + BLOCK);
            let [x, y, z] = [0, 1, 2].map(|axis| &self.rest[axis][first..end]);
            write_block(sampler, [x, y, z], &self.places[first..end], values);
            first = end;
        }
    }
}

/// Writes the values of at most [`BLOCK`] samples.
#[inline(always)]
fn write_block(sampler: &Sampler<'_>, rest: [&[f64]; 3], places: &[u32], values: &mut [i16]) {
    let [columns, rows, _] = sampler.shape;
    let strides = [1, columns as u64, (columns * rows) as u64];
    let count = places.len();
    let mut fractions = [[0.0; BLOCK]; 3];
    let (mut bases, mut at_end) = ([0_u64; BLOCK], 0);
    for axis in 0..3 {
        let (rest, fractions, bases) =
            (&rest[axis][..count], &mut fractions[axis][..count], &mut bases[..count]);
        let last = (sampler.shape[axis] - 1) as f64;
        let stride = strides[axis];
        for n in 0..count {
            let at = rest[n];
            let at = if at < 0.0 { 0.0 } else { at };
            let at = if at > last { last } else { at };
            let low = floor(at);
            fractions[n] = at - low;
            bases[n] = bases[n].wrapping_add(integer(low).wrapping_mul(stride));
            at_end |= u64::from(low >= last);
        }
    }
    // The voxels at and next to each position along the first axis, in four rows. All slices have
    // the same length, so that one comparison serves for all of them.
    let (row, slice) = (columns, columns * rows);
    let length = sampler.voxels.len().saturating_sub(slice + row + 1);
    let mut pairs = [[0_u32; BLOCK]; 4];
    let mut padding = 0;
    if at_end == 0 && length > 0 {
        let starts = [0, row, slice, slice + row];
        let rows = starts.map(|start| &sampler.voxels[start..][..length + 1]);
        for n in 0..count {
            let base = bases[n] as usize;
            if base >= length {
                at_end = 1;
                break;
            }
            for of in 0..4 {
                let pair = &rows[of][base..base + 2];
                pairs[of][n] = u32::from(pair[0] as u16) | u32::from(pair[1] as u16) << 16;
            }
        }
        if sampler.has_padding {
            let [lowest, highest] = sampler.scanned.map(i32::from);
            for pairs in &pairs {
                for &pair in &pairs[..count] {
                    let [a, b] = halves(pair);
                    padding |= (a - lowest) | (b - lowest) | (highest - a) | (highest - b);
                }
            }
        }
    }
    if at_end != 0 || length == 0 || padding < 0 {
        for (n, &place) in places.iter().enumerate() {
            let rest = [0, 1, 2].map(|axis| rest[axis][n]);
            values[place as usize] = trilinear(sampler.voxels, sampler.shape, sampler.scanned, rest);
        }
        return;
    }
    let mut found = [0_i16; BLOCK];
    let found = &mut found[..count];
    let [fx, fy, fz] = [0, 1, 2].map(|axis| &fractions[axis][..count]);
    let [a, b, c, d] = [0, 1, 2, 3].map(|of| &pairs[of][..count]);
    for n in 0..count {
        let along_x = |pair: u32| {
            let [a, b] = halves(pair).map(f64::from);
            a + fx[n] * (b - a)
        };
        let (a, b, c, d) = (along_x(a[n]), along_x(b[n]), along_x(c[n]), along_x(d[n]));
        let (a, b) = (a + fy[n] * (b - a), c + fy[n] * (d - c));
        found[n] = nearest(a + fz[n] * (b - a));
    }
    for (&place, &value) in places.iter().zip(&*found) {
        values[place as usize] = value;
    }
}

/// The two stored values of a pair.
#[inline(always)]
fn halves(pair: u32) -> [i32; 2] {
    [(pair << 16) as i32 >> 16, pair as i32 >> 16]
}
