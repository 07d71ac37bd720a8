//! A resampling in `f32`: what the kernels and their twin both start from.

use std::ops::Range;

use cutis_volume::Volume;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::uniform::Grid;
use crate::sample::{scanned_range, stored_air};
use crate::space::IndexSpace;
use crate::warp::sub_grid;
use crate::{ResampleError, Warp};

/// Most voxels along an axis: slices are numbered in 16 bits.
const LONGEST: usize = u16::MAX as usize;
/// Most tets: the first bit of an owner's key says whether it holds the voxel.
const MOST_TETS: usize = (u32::MAX >> 1) as usize;

/// What to resample, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResamplerOptions {
    /// The box of voxels to fill; the whole volume if there is none.
    pub region: Option<[Range<usize>; 3]>,
    /// Positions on the device are local meters less this: the same `f32` subtraction for rest and deformed ones. A point in
    /// the middle of the body serves precision best.
    pub offset: [f32; 3],
    /// Slices that are filled at a time. The result does not depend on it. Without it as many as memory limits allow.
    pub slab_slices: Option<usize>,
}

impl ResamplerOptions {
    /// The whole volume, with positions relative to the middle of the body at rest.
    pub fn centerd(warp: &Warp<'_>) -> Self {
        let widen = |(low, high): (Point3<f32>, Point3<f32>), p: &Point3<f32>| (low.inf(p), high.sup(p));
        let offset = warp.rest.first().map_or([0.0; 3], |&first| {
            let (low, high) = warp.rest.iter().fold((first, first), widen);
            std::array::from_fn(|axis| 0.5 * low[axis] + 0.5 * high[axis])
        });
        Self { offset, ..Self::default() }
    }
}

/// A validated problem: the region, and where things are in `f32`.
pub struct Setup {
    pub grid: Grid,
    pub region: [Range<usize>; 3],
    /// The grid of the region.
    pub volume_grid: cutis_volume::Grid,
    /// Rest positions less the offset; the fourth component is 0.
    pub rest: Vec<[f32; 4]>,
    pub offset: [f32; 3],
}

impl Setup {
    pub fn new(volume: &Volume, warp: &Warp<'_>, options: &ResamplerOptions) -> Result<Self, ResampleError> {
        warp.validate()?;
        let tets = warp.tets.len().max(warp.removed.len());
        if tets > MOST_TETS {
            return Err(ResampleError::TooManyTets { tets, limit: MOST_TETS });
        }
        let shape = volume.grid().shape;
        if shape.iter().any(|&side| side > LONGEST) {
            return Err(ResampleError::TooLarge { shape, limit: LONGEST });
        }
        let offset = options.offset;
        if !offset.iter().all(|c| c.is_finite()) {
            return Err(ResampleError::NotFinite {
                which: "offset",
                vertex: 0,
                position: offset.map(f64::from),
            });
        }
        let region = options.region.clone().unwrap_or_else(|| shape.map(|side| 0..side));
        let volume_grid = sub_grid(volume.grid(), &region)?;
        let rest = relative(warp.rest, offset);
        let grid = grid(volume, warp.origin_mm, &rest, offset, &region);
        Ok(Self { grid, region, volume_grid, rest, offset })
    }

    /// Voxels of a slice of the region.
    pub fn slice_voxels(&self) -> usize {
        self.region[0].len() * self.region[1].len()
    }
}

/// Positions as they lie on the device: less the offset, the fourth component 0.
pub fn relative(positions: &[Point3<f32>], offset: [f32; 3]) -> Vec<[f32; 4]> {
    let [x, y, z] = offset;
    positions.par_iter().map(|p| [p.x - x, p.y - y, p.z - z, 0.0]).collect()
}

fn grid(
    volume: &Volume,
    origin_mm: Point3<f64>,
    rest: &[[f32; 4]],
    offset: [f32; 3],
    region: &[Range<usize>; 3],
) -> Grid {
    let shape = volume.grid().shape;
    let space = IndexSpace::new(&volume.grid().affine, origin_mm, [&[], &[]]);
    let middle = space.linear * Vector3::from(offset.map(f64::from)) + space.offset;
    let center: [i32; 3] =
        std::array::from_fn(|axis| middle[axis].round().clamp(0.0, (shape[axis] - 1) as f64) as i32);
    let place = |voxel: usize, axis: usize| (voxel as i64 - i64::from(center[axis])) as f32;
    let first = std::array::from_fn(|axis| place(0, axis));
    let last = std::array::from_fn(|axis| place(shape[axis] - 1, axis));
    let linear = std::array::from_fn(|row| std::array::from_fn(|column| space.linear[(row, column)] as f32));
    let offset = std::array::from_fn(|axis| (middle[axis] - f64::from(center[axis])) as f32);

    let amax = |p: &[f32; 4]| p[0].abs().max(p[1].abs()).max(p[2].abs());
    let body = f64::from(rest.par_iter().map(amax).reduce(|| 0.0, f32::max));
    let stretch = (0..3).map(|row| space.linear.row(row).norm()).fold(0.0, f64::max);
    let corner = (0..3).map(|axis| first[axis].abs().max(last[axis])).fold(0.0, f32::max);
    let air = stored_air(volume);
    Grid {
        linear,
        offset,
        tolerance: TOLERANCE * f32::EPSILON * ((body * stretch) as f32).max(corner),
        region: std::array::from_fn(|axis| place(region[axis].start, axis)),
        shape: region.each_ref().map(|range| range.len() as u32),
        first,
        last,
        center,
        air: i32::from(air),
        scanned: scanned_range(volume, air).map(i32::from),
        unused: 0,
    }
}

/// The tolerance over the roundings of the largest place: four for the positions, as on the CPU, and four for the map to places.
const TOLERANCE: f32 = 8.0;
