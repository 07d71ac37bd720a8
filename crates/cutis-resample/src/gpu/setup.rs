//! The input of a resampling in `f32`, validated and scaled, as the kernels read it.

use cutis_volume::Volume;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::uniform::GridUniform;
use crate::sample::{scanned_range, stored_air};
use crate::space::IndexSpace;
use crate::{ResampleError, Warp};

/// Largest number of voxels along an axis: the kernels number slices in 16 bits.
const MAX_SIDE: usize = u16::MAX as usize;
/// Largest number of tets: the highest bit of an owner's key is a flag.
const MAX_TETS: usize = (u32::MAX >> 1) as usize;
/// The tolerance as a multiple of the rounding error of the largest place: four roundings for the
/// positions, as on the CPU, and four for the map from positions to places.
const TOLERANCE: f32 = 8.0;

/// Options of a [`ResamplerGpu`](crate::ResamplerGpu).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResamplerOptions {
    /// Positions on the device are local meters minus this offset, for rest and deformed positions
    /// alike. A point in the middle of the body gives the best precision.
    pub offset: [f32; 3],
    /// Number of slices in a slab; by default as many as memory limits allow. The result does not
    /// depend on it.
    pub slab_slices: Option<usize>,
}

impl ResamplerOptions {
    /// Default options, with the middle of the body at rest as offset.
    pub fn centered(warp: &Warp<'_>) -> Self {
        let widen = |(low, high): (Point3<f32>, Point3<f32>), p: &Point3<f32>| (low.inf(p), high.sup(p));
        let offset = warp.rest.first().map_or([0.0; 3], |&first| {
            let (low, high) = warp.rest.iter().fold((first, first), widen);
            std::array::from_fn(|axis| 0.5 * low[axis] + 0.5 * high[axis])
        });
        Self { offset, ..Self::default() }
    }
}

/// The input of the kernels: the grid and the rest positions in `f32`.
///
/// It is public so that a reference implementation of the kernels can start from the same numbers.
pub struct Setup {
    /// The volume, and the map from positions to voxels.
    pub grid: GridUniform,
    /// Rest positions minus the offset, in meters; the fourth component is 0.
    pub rest: Vec<[f32; 4]>,
    offset: [f32; 3],
}

impl Setup {
    /// Validates the input and converts it to `f32`.
    ///
    /// # Errors
    /// The errors of [`resample`](crate::resample), [`ResampleError::TooLarge`], and
    /// [`ResampleError::NotFinite`] for the offset.
    pub fn new(volume: &Volume, warp: &Warp<'_>, options: &ResamplerOptions) -> Result<Self, ResampleError> {
        warp.validate()?;
        let tets = warp.tets.len().max(warp.removed.len());
        if tets > MAX_TETS {
            return Err(ResampleError::TooManyTets { tets, limit: MAX_TETS });
        }
        let shape = volume.grid().shape;
        if shape.iter().any(|&side| side > MAX_SIDE) {
            return Err(ResampleError::TooLarge { shape, limit: MAX_SIDE });
        }
        let offset = options.offset;
        if !offset.iter().all(|c| c.is_finite()) {
            return Err(ResampleError::NotFinite {
                which: "offset",
                vertex: 0,
                position: offset.map(f64::from),
            });
        }
        let rest = relative(warp.rest, offset);
        let grid = grid(volume, warp.origin_mm, &rest, offset);
        Ok(Self { grid, rest, offset })
    }

    /// Positions as the kernels read them: minus the offset, with 0 as fourth component.
    pub fn positions(&self, positions: &[Point3<f32>]) -> Vec<[f32; 4]> {
        relative(positions, self.offset)
    }
}

/// Positions minus the offset, with 0 as fourth component.
pub(super) fn relative(positions: &[Point3<f32>], offset: [f32; 3]) -> Vec<[f32; 4]> {
    let [x, y, z] = offset;
    positions.par_iter().map(|p| [p.x - x, p.y - y, p.z - z, 0.0]).collect()
}

/// The grid of a volume with the map from positions to places, and the tolerance of places.
fn grid(volume: &Volume, origin_mm: Point3<f64>, rest: &[[f32; 4]], offset: [f32; 3]) -> GridUniform {
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
    GridUniform {
        linear,
        offset,
        tolerance: TOLERANCE * f32::EPSILON * ((body * stretch) as f32).max(corner),
        region: first,
        shape: shape.map(|side| side as u32),
        first,
        last,
        center,
        air: i32::from(air),
        scanned: scanned_range(volume, air).map(i32::from),
        unused: 0,
    }
}
