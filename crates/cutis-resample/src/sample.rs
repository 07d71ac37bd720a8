//! Trilinear interpolation of stored values, and the stored value of air.

use cutis_volume::{AIR_HU, Volume};
use rayon::prelude::*;

/// The trilinear value at a continuous index, rounded to the nearest stored value (halves upwards). Positions outside the
/// grid are clamped to it, so the value always lies between the smallest and the largest of the voxels read.
#[inline]
pub fn trilinear(voxels: &[i16], shape: [usize; 3], position: [f64; 3]) -> i16 {
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
    let along_x = |at: usize| {
        let (a, b) = (f64::from(voxels[at]), f64::from(voxels[at + sx]));
        a + fx * (b - a)
    };
    let along_y = |at: usize| {
        let (a, b) = (along_x(at), along_x(at + sy));
        a + fy * (b - a)
    };
    let (a, b) = (along_y(base), along_y(base + sz));
    // Shifted to positive numbers, where the conversion's truncation is a floor.
    let shift = 32768.0;
    (((a + fz * (b - a)) + (shift + 0.5)) as i32 - shift as i32) as i16
}

/// The stored value nearest to −1024 HU, held within the range of the stored values, so that no HU is invented.
pub fn stored_air(volume: &Volume) -> i16 {
    let widen = |(a, b): (i16, i16), (c, d): (i16, i16)| (a.min(c), b.max(d));
    let empty = (i16::MAX, i16::MIN);
    let (low, high) =
        volume.voxels().par_iter().fold(|| empty, |range, &v| widen(range, (v, v))).reduce(|| empty, widen);
    let exact = (f64::from(AIR_HU) - f64::from(volume.intercept())) / f64::from(volume.slope());
    (exact.round() as i16).max(low).min(high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutis_volume::{Affine, Grid};

    #[test]
    fn trilinear_is_exact_at_voxels_and_rounds_between() {
        let voxels: Vec<i16> = vec![-1000, 0, 400, 3, -7, 32767, -32768, 1];
        for k in 0..2 {
            for j in 0..2 {
                for i in 0..2 {
                    let at = [i as f64, j as f64, k as f64];
                    assert_eq!(trilinear(&voxels, [2, 2, 2], at), voxels[i + 2 * (j + 2 * k)]);
                }
            }
        }
        assert_eq!(trilinear(&voxels, [2, 2, 2], [0.25, 0.0, 0.0]), -750);
        assert_eq!(trilinear(&voxels, [2, 2, 2], [0.0, 0.5, 0.0]), -300);
        assert_eq!(trilinear(&[0, 1], [2, 1, 1], [0.49, 0.0, 0.0]), 0);
        assert_eq!(trilinear(&[0, -1], [2, 1, 1], [0.51, 0.0, 0.0]), -1);
        assert_eq!(trilinear(&voxels, [2, 2, 2], [-5.0, 9.0, -1.0]), 400);
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
