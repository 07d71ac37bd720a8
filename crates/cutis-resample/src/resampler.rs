//! A resampler that keeps its output between the states of a mesh.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use cutis_constraints::{LaneTask, Lanes, Scalar, SimdLevel};
use cutis_volume::Volume;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::buckets::Buckets;
use crate::group::Group;
use crate::inverted::inverted_tets;
use crate::motion::Motion;
use crate::report::ResampleReport;
use crate::sample::Sampler;
use crate::space::IndexSpace;
use crate::tile::{Source, Tile};
use crate::tiling::{TILE, TilesNear, Tiling};
use crate::warp::check_finite;
use crate::{ResampleError, Warp};

/// Margin around tets at rest, in voxels, within which the tolerance of a state lies.
const MARGIN: f64 = 1.0 / 64.0;

/// Resamples one volume through many states of one mesh, on the CPU.
///
/// The output stays in memory. [`Resampler::update`] rewrites it only where the mesh differs from
/// its rest shape, or differed in the state before. The result is that of
/// [`resample`](crate::resample), bit for bit.
///
/// ```
/// use cutis_resample::{Resampler, Warp, resample};
/// # use cutis_volume::{Affine, Grid, Volume};
/// # use nalgebra::Point3;
/// # let grid = Grid { shape: [4, 4, 4], affine: Affine::from_spacing([1.0; 3], [0.0; 3])? };
/// # let volume = Volume::new(grid, (0..64).collect(), 1.0, 0.0)?;
/// # let rest = [[0.0; 3], [0.002, 0.0, 0.0], [0.0, 0.002, 0.0], [0.0, 0.0, 0.002]].map(Point3::from);
/// # let tets = [[0, 1, 2, 3]];
/// # let origin_mm = Point3::origin();
/// let at_rest = Warp { origin_mm, rest: &rest, deformed: &rest, tets: &tets, body_tets: 1, removed: &[] };
/// let mut resampler = Resampler::new(&volume, &at_rest)?;
/// for frame in 0..3 {
///     let deformed = rest.map(|p| Point3::new(p.x + 0.0004 * frame as f32, p.y, p.z));
///     let report = resampler.update(&deformed)?;
///     let (expected, whole) = resample(&volume, &Warp { deformed: &deformed, ..at_rest }, &|_, _| {})?;
///     assert_eq!((resampler.voxels(), report), (expected.voxels(), whole));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Resampler<'a> {
    volume: &'a Volume,
    warp: Warp<'a>,
    level: SimdLevel,
    sampler: Sampler<'a>,
    /// Stored value of air.
    air: i16,
    tiling: Tiling,
    /// Continuous voxel indices of the vertices at rest.
    rest: Vec<Point3<f64>>,
    /// The tets that touch each tile at rest.
    still: Buckets,
    /// Margin around the tets of `still`, in voxels.
    margin: f64,
    removed: Buckets,
    values: Vec<i16>,
    /// The tolerance of the state before. `None` before the first one.
    tolerance: Option<f64>,
    /// The tiles that a moved tet touches, deformed or at rest, in the state before.
    touched: Vec<bool>,
    /// Counts of each tile.
    reports: Vec<ResampleReport>,
    /// Whether each tile is needed. All are if it is empty.
    needed: Vec<bool>,
}

impl<'a> Resampler<'a> {
    /// Prepares a volume and a warp. The deformed positions of the warp are only validated.
    ///
    /// # Errors
    /// The errors of [`resample`](crate::resample).
    pub fn new(volume: &'a Volume, warp: &Warp<'a>) -> Result<Self, ResampleError> {
        warp.validate()?;
        let grid = volume.grid();
        let tiling = Tiling::new(grid.shape);
        let space = IndexSpace::new(&grid.affine, warp.origin_mm, [warp.rest, &[]]);
        let rest = space.indices(warp.rest);
        let margin = MARGIN.max(2.0 * space.tolerance);
        let (sampler, air) = Sampler::new(volume);
        Ok(Self {
            volume,
            warp: *warp,
            level: SimdLevel::best(),
            sampler,
            air,
            still: buckets(&tiling, warp.tets, &rest, margin),
            removed: buckets(&tiling, warp.removed, &rest, margin),
            rest,
            margin,
            values: vec![0; volume.voxels().len()],
            tolerance: None,
            touched: vec![false; tiling.len()],
            reports: vec![ResampleReport::default(); tiling.len()],
            tiling,
            needed: Vec::new(),
        })
    }

    /// Leaves out the tiles of the output that `is_needed` refuses: their voxels keep the values of
    /// the input, and the counts do not include them. `is_needed` receives the world position in mm
    /// of the middle of a tile, and the radius in mm of a ball around the centers of its voxels.
    #[must_use]
    pub fn only(mut self, is_needed: &dyn Fn(Point3<f64>, f64) -> bool) -> Self {
        let affine = &self.volume.grid().affine;
        let tiling = self.tiling;
        self.needed = (0..tiling.len())
            .map(|number| {
                let region = tiling.region(tiling.place(number));
                let ends =
                    |end: fn(&Range<usize>) -> f64| affine.to_mm(Point3::from(region.each_ref().map(end)));
                let (low, high) = (ends(|range| range.start as f64), ends(|range| range.end as f64 - 1.0));
                let half = |axis: usize| affine.step_mm(axis).norm() * (region[axis].len() - 1) as f64 / 2.0;
                // The steps may be at other angles than 90°: their sum is the farthest.
                is_needed(nalgebra::center(&low, &high), (0..3).map(half).sum())
            })
            .collect();
        self
    }

    /// Resamples through deformed positions in local meters, one per vertex.
    ///
    /// # Errors
    /// [`ResampleError::VertexCount`], [`ResampleError::NotFinite`].
    pub fn update(&mut self, deformed: &[Point3<f32>]) -> Result<ResampleReport, ResampleError> {
        self.update_with(deformed, &|_done, _total| {})
    }

    /// As [`Resampler::update`], and calls `progress(done, total)` after each of `total` parts.
    pub(crate) fn update_with(
        &mut self,
        deformed: &[Point3<f32>],
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<ResampleReport, ResampleError> {
        let rest = self.warp.rest;
        if deformed.len() != rest.len() {
            return Err(ResampleError::VertexCount { rest: rest.len(), deformed: deformed.len() });
        }
        check_finite("deformed", deformed)?;
        let warp = Warp { deformed, ..self.warp };
        let (grid, tiling) = (self.volume.grid(), self.tiling);
        let space = IndexSpace::new(&grid.affine, warp.origin_mm, [rest, deformed]);
        if space.tolerance > self.margin {
            self.margin = 2.0 * space.tolerance;
            self.still = buckets(&tiling, warp.tets, &self.rest, self.margin);
            self.removed = buckets(&tiling, warp.removed, &self.rest, self.margin);
        }
        let places = space.indices(deformed);
        let Motion { is_moved, strays } = Motion::new(&warp, &tiling, |vertex| {
            let at_rest = tiling.near(self.rest[vertex].coords.into(), self.margin);
            (at_rest, tiling.near(places[vertex].coords.into(), space.tolerance))
        });
        let any_moved = is_moved.par_iter().any(|&moved| moved);
        let moves = |run: Range<u32>| is_moved[run.start as usize..run.end as usize].contains(&true);
        let is_touched = |tile| any_moved && (strays.any(tile) || self.still.tile(tile).any(moves));
        let touched = (0..tiling.len()).into_par_iter().map(is_touched).collect();
        let all = self.tolerance != Some(space.tolerance);
        let before = std::mem::replace(&mut self.touched, touched);
        let is_stale = |tile: usize| all || before[tile] || self.touched[tile];
        let needed = &self.needed;
        let is_needed = |tile: usize| needed.is_empty() || needed[tile];

        let (sampler, air) = (self.sampler, self.air);
        let source = Source {
            sampler,
            air,
            warp: &warp,
            moved: &is_moved,
            rest: &self.rest,
            deformed: &places,
            tolerance: space.tolerance,
        };
        let level = self.level;
        let mut blocks = blocks(&tiling, &mut self.values, &mut self.reports);
        blocks.retain(|block| (0..tiling.counts[0]).any(|i| is_stale(block.first + i)));
        let (done, total) = (AtomicUsize::new(0), blocks.len());
        blocks.par_iter_mut().for_each_init(Scratch::new, |scratch, block| {
            let first = block.first;
            for i in (0..tiling.counts[0]).filter(|i| is_stale(first + i)) {
                let number = first + i;
                let region = tiling.region([i, block.tile[0], block.tile[1]]);
                if !is_needed(number) {
                    source.copy(&region, &mut block.slices);
                    continue;
                }
                scratch.list(&source, &self.still, &strays, &self.removed, number);
                if scratch.left.is_empty() && !strays.any(number) {
                    source.copy(&region, &mut block.slices);
                    block.reports[i] = ResampleReport::default();
                    continue;
                }
                f32::in_lanes(level, TileTask { scratch, source: &source, region });
                scratch.tile.finish(grid.shape[0], &mut block.slices);
                block.reports[i] = scratch.tile.report();
            }
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
        });
        self.tolerance = Some(space.tolerance);
        let report = self.reports.iter().fold(ResampleReport::default(), |sum, tile| sum + *tile);
        Ok(ResampleReport { inverted_tets: inverted_tets(&warp, &is_moved, level), ..report })
    }

    /// The output of the last update, in the order of [`Volume::voxels`]. All zeros before the
    /// first one.
    pub fn voxels(&self) -> &[i16] {
        &self.values
    }

    /// The output of the last update.
    ///
    /// # Errors
    /// None in practice: the volume has the grid and the scale of the input.
    pub fn into_volume(self) -> Result<Volume, ResampleError> {
        let volume = self.volume;
        Ok(Volume::new(*volume.grid(), self.values, volume.slope(), volume.intercept())?)
    }
}

/// The tets of each tile, with a margin around them.
fn buckets(tiling: &Tiling, tets: &[[u32; 4]], places: &[Point3<f64>], margin: f64) -> Buckets {
    let near = if tets.is_empty() { Vec::new() } else { tiles_near(tiling, places, margin) };
    Buckets::new(tets.len(), tiling, |tet| {
        Some(TilesNear::around(tets[tet].map(|corner| near[corner as usize])))
    })
}

/// The tiles around each of some places, with a margin.
fn tiles_near(tiling: &Tiling, places: &[Point3<f64>], margin: f64) -> Vec<TilesNear> {
    places.par_iter().map(|place| tiling.near(place.coords.into(), margin)).collect()
}

/// The output of a row of tiles.
struct Block<'a> {
    /// Place of the tiles along the second and the third axis.
    tile: [usize; 2],
    /// Number of the first tile.
    first: usize,
    /// For each slice the rows of the tiles, with all columns of the output.
    slices: Vec<&'a mut [i16]>,
    reports: &'a mut [ResampleReport],
}

/// Divides the output into rows of tiles.
fn blocks<'a>(tiling: &Tiling, values: &'a mut [i16], reports: &'a mut [ResampleReport]) -> Vec<Block<'a>> {
    let [columns, rows, _] = tiling.shape;
    let mut blocks: Vec<Block<'a>> = reports
        .chunks_mut(tiling.counts[0])
        .enumerate()
        .map(|(n, reports)| Block {
            tile: [n % tiling.counts[1], n / tiling.counts[1]],
            first: n * tiling.counts[0],
            slices: Vec::with_capacity(TILE[2]),
            reports,
        })
        .collect();
    for (k, slice) in values.chunks_mut(columns * rows).enumerate() {
        let layer = &mut blocks[k / TILE[2] * tiling.counts[1]..];
        for (block, rows) in layer.iter_mut().zip(slice.chunks_mut(columns * TILE[1])) {
            block.slices.push(rows);
        }
    }
    blocks
}

/// Memory for one tile after another.
struct Scratch {
    tile: Tile,
    group: Group,
    /// The tets that may touch the tile now, in ascending order.
    tets: Vec<u32>,
    /// The tets that touch it at rest and that moved or were removed.
    left: Vec<[u32; 4]>,
}

impl Scratch {
    fn new() -> Self {
        Self { tile: Tile::new(), group: Group::new(), tets: Vec::new(), left: Vec::new() }
    }

    /// Lists the tets of a tile.
    fn list(
        &mut self,
        source: &Source<'_>,
        still: &Buckets,
        strays: &Buckets,
        removed: &Buckets,
        tile: usize,
    ) {
        self.tets.clear();
        self.left.clear();
        for run in still.tile(tile) {
            self.tets.extend(run.clone());
            let all = run.start as usize..run.end as usize;
            let moved = source.warp.tets[all.clone()].iter().zip(&source.moved[all]);
            self.left.extend(moved.filter(|(_, moved)| **moved).map(|(tet, _)| tet));
        }
        for run in removed.tile(tile) {
            self.left.extend(&source.warp.removed[run.start as usize..run.end as usize]);
        }
        if strays.any(tile) {
            strays.tile(tile).for_each(|run| self.tets.extend(run));
            // Two ascending runs, which the stable sort merges. A tet may be in both.
            self.tets.sort();
            self.tets.dedup();
        }
    }
}

/// Resamples a tile.
struct TileTask<'a> {
    scratch: &'a mut Scratch,
    source: &'a Source<'a>,
    region: [Range<usize>; 3],
}

impl LaneTask<f32> for TileTask<'_> {
    #[inline(always)]
    fn run<L: Lanes<f32>>(self) {
        let Self { scratch: Scratch { tile, group, tets, left }, source, region } = self;
        tile.start(region);
        tile.read(source);
        tile.deform(source, group, tets);
        if !left.is_empty() && tile.find_open() {
            tile.keep_open(source, group, left);
            tile.vacate(source, group, left);
        }
    }
}

#[cfg(test)]
mod tests {
    use cutis_test_kit::{Kuhn, Random};
    use cutis_volume::{Affine, Grid};
    use nalgebra::Vector3;

    use super::*;

    /// A volume of random numbers.
    fn noise(shape: [usize; 3]) -> Volume {
        let affine = Affine::from_spacing([0.7, 0.9, 1.1], [0.0; 3]).unwrap();
        let grid = Grid { shape, affine };
        let mut random = Random::new(3);
        let voxels = (0..grid.len()).map(|_| random.below(3000) as i16 - 1024).collect();
        Volume::new(grid, voxels, 1.0, 0.0).unwrap()
    }

    /// Tiles that are needed have the values of the whole output, and the others those of the
    /// input, of which some would change.
    #[test]
    fn only_the_tiles_that_are_needed_are_resampled() {
        let volume = noise([150, 70, 40]);
        let Kuhn { positions, tets, .. } = Kuhn::new([28, 18, 11], 0.0037);
        let rest: Vec<Point3<f32>> = positions.iter().map(|p| p.cast::<f32>()).collect();
        let deformed: Vec<Point3<f32>> =
            rest.iter().map(|p| p + Vector3::new(0.0, (70.0 * p.x).sin(), 0.3) * 2e-3).collect();
        let warp = Warp {
            origin_mm: Point3::origin(),
            rest: &rest,
            deformed: &deformed,
            tets: &tets,
            body_tets: tets.len(),
            removed: &[],
        };
        let whole = crate::resample(&volume, &warp, &|_, _| {}).unwrap();
        let near =
            |mm: Point3<f64>, radius_mm: f64| (mm - Point3::new(40.0, 20.0, 10.0)).norm() < 12.0 + radius_mm;
        let mut some = Resampler::new(&volume, &warp).unwrap().only(&near);
        let report = some.update(&deformed).unwrap();
        let grid = volume.grid();
        let [mut needed, mut kept] = [0, 0];
        for (n, &value) in some.voxels().iter().enumerate() {
            let [i, j, k] = grid.point(n);
            let tile = some.tiling.number([i / TILE[0], j / TILE[1], k / TILE[2]]);
            if some.needed[tile] {
                assert_eq!(value, whole.0.voxels()[n], "voxel {n}");
                needed += 1;
            } else {
                assert_eq!(value, volume.voxels()[n], "voxel {n}");
                kept += usize::from(value != whole.0.voxels()[n]);
            }
            // No voxel near the place is left out.
            let inside = (grid.mm([i, j, k]) - Point3::new(40.0, 20.0, 10.0)).norm() < 12.0;
            assert!(!inside || some.needed[tile], "voxel {n}");
        }
        assert!(needed > 0 && kept > 1000, "{needed} voxels needed, {kept} left as they were");
        assert!(report.moved_voxels < whole.1.moved_voxels && report.moved_voxels > 0);
    }

    #[test]
    fn each_simd_level_gives_the_same_bits() {
        let volume = noise([90, 50, 40]);
        let Kuhn { positions, tets, .. } = Kuhn::new([18, 12, 11], 0.0037);
        let rest: Vec<Point3<f32>> = positions.iter().map(|p| p.cast::<f32>()).collect();
        let wave = |p: &Point3<f32>| p + Vector3::new((90.0 * p.y).sin(), 0.0, (70.0 * p.x).sin()) * 2e-3;
        let mut deformed: Vec<Point3<f32>> = rest.iter().map(wave).collect();
        deformed[700] += Vector3::repeat(0.006);
        let warp = Warp {
            origin_mm: Point3::new(0.3, 0.2, 0.1),
            rest: &rest,
            deformed: &deformed,
            tets: &tets,
            body_tets: tets.len() - 500,
            removed: &tets[..20],
        };
        let run = |level| {
            let mut resampler = Resampler { level, ..Resampler::new(&volume, &warp).unwrap() };
            let report = resampler.update(&deformed).unwrap();
            (report, resampler.values)
        };
        let expected = run(SimdLevel::best());
        let report = expected.0;
        assert!(report.folds > 0 && report.inverted_tets > 0 && report.vacated_voxels > 0, "{report:?}");
        assert!(expected.1 != volume.voxels(), "control: the warp does something");
        for level in SimdLevel::available() {
            assert!(run(level) == expected, "{level:?}");
        }
    }
}
