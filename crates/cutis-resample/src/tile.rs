//! Resampling of one tile of the output.

use std::ops::Range;

use nalgebra::Point3;

use crate::lanes::{floor, integer, less, more};
use crate::raster::{Corners, GROUP, Rasters, TetRaster};
use crate::report::ResampleReport;
use crate::rows::{HeldColumns, ROWS, Rows};
use crate::sample::{Sampler, trilinear};
use crate::samples::Samples;
use crate::tiling::TILE;
use crate::warp::Warp;

/// The input of all tiles.
pub struct Source<'a> {
    pub sampler: Sampler<'a>,
    /// Stored value of a vacated voxel.
    pub air: i16,
    pub warp: &'a Warp<'a>,
    /// For each tet whether a corner has moved.
    pub moved: &'a [bool],
    /// Continuous voxel indices of the vertices at rest.
    pub rest: &'a [Point3<f64>],
    /// Continuous voxel indices of the deformed vertices.
    pub deformed: &'a [Point3<f64>],
    /// Length in voxels below which two positions cannot be distinguished.
    pub tolerance: f64,
}

/// One bit per column for each row of a tile, and the values of the tile.
///
/// It is used for one tile after another, so that its memory stays in a cache.
pub struct Tile {
    region: [Range<usize>; 3],
    /// Voxels that a tet holds.
    inside: Vec<u64>,
    /// Voxels that a tet comes near. Bits that are also in `inside` have no meaning.
    near: Vec<u64>,
    /// Covered voxels whose tet moved.
    moved: Vec<u64>,
    /// Voxels that a tet covers at rest and no deformed tet covers.
    vacated: Vec<u64>,
    /// Voxels that one body tet holds strictly.
    once: Vec<u64>,
    /// Voxels that two or more body tets hold strictly.
    twice: Vec<u64>,
    values: Vec<i16>,
    /// The rows of the present tet.
    rows: Rows,
    /// The voxels that the present tets hold.
    samples: Samples,
}

/// Rows of a tile.
const TILE_ROWS: usize = TILE[1] * TILE[2];

impl Tile {
    pub fn new() -> Self {
        let bits = || vec![0; TILE_ROWS];
        Self {
            region: [0..0, 0..0, 0..0],
            inside: bits(),
            near: bits(),
            moved: bits(),
            vacated: bits(),
            once: bits(),
            twice: bits(),
            values: vec![0; TILE_ROWS * TILE[0]],
            rows: Rows::new(),
            samples: Samples::new(),
        }
    }

    /// Starts a tile with the values of the input.
    pub fn start(&mut self, source: &Source<'_>, region: [Range<usize>; 3]) {
        for bits in [
            &mut self.inside,
            &mut self.near,
            &mut self.moved,
            &mut self.vacated,
            &mut self.once,
            &mut self.twice,
        ] {
            bits.fill(0);
        }
        self.region = region;
        let [columns, rows, slices] = self.region.clone();
        for k in slices {
            for j in rows.clone() {
                let from = self.input_row(source, j, k);
                let to = self.row(j, k) * TILE[0];
                self.values[to..to + columns.len()]
                    .copy_from_slice(&source.sampler.voxels[from..from + columns.len()]);
            }
        }
    }

    /// Place of the first voxel of a row of the tile in the input.
    #[inline(always)]
    fn input_row(&self, source: &Source<'_>, j: usize, k: usize) -> usize {
        let [columns, rows, _] = source.sampler.shape;
        (k * rows + j) * columns + self.region[0].start
    }

    /// Number of a row of the tile.
    #[inline(always)]
    fn row(&self, j: usize, k: usize) -> usize {
        (k - self.region[2].start) * TILE[1] + (j - self.region[1].start)
    }

    /// Sets the voxels that deformed tets own. Tets must come in ascending order.
    #[inline(always)]
    pub fn deform(&mut self, source: &Source<'_>, tets: &[u32]) {
        for group in tets.chunks(GROUP) {
            let mut vertices = [[0; 4]; GROUP];
            let mut any_moved = false;
            for (vertices, &tet) in vertices.iter_mut().zip(group) {
                *vertices = source.warp.tets[tet as usize];
                any_moved |= source.moved[tet as usize];
            }
            let rasters = Rasters::new(&corners(source.deformed, &vertices), source.tolerance);
            if !any_moved {
                for (n, &tet) in group.iter().enumerate() {
                    self.claim(source, &rasters, n, tet, None);
                }
                continue;
            }
            let rest = corners(source.rest, &vertices);
            let maps = rasters.rest_maps(&rest);
            self.samples.clear();
            for (n, &tet) in group.iter().enumerate() {
                let first = self.samples.len();
                let rest = source.moved[tet as usize].then_some(&rest);
                self.claim(source, &rasters, n, tet, rest);
                self.samples.locate(&maps.map(n), first, &self.region);
            }
            self.samples.write(&source.sampler, &mut self.values);
        }
    }

    /// Marks the voxels that a tet owns, and lists those that it holds if it moved from `rest`.
    #[inline(always)]
    fn claim(
        &mut self,
        source: &Source<'_>,
        rasters: &Rasters,
        lane: usize,
        tet: u32,
        rest: Option<&Corners>,
    ) {
        let Some(raster) = rasters.tet(lane) else { return };
        let in_body = (tet as usize) < source.warp.body_tets;
        let [columns, rows, slices] = raster.spans(&self.region);
        if columns.0 >= columns.1 || slices.0 >= slices.1 {
            return;
        }
        let start = self.region[0].start;
        for j in (rows.0..rows.1).step_by(ROWS) {
            raster.rows(j, slices, columns, start, &mut self.rows);
            for k in slices.0..slices.1 {
                for n in 0..ROWS.min(rows.1 - j) {
                    let near = self.rows.near[ROWS * (k - slices.0) + n];
                    if near == 0 {
                        continue;
                    }
                    let row = self.row(j + n, k);
                    let mut held = HeldColumns { near, inside: near, strict: near };
                    if self.rows.is_close {
                        held = raster.levels([j + n, k], columns, start);
                        // A tet that holds a center wins over one that only comes near it. Of
                        // several, the first one wins.
                        let own = held.near & !(held.inside | self.inside[row] | self.near[row]);
                        self.near[row] |= own;
                        if let Some(rest) = rest
                            && own != 0
                        {
                            self.moved[row] |= own;
                            self.sample_near(source, raster, rest, row, own);
                        }
                    }
                    if in_body {
                        self.twice[row] |= self.once[row] & held.strict;
                        self.once[row] |= held.strict;
                    }
                    let own = held.inside & !self.inside[row];
                    self.inside[row] |= own;
                    if rest.is_some() {
                        self.moved[row] |= own;
                        self.samples.add(row, own);
                    } else if self.moved[row] & own != 0 {
                        self.restore(source, row, self.moved[row] & own);
                    }
                }
            }
        }
    }

    /// Gives some voxels of a row the values of the input, because their owner has not moved.
    #[cold]
    #[inline(never)]
    fn restore(&mut self, source: &Source<'_>, row: usize, voxels: u64) {
        self.moved[row] &= !voxels;
        for column in columns_of(voxels) {
            let [i, j, k] = self.voxel(row * TILE[0] + column);
            let [columns, rows, _] = source.sampler.shape;
            self.values[row * TILE[0] + column] = source.sampler.voxels[i + columns * (j + rows * k)];
        }
    }

    /// Samples the input for voxels of a row that lie just outside a tet.
    #[cold]
    #[inline(never)]
    fn sample_near(
        &mut self,
        source: &Source<'_>,
        raster: TetRaster<'_>,
        rest: &Corners,
        row: usize,
        voxels: u64,
    ) {
        let Sampler { voxels: input, shape, scanned, .. } = source.sampler;
        for column in columns_of(voxels) {
            let center = self.voxel(row * TILE[0] + column).map(|index| index as f64);
            let place = raster.nearest(center, rest);
            self.values[row * TILE[0] + column] = trilinear(input, shape, scanned, place);
        }
    }

    /// Column, row and slice of a voxel of the tile.
    fn voxel(&self, at: usize) -> [usize; 3] {
        let [columns, rows, slices] = &self.region;
        let (column, row) = (at % TILE[0], at / TILE[0]);
        [columns.start + column, rows.start + row % TILE[1], slices.start + row / TILE[1]]
    }

    /// Whether a deformed tet covers every voxel of the tile.
    pub fn is_covered(&self) -> bool {
        let covered: usize = self.covered().map(|bits| bits.count_ones() as usize).sum();
        covered == self.region.iter().map(ExactSizeIterator::len).product()
    }

    fn covered(&self) -> impl Iterator<Item = u64> {
        self.inside.iter().zip(&self.near).map(|(inside, near)| inside | near)
    }

    /// Sets the voxels to air that tets cover at rest and no deformed tet covers. Call it after
    /// [`Tile::deform`].
    #[inline(always)]
    pub fn vacate(&mut self, source: &Source<'_>, tets: &[[u32; 4]]) {
        for group in tets.chunks(GROUP) {
            let mut vertices = [[0; 4]; GROUP];
            vertices[..group.len()].copy_from_slice(group);
            let rasters = Rasters::new(&corners(source.rest, &vertices), source.tolerance);
            for n in 0..group.len() {
                if let Some(raster) = rasters.tet(n) {
                    self.leave(source, raster);
                }
            }
        }
    }

    #[inline(always)]
    fn leave(&mut self, source: &Source<'_>, raster: TetRaster<'_>) {
        let [columns, rows, slices] = raster.spans(&self.region);
        if columns.0 >= columns.1 || slices.0 >= slices.1 {
            return;
        }
        for j in (rows.0..rows.1).step_by(ROWS) {
            raster.rows(j, slices, columns, self.region[0].start, &mut self.rows);
            for k in slices.0..slices.1 {
                for n in 0..ROWS.min(rows.1 - j) {
                    let row = self.row(j + n, k);
                    let left = self.rows.near[ROWS * (k - slices.0) + n]
                        & !(self.inside[row] | self.near[row] | self.vacated[row]);
                    self.vacated[row] |= left;
                    for column in columns_of(left) {
                        self.values[row * TILE[0] + column] = source.air;
                    }
                }
            }
        }
    }

    /// Whether the box around a tet at rest has voxels that no deformed tet covers.
    #[inline(always)]
    pub fn may_leave(&self, source: &Source<'_>, vertices: [u32; 4]) -> bool {
        let mut spans = [(0, 0); 3];
        let places = vertices.map(|v| &source.rest[v as usize]);
        for axis in 0..3 {
            let [a, b, c, d] = places.map(|place| place[axis]);
            let region = &self.region[axis];
            let low = more(less(less(a, b), less(c, d)) - source.tolerance, region.start as f64);
            let high = less(more(more(a, b), more(c, d)) + source.tolerance, region.end as f64 - 1.0);
            if low > high {
                return false;
            }
            spans[axis] = (integer(floor(low)) as usize, integer(floor(high)) as usize + 1);
        }
        let [columns, rows, slices] = spans;
        let bits = (u64::MAX >> (64 - (columns.1 - columns.0))) << (columns.0 - self.region[0].start);
        let mut open = 0;
        for k in slices.0..slices.1 {
            for j in rows.0..rows.1 {
                let row = self.row(j, k);
                open |= bits & !(self.inside[row] | self.near[row]);
            }
        }
        open != 0
    }

    /// The counts of this tile.
    pub fn report(&self) -> ResampleReport {
        let count = |bits: &[u64]| bits.iter().map(|bits| bits.count_ones() as usize).sum();
        ResampleReport {
            covered_voxels: self.covered().map(|bits| bits.count_ones() as usize).sum(),
            moved_voxels: count(&self.moved),
            vacated_voxels: count(&self.vacated),
            folds: count(&self.twice),
            inverted_tets: 0,
        }
    }

    /// Copies the values into the rows of the output. `slices` are the slices of the tile, each
    /// with all rows of the tile and all columns of the output.
    pub fn finish(&self, width: usize, slices: &mut [&mut [i16]]) {
        let [columns, rows, _] = &self.region;
        for (k, slice) in slices.iter_mut().enumerate() {
            for j in 0..rows.len() {
                let from = (k * TILE[1] + j) * TILE[0];
                slice[j * width..][columns.clone()].copy_from_slice(&self.values[from..from + columns.len()]);
            }
        }
    }
}

/// The places of the corners of a group of tets.
#[inline(always)]
fn corners(places: &[Point3<f64>], tets: &[[u32; 4]; GROUP]) -> Corners {
    let mut corners = [[[0.0; GROUP]; 3]; 4];
    for (n, tet) in tets.iter().enumerate() {
        for corner in 0..4 {
            let place = &places[tet[corner] as usize];
            for axis in 0..3 {
                corners[corner][axis][n] = place[axis];
            }
        }
    }
    corners
}

/// The columns of the bits that are set.
#[inline(always)]
fn columns_of(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let column = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        column
    })
}
