//! Depth below the outer skin, as a volume that can be resampled together with the CT.

use cutis_volume::{Affine, Grid, Volume};

use rayon::prelude::*;

use crate::RenderError;
use crate::field::Field;

/// Unit of the stored depths, mm.
const UNIT_MM: f32 = 0.01;

/// Distance in mm from each point to the nearest outside air, up to `limit_mm`, on a grid of about
/// `spacing_mm` that is never finer than the volume's own grid.
///
/// Air is outside if it is connected to the sides of the volume. Connections through the first and
/// the last slice along the body do not count, because they would include lungs and bowel.
/// Distances assume that the index axes are orthogonal.
///
/// After resampling through the same warp as the CT, it shows how deep a surface was at rest. See
/// [`View::depth`](crate::View::depth).
///
/// # Errors
/// [`RenderError::Setting`] if a length is not above zero.
pub fn skin_depth(
    volume: &Volume,
    threshold_hu: f32,
    spacing_mm: f64,
    limit_mm: f64,
) -> Result<Volume, RenderError> {
    for (key, value) in [("spacing_mm", spacing_mm), ("limit_mm", limit_mm)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(RenderError::Setting { key, value, expected: "a length above zero" });
        }
    }
    let field = Field::new(volume);
    let (grid, stride) = coarse_grid(volume.grid(), spacing_mm)?;
    let fine = volume.grid();
    let air: Vec<bool> = (0..grid.len())
        .into_par_iter()
        .map(|point| {
            let at = grid.point(point);
            field.voxel(fine.index(std::array::from_fn(|axis| at[axis] * stride[axis]))) < threshold_hu
        })
        .collect();
    let outside = flood(&grid, &air);
    let limit = limit_mm.min(f64::from(UNIT_MM) * f64::from(i16::MAX)) as f32;
    let mut squared: Vec<f32> = outside.iter().map(|&out| if out { 0.0 } else { limit * limit }).collect();
    for axis in 0..3 {
        squared = sweep(&squared, grid.shape, axis, grid.affine.spacing_mm()[axis] as f32, limit);
    }
    let depth = squared.par_iter().map(|d| (d.sqrt() / UNIT_MM).round() as i16).collect();
    Ok(Volume::new(grid, depth, UNIT_MM, 0.0)?)
}

/// The grid of every `stride`-th voxel.
fn coarse_grid(fine: &Grid, spacing_mm: f64) -> Result<(Grid, [usize; 3]), RenderError> {
    let spacing = fine.affine.spacing_mm();
    let stride: [usize; 3] = std::array::from_fn(|axis| {
        ((spacing_mm / spacing[axis]).round().max(1.0) as usize).min(fine.shape[axis])
    });
    let mut rows = fine.affine.rows();
    for row in rows.iter_mut().take(3) {
        for axis in 0..3 {
            row[axis] *= stride[axis] as f64;
        }
    }
    let shape = std::array::from_fn(|axis| (fine.shape[axis] - 1) / stride[axis] + 1);
    Ok((Grid { shape, affine: Affine::from_rows(rows)? }, stride))
}

/// Air that is connected to the lateral faces of the volume through faces of voxels.
fn flood(grid: &Grid, air: &[bool]) -> Vec<bool> {
    let along_body = |axis: usize| grid.affine.step_mm(axis).z.abs() / grid.affine.step_mm(axis).norm();
    let body_axis = (0..3).max_by(|&a, &b| along_body(a).total_cmp(&along_body(b))).unwrap_or(2);
    let mut outside = vec![false; air.len()];
    let mut front = Vec::new();
    for (point, _) in air.iter().enumerate().filter(|(_, air)| **air) {
        let at = grid.point(point);
        if (0..3).any(|axis| axis != body_axis && (at[axis] == 0 || at[axis] + 1 == grid.shape[axis])) {
            outside[point] = true;
            front.push(point);
        }
    }
    let stride = [1, grid.shape[0], grid.shape[0] * grid.shape[1]];
    while let Some(point) = front.pop() {
        let at = grid.point(point);
        for axis in 0..3 {
            let back = (at[axis] > 0).then(|| point - stride[axis]);
            let ahead = (at[axis] + 1 < grid.shape[axis]).then(|| point + stride[axis]);
            for next in [back, ahead].into_iter().flatten() {
                if air[next] && !outside[next] {
                    outside[next] = true;
                    front.push(next);
                }
            }
        }
    }
    outside
}

/// One pass of the separable squared distance transform: the smallest `squared + distance²` along
/// an axis.
fn sweep(squared: &[f32], shape: [usize; 3], axis: usize, spacing: f32, limit: f32) -> Vec<f32> {
    let stride: usize = shape[..axis].iter().product();
    let reach = ((limit / spacing) as usize).min(shape[axis] - 1);
    let row = shape[0];
    let mut out = squared.to_vec();
    out.par_chunks_mut(row).enumerate().for_each(|(number, out)| {
        let first = number * row;
        for (column, value) in out.iter_mut().enumerate() {
            let point = first + column;
            let at = point / stride % shape[axis];
            if *value == 0.0 {
                continue;
            }
            for distance in 1..=reach {
                let added = (distance as f32 * spacing).powi(2);
                if added >= *value {
                    break;
                }
                if at >= distance {
                    *value = value.min(squared[point - distance * stride] + added);
                }
                if at + distance < shape[axis] {
                    *value = value.min(squared[point + distance * stride] + added);
                }
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn depth_in_a_ball_is_radius_less_distance_and_cavities_do_not_count() {
        let affine = Affine::from_spacing([1.0, 1.0, 1.5], [-30.0, -30.0, -30.0]).unwrap();
        let grid = Grid { shape: [61, 61, 41], affine };
        let hollow = |v: usize| {
            let r = grid.mm(grid.point(v)).coords.norm();
            if (6.0..25.0).contains(&r) { 40 } else { -1000 }
        };
        let volume = Volume::new(grid, (0..grid.len()).map(hollow).collect(), 1.0, 0.0).unwrap();
        let depth = skin_depth(&volume, -300.0, 1.0, 20.0).unwrap();
        let field = Field::new(&depth);
        for r in [8.0, 12.0, 20.0, 24.0] {
            let at = field.at_mm(Point3::new(0.6 * r, 0.8 * r, 0.0));
            assert!((f64::from(at) - (25.0 - r)).abs() < 1.5, "{at} at {r}");
        }
        assert!(field.at_mm(Point3::origin()) > 19.0, "the cavity is not outside");
        assert_eq!(field.at_mm(Point3::new(29.0, 0.0, 0.0)), 0.0);
        assert!(skin_depth(&volume, -300.0, 0.0, 20.0).is_err());
    }
}
