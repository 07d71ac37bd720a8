//! Trilinear interpolation of stored values, and the stored value of air.

use cutis_volume::{AIR_HU, Volume};
use rayon::prelude::*;

use crate::lanes::{floor, integer};

/// The trilinear value at a continuous index, rounded to the nearest stored value (halves upwards).
///
/// Positions outside the grid are clamped to it, so that the value lies between the smallest and
/// the largest of the voxels that are read. Voxels outside the range `scanned` are padding. Where
/// padding meets other voxels, it counts as the nearest end of the range (air), so that it never
/// bleeds into tissue. Where all eight voxels are padding, and at a voxel's center, values stay as
/// they are.
#[inline]
pub fn trilinear(voxels: &[i16], shape: [usize; 3], scanned: [i16; 2], position: [f64; 3]) -> i16 {
    let (mut base, mut stride) = (0, 1);
    let mut step = [0; 3];
    let mut fraction = [0.0; 3];
    for axis in 0..3 {
        let clamped = position[axis].clamp(0.0, (shape[axis] - 1) as f64);
        let low = clamped as usize;
        fraction[axis] = clamped - low as f64;
        step[axis] = if low + 1 < shape[axis] { stride } else { 0 };
        base += low * stride;
        stride *= shape[axis];
    }
    let [sx, sy, sz] = step;
    let [fx, fy, fz] = fraction;
    let mut corners: [i16; 8] = std::array::from_fn(|corner| {
        let [x, y, z] = [corner & 1, corner >> 1 & 1, corner >> 2];
        voxels[base + x * sx + y * sy + z * sz]
    });
    let padding = corners.iter().filter(|&&value| value < scanned[0] || value > scanned[1]).count();
    if padding > 0 && padding < 8 {
        if fraction == [0.0; 3] {
            return voxels[base];
        }
        corners = corners.map(|value| value.clamp(scanned[0], scanned[1]));
    }
    let along_x = |low: usize| {
        let (a, b) = (f64::from(corners[low]), f64::from(corners[low + 1]));
        a + fx * (b - a)
    };
    let along_y = |low: usize| {
        let (a, b) = (along_x(low), along_x(low + 2));
        a + fy * (b - a)
    };
    let (a, b) = (along_y(0), along_y(4));
    nearest(a + fz * (b - a))
}

/// The voxels of a volume, for sampling many positions.
#[derive(Clone, Copy)]
pub struct Sampler<'a> {
    pub voxels: &'a [i16],
    pub shape: [usize; 3],
    /// Range of stored values that are not padding.
    pub scanned: [i16; 2],
    /// Whether some voxels are padding.
    pub has_padding: bool,
}

/// A value within the range of `i16`, rounded to the nearest integer, halves upwards.
#[inline(always)]
pub fn nearest(value: f64) -> i16 {
    let shift = 32768.0;
    (integer(floor(value + (shift + 0.5))) as i32 - shift as i32) as i16
}

/// The smallest and the largest stored value.
fn extremes(volume: &Volume) -> (i16, i16) {
    let widen = |(a, b): (i16, i16), (c, d): (i16, i16)| (a.min(c), b.max(d));
    let empty = (i16::MAX, i16::MIN);
    let part = |voxels: &[i16]| voxels.iter().fold(empty, |range, &v| widen(range, (v, v)));
    volume.voxels().par_chunks(1 << 16).map(part).reduce(|| empty, widen)
}

/// The stored value nearest to −1024 HU, clamped to the range of the stored values.
pub fn stored_air(volume: &Volume) -> i16 {
    air_within(volume, extremes(volume))
}

fn air_within(volume: &Volume, (low, high): (i16, i16)) -> i16 {
    let exact = (f64::from(AIR_HU) - f64::from(volume.intercept())) / f64::from(volume.slope());
    (exact.round() as i16).max(low).min(high)
}

impl<'a> Sampler<'a> {
    /// A sampler of a volume, and the stored value of air.
    pub fn new(volume: &'a Volume) -> (Self, i16) {
        let (low, high) = extremes(volume);
        let air = air_within(volume, (low, high));
        let scanned = scanned_range(volume, air);
        let has_padding = low < scanned[0] || high > scanned[1];
        let (voxels, shape) = (volume.voxels(), volume.grid().shape);
        (Self { voxels, shape, scanned, has_padding }, air)
    }
}

/// The range of stored values that can come from a scan: air (see [`stored_air`]) and everything
/// denser. Values outside of it are padding.
pub fn scanned_range(volume: &Volume, air: i16) -> [i16; 2] {
    if volume.slope() > 0.0 { [air, i16::MAX] } else { [i16::MIN, air] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutis_volume::{Affine, Grid};

    const ALL: [i16; 2] = [i16::MIN, i16::MAX];

    #[test]
    fn padding_does_not_bleed_into_tissue() {
        let scanned = [-1024, i16::MAX];
        let at = |voxels: &[i16], x: f64| trilinear(voxels, [2, 1, 1], scanned, [x, 0.0, 0.0]);
        assert_eq!(at(&[-3024, 40], 0.5), -492, "as air");
        assert_eq!(trilinear(&[-3024, 40], [2, 1, 1], ALL, [0.5, 0.0, 0.0]), -1492, "the control: bled");
        assert_eq!(at(&[-3024, 40], 0.0), -3024, "kept at its own place");
        assert_eq!(at(&[-3024, -3024], 0.5), -3024, "and among itself");
        assert_eq!(at(&[-1000, 40], 0.5), -480);
        assert_eq!(
            trilinear(&[3024, -40], [2, 1, 1], [i16::MIN, 1024], [0.5, 0.0, 0.0]),
            492,
            "negative slope"
        );
    }

    #[test]
    fn trilinear_is_exact_at_voxels_and_rounds_between() {
        let voxels: Vec<i16> = vec![-1000, 0, 400, 3, -7, 32767, -32768, 1];
        for k in 0..2 {
            for j in 0..2 {
                for i in 0..2 {
                    let at = [i as f64, j as f64, k as f64];
                    assert_eq!(trilinear(&voxels, [2, 2, 2], ALL, at), voxels[i + 2 * (j + 2 * k)]);
                }
            }
        }
        assert_eq!(trilinear(&voxels, [2, 2, 2], ALL, [0.25, 0.0, 0.0]), -750);
        assert_eq!(trilinear(&voxels, [2, 2, 2], ALL, [0.0, 0.5, 0.0]), -300);
        assert_eq!(trilinear(&[0, 1], [2, 1, 1], ALL, [0.49, 0.0, 0.0]), 0);
        assert_eq!(trilinear(&[0, -1], [2, 1, 1], ALL, [0.51, 0.0, 0.0]), -1);
        assert_eq!(trilinear(&voxels, [2, 2, 2], ALL, [-5.0, 9.0, -1.0]), 400);
    }

    #[test]
    fn air_is_minus_1024_hu_or_the_smallest_value_present() {
        let air = |voxels: Vec<i16>, slope: f32, intercept: f32| {
            let affine = Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap();
            let grid = Grid { shape: [voxels.len(), 1, 1], affine };
            stored_air(&Volume::new(grid, voxels, slope, intercept).unwrap())
        };
        assert_eq!(air(vec![-3024, 100], 1.0, 0.0), -1024);
        assert_eq!(air(vec![-3024, 100], 2.0, -24.0), -500);
        assert_eq!(air(vec![-900, 100], 1.0, 0.0), -900);
        assert_eq!(air(vec![-2000, -1500], 1.0, 0.0), -1500);
        assert_eq!(air(vec![0, 4000], 1.0, -1024.0), 0);
        assert_eq!(air(vec![-100, 2000], -1.0, 0.0), 1024);
    }
}
