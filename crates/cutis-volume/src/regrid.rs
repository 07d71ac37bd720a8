//! Resamples slices at any positions to a grid with perpendicular axes and equal distances.
//!
//! The new grid has the axes of the slices: rows, columns and their normal. The values of a new
//! slice are linear along the normal between the two slices next to it, and bilinear within each.
//! So a scan with a tilted gantry is only shifted within its slices, and slices at uneven distances
//! are only interpolated between neighbors.

use rayon::prelude::*;

use crate::volume::without_padding;
use crate::{AIR_HU, Affine, Grid, Volume, VolumeError};

/// Most new slices for each given one.
const MOST_PER_SLICE: usize = 4;

/// Slices of equal size and orientation.
pub(crate) struct Slices<'a> {
    /// HU, slice by slice.
    pub(crate) hu: &'a (dyn Fn(usize) -> f32 + Sync),
    /// Pixels along rows and columns.
    pub(crate) size: [usize; 2],
    pub(crate) spacing_mm: [f64; 2],
    /// Position of each slice along the normal from the first, mm. It increases.
    pub(crate) along_mm: &'a [f64],
    /// Position of the first pixel of each slice along rows and columns, from the first slice, mm.
    pub(crate) shift_mm: &'a [[f64; 2]],
}

/// The result: int16 HU on a regular grid.
pub(crate) struct Regridded {
    pub(crate) hu: Vec<i16>,
    pub(crate) shape: [usize; 3],
    pub(crate) step_mm: f64,
    /// Position of the first voxel, in mm along rows, columns and normal from the first pixel of
    /// the first slice.
    pub(crate) origin_mm: [f64; 3],
}

/// Resamples the slices. Places outside them are air.
///
/// The new distance is the smallest one, or a larger one if that would make more than four new
/// slices per given one. `None` if the result does not fit into memory.
pub(crate) fn regrid(slices: &Slices<'_>) -> Option<Regridded> {
    let count = slices.along_mm.len();
    let length = slices.along_mm[count - 1];
    let least = slices.along_mm.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let intervals = if count < 2 {
        0
    } else {
        ((length / least - 1e-3).ceil() as usize).clamp(1, MOST_PER_SLICE * count)
    };
    let step_mm = if intervals == 0 { 1.0 } else { length / intervals as f64 };
    let (mut first, mut size) = ([0i64; 2], [0; 2]);
    for axis in 0..2 {
        let shifts = || slices.shift_mm.iter().map(|shift| shift[axis] / slices.spacing_mm[axis]);
        let low = shifts().fold(f64::INFINITY, f64::min).round();
        let high = shifts().fold(f64::NEG_INFINITY, f64::max).round();
        // Slices that are shifted by more than their size have no common volume to speak of.
        if !high.is_finite() || high - low > 4.0 * slices.size[axis] as f64 {
            return None;
        }
        first[axis] = low as i64;
        size[axis] = slices.size[axis] + (high - low) as usize;
    }
    let shape = [size[0], size[1], intervals + 1];
    let mut hu: Vec<i16> = Vec::new();
    let len = shape.iter().try_fold(1usize, |len, &n| len.checked_mul(n))?;
    hu.try_reserve_exact(len).ok()?;
    hu.resize(len, 0);
    hu.par_chunks_mut(size[0] * size[1]).enumerate().for_each(|(k, plane)| {
        let along = if k == intervals { length } else { k as f64 * step_mm };
        let above =
            slices.along_mm.partition_point(|&at| at <= along).clamp(1, count.max(2) - 1).min(count - 1);
        let below = above.saturating_sub(1);
        let gap = slices.along_mm[above] - slices.along_mm[below];
        let share = if gap > 0.0 { ((along - slices.along_mm[below]) / gap).clamp(0.0, 1.0) } else { 0.0 };
        for (n, voxel) in plane.iter_mut().enumerate() {
            let at: [f64; 2] = std::array::from_fn(|axis| {
                let index = if axis == 0 { n % size[0] } else { n / size[0] };
                (index as i64 + first[axis]) as f64 * slices.spacing_mm[axis]
            });
            let corners = [slices.corners(below, at), slices.corners(above, at)];
            *voxel = mix(corners, share).round() as i16;
        }
    });
    let origin_mm = [first[0] as f64 * slices.spacing_mm[0], first[1] as f64 * slices.spacing_mm[1], 0.0];
    Some(Regridded { hu, shape, step_mm, origin_mm })
}

impl Slices<'_> {
    /// HU and weight of the four pixels around a place in a slice. A pixel outside is air.
    fn corners(&self, slice: usize, at_mm: [f64; 2]) -> [(f32, f64); 4] {
        let index: [f64; 2] = std::array::from_fn(|axis| {
            let index = (at_mm[axis] - self.shift_mm[slice][axis]) / self.spacing_mm[axis];
            // Rounding of positions must not mix a pixel with its neighbor.
            if (index - index.round()).abs() < 1e-6 { index.round() } else { index }
        });
        let low = index.map(f64::floor);
        std::array::from_fn(|corner| {
            let step = [(corner & 1) as f64, (corner >> 1) as f64];
            let weight = |axis: usize| 1.0 - (index[axis] - low[axis] - step[axis]).abs();
            let pixel = [low[0] + step[0], low[1] + step[1]];
            let inside = (0..2).all(|axis| pixel[axis] >= 0.0 && pixel[axis] < self.size[axis] as f64);
            let hu = match inside {
                true => {
                    (self.hu)(pixel[0] as usize + self.size[0] * (pixel[1] as usize + self.size[1] * slice))
                }
                false => AIR_HU,
            };
            (hu, weight(0) * weight(1))
        })
    }
}

/// The mean of both slices. Padding next to other values counts as air.
fn mix(corners: [[(f32, f64); 4]; 2], share: f64) -> f64 {
    let weights: [f64; 8] =
        std::array::from_fn(|n| corners[n / 4][n % 4].1 * if n < 4 { 1.0 - share } else { share });
    let mut hu: [f32; 8] = std::array::from_fn(|n| corners[n / 4][n % 4].0);
    // A value without weight must not decide whether another one is padding.
    let some = (0..8).find(|&n| weights[n] > 0.0).unwrap_or(0);
    hu = std::array::from_fn(|n| if weights[n] > 0.0 { hu[n] } else { hu[some] });
    without_padding(&mut hu);
    (0..8).map(|n| f64::from(hu[n]) * weights[n]).sum()
}

/// Resamples a volume whose slices are shifted against each other, as with a tilted gantry, to
/// perpendicular axes. A volume whose axes are perpendicular is returned as it is.
///
/// The new grid has the first two axes of the volume, and their normal. Places outside the volume
/// are air.
///
/// ```
/// # use cutis_volume::{Affine, Grid, Volume, to_perpendicular_axes};
/// let tilted = Affine::from_rows([
///     [1.0, 0.0, 0.0, 0.0],
///     [0.0, 1.0, 0.5, 0.0],
///     [0.0, 0.0, 2.0, 0.0],
///     [0.0, 0.0, 0.0, 1.0],
/// ])?;
/// let volume = Volume::new(Grid { shape: [4, 4, 3], affine: tilted }, vec![40; 48], 1.0, 0.0)?;
/// let upright = to_perpendicular_axes(volume)?;
/// assert_eq!(upright.grid().shape, [4, 5, 3]);
/// assert!(!upright.grid().affine.is_sheared());
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
///
/// # Errors
/// [`VolumeError::NotStacked`] if the first two axes are not perpendicular, or the slices are
/// shifted too far against each other. [`VolumeError::ResampledRange`] if HU do not fit into int16.
pub fn to_perpendicular_axes(volume: Volume) -> Result<Volume, VolumeError> {
    let affine = volume.grid().affine;
    if !affine.is_sheared() {
        return Ok(volume);
    }
    let refused = VolumeError::NotStacked { cosine: affine.shear() };
    let [nx, ny, nz] = volume.grid().shape;
    let [row, column] = [0, 1].map(|axis| affine.step_mm(axis).normalize());
    if row.dot(&column).abs() > 1e-4 {
        return Err(refused);
    }
    let column = (column - row * row.dot(&column)).normalize();
    let step = affine.step_mm(2);
    let cross = row.cross(&column);
    let normal = cross * step.dot(&cross).signum();
    let along_mm: Vec<f64> = (0..nz).map(|k| k as f64 * step.dot(&normal)).collect();
    let shift_mm: Vec<[f64; 2]> =
        (0..nz).map(|k| [k as f64 * step.dot(&row), k as f64 * step.dot(&column)]).collect();
    let [dx, dy, _] = affine.spacing_mm();
    let int16 = f32::from(i16::MIN)..=f32::from(i16::MAX);
    if let Some(hu) = volume.voxels().iter().map(|&stored| volume.hu(stored)).find(|hu| !int16.contains(hu)) {
        return Err(VolumeError::ResampledRange { hu });
    }
    let slices = Slices {
        hu: &|n| volume.hu(volume.voxels()[n]),
        size: [nx, ny],
        spacing_mm: [dx, dy],
        along_mm: &along_mm,
        shift_mm: &shift_mm,
    };
    let new = regrid(&slices).ok_or(refused)?;
    let rows = affine.rows();
    let [u, v, w] = new.origin_mm;
    let line = |r: usize| {
        let origin = rows[r][3] + row[r] * u + column[r] * v + normal[r] * w;
        [row[r] * dx, column[r] * dy, normal[r] * new.step_mm, origin]
    };
    let affine = Affine::from_rows([line(0), line(1), line(2), [0.0, 0.0, 0.0, 1.0]])?;
    Volume::new(Grid { shape: new.shape, affine }, new.hu, 1.0, 0.0)
}
