//! Resampling of one tile of the output.

use std::ops::Range;

use nalgebra::Point3;

use crate::clear_rows::ClearRows;
use crate::group::Group;
use crate::raster::{Corners, GROUP, TetRaster};
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

impl Source<'_> {
    /// Copies the input into the rows of a tile of the output, which are as for [`Tile::finish`].
    pub fn copy(&self, [columns, rows, slices]: &[Range<usize>; 3], output: &mut [&mut [i16]]) {
        let [width, height, _] = self.sampler.shape;
        for (k, slice) in slices.clone().zip(output) {
            for (j, row) in rows.clone().zip(slice.chunks_exact_mut(width)) {
                let from = (k * height + j) * width;
                row[columns.clone()].copy_from_slice(&self.sampler.voxels[from..][columns.clone()]);
            }
        }
    }
}

/// One bit per column of a row of a tile.
#[derive(Clone, Copy, Default)]
struct Line {
    /// Voxels that a tet holds.
    inside: u64,
    /// Covered voxels whose tet moved.
    moved: u64,
    /// Voxels that one body tet holds strictly.
    once: u64,
    /// Voxels that two or more body tets hold strictly.
    twice: u64,
    /// Voxels that a body tet that moved holds strictly.
    by_moved: u64,
}

/// The same for what is rare.
#[derive(Clone, Copy, Default)]
struct Margin {
    /// Voxels that a tet comes near. Bits that are also inside have no meaning.
    near: u64,
    /// Voxels that a tet covers at rest and no deformed tet covers.
    vacated: u64,
}

/// The rows of a tile, and its values.
///
/// It is used for one tile after another, so that its memory stays in a cache.
pub struct Tile {
    region: [Range<usize>; 3],
    lines: Vec<Line>,
    margins: Vec<Margin>,
    values: Vec<i16>,
    /// The rows of the present tet.
    clear: ClearRows,
    /// The same for a tet that is not small or has a center close to a face.
    rows: Rows,
    /// The voxels that the present tets hold.
    samples: Samples,
    /// For each slice one bit for each row with voxels that no deformed tet covers.
    open: [u32; TILE[2]],
}

/// Rows of a tile.
const TILE_ROWS: usize = TILE[1] * TILE[2];

impl Tile {
    pub fn new() -> Self {
        Self {
            region: [0..0, 0..0, 0..0],
            lines: vec![Line::default(); TILE_ROWS],
            margins: vec![Margin::default(); TILE_ROWS],
            values: vec![0; TILE_ROWS * TILE[0]],
            clear: ClearRows::new(),
            rows: Rows::new(),
            samples: Samples::new(),
            open: [0; TILE[2]],
        }
    }

    /// Starts a tile.
    pub fn start(&mut self, region: [Range<usize>; 3]) {
        self.lines.fill(Line::default());
        self.margins.fill(Margin::default());
        self.region = region;
    }

    /// Takes the values of the input.
    pub fn read(&mut self, source: &Source<'_>) {
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
    pub fn deform(&mut self, source: &Source<'_>, group: &mut Group, tets: &[u32]) {
        for tets in tets.chunks(GROUP) {
            let mut vertices = [[0; 4]; GROUP];
            let mut any_moved = false;
            for (vertices, &tet) in vertices.iter_mut().zip(tets) {
                *vertices = source.warp.tets[tet as usize];
                any_moved |= source.moved[tet as usize];
            }
            group.rasterize(source.deformed, &vertices, &self.region, source.tolerance);
            if !any_moved {
                for (n, &tet) in tets.iter().enumerate() {
                    self.claim(source, group, n, tet, false);
                }
                continue;
            }
            group.map_to(source.rest, &vertices);
            self.samples.clear();
            for (n, &tet) in tets.iter().enumerate() {
                let first = self.samples.len();
                self.claim(source, group, n, tet, source.moved[tet as usize]);
                self.samples.locate(&group.maps.map(n), first, &self.region);
            }
            self.samples.write(&source.sampler, &mut self.values);
        }
    }

    /// Marks the voxels that a tet owns, and lists those that it owns if it moved.
    #[inline(always)]
    fn claim(&mut self, source: &Source<'_>, group: &Group, lane: usize, tet: u32, moved: bool) {
        let Some(raster) = group.rasters.tet(lane) else { return };
        let Some([columns, rows, slices]) = group.spans.of(lane) else { return };
        let in_body = (tet as usize) < source.warp.body_tets;
        let start = self.region[0].start;
        let size = [columns.1 - columns.0, rows.1 - rows.0, slices.1 - slices.0];
        if group.faces.find(lane, size, &mut self.clear) {
            let (base, shift) = (self.row(rows.0, slices.0), columns.0 - start);
            while let Some((n, mask)) = self.clear.next(size[1]) {
                let row = base + n;
                let held = u64::from(mask) << shift;
                let held = HeldColumns { near: held, inside: held, strict: held };
                self.hold(source, row, held, in_body, moved);
            }
            return;
        }
        for j in (rows.0..rows.1).step_by(ROWS) {
            raster.rows(j, slices, columns, start, &mut self.rows);
            for k in slices.0..slices.1 {
                for n in 0..ROWS.min(rows.1 - j) {
                    let near = self.rows.near[ROWS * (k - slices.0) + n];
                    if near == 0 {
                        continue;
                    }
                    let row = self.row(j + n, k);
                    let (line, margin) = (&mut self.lines[row], &mut self.margins[row]);
                    let mut held = HeldColumns { near, inside: near, strict: near };
                    if self.rows.is_close {
                        held = raster.levels([j + n, k], columns, start);
                        // A tet that holds a center wins over one that only comes near it. Of
                        // several, the first one wins.
                        let own = held.near & !(held.inside | line.inside | margin.near);
                        margin.near |= own;
                        if moved && own != 0 {
                            line.moved |= own;
                            self.sample_near(source, raster, &group.rest, row, own);
                        }
                    }
                    self.hold(source, row, held, in_body, moved);
                }
            }
        }
    }

    /// Marks the voxels of a row that a tet holds, and lists those that it owns if it moved.
    #[inline(always)]
    fn hold(&mut self, source: &Source<'_>, row: usize, held: HeldColumns, in_body: bool, moved: bool) {
        let line = &mut self.lines[row];
        if in_body {
            line.twice |= line.once & held.strict;
            line.once |= held.strict;
            line.by_moved |= if moved { held.strict } else { 0 };
        }
        let own = held.inside & !line.inside;
        line.inside |= own;
        if moved {
            line.moved |= own;
            self.samples.add(row, own);
        } else if line.moved & own != 0 {
            let own = line.moved & own;
            self.restore(source, row, own);
        }
    }

    /// Gives some voxels of a row the values of the input, because their owner has not moved.
    #[cold]
    #[inline(never)]
    fn restore(&mut self, source: &Source<'_>, row: usize, voxels: u64) {
        self.lines[row].moved &= !voxels;
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

    /// Finds the rows with voxels that no deformed tet covers, for [`Tile::keep_open`]. Returns
    /// whether there are any.
    pub fn find_open(&mut self) -> bool {
        let [columns, rows, slices] = self.region.clone().map(|range| range.len());
        let all = u64::MAX >> (64 - columns);
        self.open = [0; TILE[2]];
        for (k, open) in self.open.iter_mut().enumerate().take(slices) {
            for j in 0..rows {
                let row = k * TILE[1] + j;
                let covered = self.lines[row].inside | self.margins[row].near;
                *open |= u32::from(covered & all != all) << j;
            }
        }
        self.open.iter().any(|&rows| rows != 0)
    }

    /// Sets the voxels to air that tets cover at rest and no deformed tet covers. Call it after
    /// [`Tile::deform`].
    #[inline(always)]
    pub fn vacate(&mut self, source: &Source<'_>, group: &mut Group, tets: &[[u32; 4]]) {
        for tets in tets.chunks(GROUP) {
            let mut vertices = [[0; 4]; GROUP];
            vertices[..tets.len()].copy_from_slice(tets);
            group.rasterize(source.rest, &vertices, &self.region, source.tolerance);
            for n in 0..tets.len() {
                if let (Some(raster), Some(span)) = (group.rasters.tet(n), group.spans.of(n)) {
                    self.leave(source, raster, span);
                }
            }
        }
    }

    #[inline(always)]
    fn leave(
        &mut self,
        source: &Source<'_>,
        raster: TetRaster<'_>,
        [columns, rows, slices]: [(usize, usize); 3],
    ) {
        for j in (rows.0..rows.1).step_by(ROWS) {
            raster.rows(j, slices, columns, self.region[0].start, &mut self.rows);
            for k in slices.0..slices.1 {
                for n in 0..ROWS.min(rows.1 - j) {
                    let row = self.row(j + n, k);
                    let margin = &mut self.margins[row];
                    let left = self.rows.near[ROWS * (k - slices.0) + n]
                        & !(self.lines[row].inside | margin.near | margin.vacated);
                    margin.vacated |= left;
                    for column in columns_of(left) {
                        self.values[row * TILE[0] + column] = source.air;
                    }
                }
            }
        }
    }

    /// Keeps the tets whose boxes at rest have voxels that no deformed tet covers.
    #[inline(always)]
    pub fn keep_open(&self, source: &Source<'_>, group: &mut Group, tets: &mut Vec<[u32; 4]>) {
        let mut kept = 0;
        for first in (0..tets.len()).step_by(GROUP) {
            let mut vertices = [[0; 4]; GROUP];
            let count = GROUP.min(tets.len() - first);
            vertices[..count].copy_from_slice(&tets[first..][..count]);
            group.surround(source.rest, &vertices, &self.region, source.tolerance);
            for (n, &tet) in vertices[..count].iter().enumerate() {
                if group.spans.of(n).is_some_and(|spans| self.is_open(spans)) {
                    tets[kept] = tet;
                    kept += 1;
                }
            }
        }
        tets.truncate(kept);
    }

    /// Whether a box has voxels that no deformed tet covers.
    #[inline(always)]
    fn is_open(&self, [columns, rows, slices]: [(usize, usize); 3]) -> bool {
        let bits = (u64::MAX >> (64 - (columns.1 - columns.0))) << (columns.0 - self.region[0].start);
        let (first_row, first_slice) = (self.region[1].start, self.region[2].start);
        let all = (u32::MAX >> (TILE[1] - (rows.1 - rows.0))) << (rows.0 - first_row);
        for k in slices.0 - first_slice..slices.1 - first_slice {
            for j in columns_of(u64::from(self.open[k] & all)) {
                let row = k * TILE[1] + j;
                if bits & !(self.lines[row].inside | self.margins[row].near) != 0 {
                    return true;
                }
            }
        }
        false
    }

    /// The counts of this tile.
    pub fn report(&self) -> ResampleReport {
        let mut report = ResampleReport::default();
        let count = |bits: u64| bits.count_ones() as usize;
        for (line, margin) in self.lines.iter().zip(&self.margins) {
            report.moved_voxels += count(line.moved);
            report.vacated_voxels += count(margin.vacated);
            report.folds += count(line.twice & line.by_moved);
        }
        report
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

/// The columns of the bits that are set.
#[inline(always)]
fn columns_of(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let column = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        column
    })
}
