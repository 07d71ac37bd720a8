//! Depth below the outer skin, as a volume that can be resampled together with the CT.

use std::ops::Range;

use cutis_volume::{Affine, Grid, Volume};
use nalgebra::Point3;
use rayon::prelude::*;

use crate::RenderError;
use crate::field::Field;
use crate::outside::Outside;

/// Unit of the stored depths, mm.
const UNIT_MM: f32 = 0.01;

/// Distance in mm from each point to the nearest outside air, up to `limit_mm`, on a grid of about
/// `spacing_mm` that is never finer than the volume's own grid.
///
/// `within_mm` are two opposite corners of the box that is needed, in mm along the axes of the
/// patient; with `None` the whole volume. The grid covers the box and has the depth of the skin, 0,
/// at the sides that are inside the volume, as after [`bare_sides`].
///
/// Air is outside if it is connected to the sides of the volume. Connections through the first and
/// the last slice along the body do not count, because they would include lungs and bowel.
/// Distances assume that the index axes are orthogonal.
///
/// After resampling through the same warp as the CT, it shows how deep a surface was at rest. See
/// [`View::depth`](crate::View::depth).
///
/// # Errors
/// [`RenderError::Setting`] if a length is not above zero, or a corner is not finite.
pub fn skin_depth(
    volume: &Volume,
    threshold_hu: f32,
    spacing_mm: f64,
    limit_mm: f64,
    within_mm: Option<[Point3<f64>; 2]>,
) -> Result<Volume, RenderError> {
    for (key, value) in [("spacing_mm", spacing_mm), ("limit_mm", limit_mm)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(RenderError::Setting { key, value, expected: "a length above zero" });
        }
    }
    let mut corners = within_mm.iter().flatten().flat_map(|corner| corner.iter());
    if let Some(&value) = corners.find(|x| !x.is_finite()) {
        return Err(RenderError::Setting { key: "within_mm", value, expected: "finite" });
    }
    let field = Field::new(volume);
    let fine = volume.grid();
    let (coarse, stride) = coarse_grid(fine, spacing_mm)?;
    let part = within_mm.map_or_else(|| coarse.shape.map(|n| 0..n), |corners| part_of(&coarse, corners));
    let spacing = coarse.affine.spacing_mm().map(|mm| mm as f32);
    let limit = limit_mm.min(f64::from(UNIT_MM) * f64::from(i16::MAX)) as f32;

    let outside = Outside::new(coarse.shape, body_axis(&coarse), |j, k, air| {
        let row = &volume.voxels()[fine.index([0, j * stride[1], k * stride[2]])..];
        let below = |&stored: &i16| field.hu(stored) < threshold_hu;
        if stride[0] == 1 {
            // In this form, vectors of voxels are compared.
            air.iter_mut().zip(row).for_each(|(air, stored)| *air = below(stored));
        } else {
            air.iter_mut().zip(row.iter().step_by(stride[0])).for_each(|(air, stored)| *air = below(stored));
        }
    });
    // The squared distance is found along one axis after the other. Along the axes to come, the
    // rows reach beyond the part by the limit.
    let reach = spacing.map(|mm| (limit / mm) as usize);
    let wide: [Range<usize>; 3] = std::array::from_fn(|axis| {
        part[axis].start.saturating_sub(reach[axis])..(part[axis].end + reach[axis]).min(coarse.shape[axis])
    });
    let along_x = rows_along_x(&outside, &part[0], &wide, spacing[0], limit);
    let width = part[0].len();
    let along_y = nearest_rows(&along_x, width, [&wide[1], &part[1]], wide[2].len(), spacing[1], reach[1]);
    drop(along_x);
    // Slices are rows of the third axis.
    let slice = width * part[1].len();
    let squared = nearest_rows(&along_y, slice, [&wide[2], &part[2]], 1, spacing[2], reach[2]);
    let depth = squared.par_iter().map(|d| (d.sqrt() / UNIT_MM).round() as i16).collect();
    let depth = Volume::new(part_grid(&coarse, &part)?, depth, UNIT_MM, 0.0)?;
    bare_sides(depth, fine)
}

/// Sets the outermost depths to 0 on the sides of a part that are inside the scan it was taken
/// from. A surface beyond the part then has the color of skin.
///
/// # Errors
/// None for a volume of [`skin_depth`].
pub fn bare_sides(depth: Volume, scan: &Grid) -> Result<Volume, RenderError> {
    let (grid, slope, intercept) = (*depth.grid(), depth.slope(), depth.intercept());
    let last = grid.shape.map(|n| n - 1);
    let [low, high] =
        [[0; 3], last].map(|corner| scan.affine.to_index(grid.affine.to_mm(corner.map(|n| n as f64).into())));
    let strides = [1, grid.shape[0], grid.shape[0] * grid.shape[1]];
    let mut voxels = depth.into_voxels();
    for axis in 0..3 {
        // A strided grid may end less than one of its own steps before the scan does.
        let step = grid.affine.spacing_mm()[axis] / scan.affine.spacing_mm()[axis];
        let inside = [low[axis] > 0.5, high[axis] + step < scan.shape[axis] as f64 - 0.5];
        for (side, _) in [0, last[axis]].into_iter().zip(inside).filter(|(_, inside)| *inside) {
            let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
            for (m, n) in (0..grid.shape[a]).flat_map(|m| (0..grid.shape[b]).map(move |n| (m, n))) {
                voxels[side * strides[axis] + m * strides[a] + n * strides[b]] = 0;
            }
        }
    }
    Ok(Volume::new(grid, voxels, slope, intercept)?)
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

/// The indices of a box in mm, and the one voxel around it. At least one index along each axis.
fn part_of(grid: &Grid, corners_mm: [Point3<f64>; 2]) -> [Range<usize>; 3] {
    let corner = |n: usize| Point3::from(std::array::from_fn(|axis| corners_mm[n >> axis & 1][axis]));
    let corners: [Point3<f64>; 8] = std::array::from_fn(|n| grid.affine.to_index(corner(n)));
    std::array::from_fn(|axis| {
        let ends = corners.iter().map(|corner| corner[axis]);
        let (low, high) =
            ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let last = grid.shape[axis] - 1;
        let first = ((low.floor() - 1.0).max(0.0) as usize).min(last);
        first..((high.ceil() + 1.0).max(0.0) as usize).clamp(first, last) + 1
    })
}

fn part_grid(grid: &Grid, part: &[Range<usize>; 3]) -> Result<Grid, RenderError> {
    let mut rows = grid.affine.rows();
    let first = grid.mm([0, 1, 2].map(|axis: usize| part[axis].start));
    for (row, start) in rows.iter_mut().zip(first.iter()) {
        row[3] = *start;
    }
    Ok(Grid { shape: [0, 1, 2].map(|axis: usize| part[axis].len()), affine: Affine::from_rows(rows)? })
}

/// The index axis that is nearest to the axis of the body.
fn body_axis(grid: &Grid) -> usize {
    let along_body = |axis: usize| grid.affine.step_mm(axis).z.abs() / grid.affine.step_mm(axis).norm();
    (0..3).max_by(|&a, &b| along_body(a).total_cmp(&along_body(b))).unwrap_or(2)
}

/// Squared distance to the nearest outside air of the same row, mm², at most `limit²`: at the
/// positions `part` of the rows `wide`.
fn rows_along_x(
    outside: &Outside,
    part: &Range<usize>,
    wide: &[Range<usize>; 3],
    spacing: f32,
    limit: f32,
) -> Vec<f32> {
    let mut squared = vec![limit * limit; part.len() * wide[1].len() * wide[2].len()];
    squared.par_chunks_mut(part.len()).enumerate().for_each(|(number, row)| {
        let (j, k) = (wide[1].start + number % wide[1].len(), wide[2].start + number / wide[1].len());
        let mut from: Option<usize> = None;
        let fill = |row: &mut [f32], to: Range<usize>, from: Option<usize>, until: Option<usize>| {
            for at in to.start.max(part.start)..to.end.min(part.end) {
                let distances = [from.map(|end| at - end + 1), until.map(|start| start - at)];
                let Some(least) = distances.into_iter().flatten().min() else { continue };
                let value = &mut row[at - part.start];
                *value = value.min((least as f32 * spacing).powi(2));
            }
        };
        for run in outside.row(j, k) {
            fill(row, from.unwrap_or(0)..run.start, from, Some(run.start));
            for at in run.start.max(part.start)..run.end.min(part.end) {
                row[at - part.start] = 0.0;
            }
            from = Some(run.end);
        }
        fill(row, from.unwrap_or(0)..part.end, from, None);
    });
    squared
}

/// One pass of the separable squared distance transform, between rows of `width` values: the
/// smallest sum of a row's value and the squared distance to that row, at most `reach` rows away.
///
/// `squared` has `count` groups of the rows `wide`. The result has as many groups of the rows
/// `part`.
fn nearest_rows(
    squared: &[f32],
    width: usize,
    [wide, part]: [&Range<usize>; 2],
    count: usize,
    spacing: f32,
    reach: usize,
) -> Vec<f32> {
    let mut out = vec![0.0; width * part.len() * count];
    let rows_at = |number: usize| {
        let (group, row) = (number / part.len(), part.start - wide.start + number % part.len());
        (&squared[group * wide.len() * width..][..wide.len() * width], row)
    };
    out.par_chunks_mut(width).enumerate().for_each(|(number, out)| {
        let (rows, row) = rows_at(number);
        // A piece stays in the cache while the rows around it pass.
        for first in (0..width).step_by(PIECE) {
            let piece = first..(first + PIECE).min(width);
            let out = &mut out[piece.clone()];
            out.copy_from_slice(&rows[row * width..][..width][piece.clone()]);
            for distance in 1..=reach {
                let added = (distance as f32 * spacing).powi(2);
                if out.iter().fold(0.0_f32, |most, &x| if x > most { x } else { most }) <= added {
                    break;
                }
                let back = row.checked_sub(distance);
                let ahead = Some(row + distance).filter(|&row| row < wide.len());
                for other in back.into_iter().chain(ahead) {
                    for (value, near) in out.iter_mut().zip(&rows[other * width..][..width][piece.clone()]) {
                        let sum = near + added;
                        *value = if sum < *value { sum } else { *value };
                    }
                }
            }
        }
    });
    out
}

/// Values of a row that are processed together.
const PIECE: usize = 1024;

#[cfg(test)]
mod tests {
    use super::*;
    use cutis_test_kit::Random;

    fn ball() -> Volume {
        let affine = Affine::from_spacing([1.0, 1.0, 1.5], [-30.0, -30.0, -30.0]).unwrap();
        let grid = Grid { shape: [61, 61, 41], affine };
        let hollow = |v: usize| {
            let r = grid.mm(grid.point(v)).coords.norm();
            if (6.0..25.0).contains(&r) { 40 } else { -1000 }
        };
        Volume::new(grid, (0..grid.len()).map(hollow).collect(), 1.0, 0.0).unwrap()
    }

    #[test]
    fn depth_in_a_ball_is_radius_less_distance_and_cavities_do_not_count() {
        let volume = ball();
        let depth = skin_depth(&volume, -300.0, 1.0, 20.0, None).unwrap();
        let field = Field::new(&depth);
        for r in [8.0, 12.0, 20.0, 24.0] {
            let at = field.at_mm(Point3::new(0.6 * r, 0.8 * r, 0.0));
            assert!((f64::from(at) - (25.0 - r)).abs() < 1.5, "{at} at {r}");
        }
        assert!(field.at_mm(Point3::origin()) > 19.0, "the cavity is not outside");
        assert_eq!(field.at_mm(Point3::new(29.0, 0.0, 0.0)), 0.0);
    }

    #[test]
    fn settings_that_are_no_lengths_are_refused() {
        let of = |spacing_mm, limit_mm, corner| {
            let within = [Point3::origin(), Point3::new(1.0, 1.0, corner)];
            skin_depth(&ball(), -300.0, spacing_mm, limit_mm, Some(within)).map(|_| ())
        };
        assert!(of(1.0, 20.0, 1.0).is_ok());
        for (setting, key) in [
            (of(0.0, 20.0, 1.0), "spacing_mm"),
            (of(1.0, f64::NAN, 1.0), "limit_mm"),
            (of(1.0, 20.0, f64::INFINITY), "within_mm"),
        ] {
            assert!(setting.unwrap_err().to_string().contains(key), "no {key}");
        }
    }

    /// All pairs of voxels, and a flood from voxel to voxel.
    #[test]
    fn depth_equals_the_least_distance_to_air_that_a_flood_reaches() {
        let mut random = Random::new(3);
        for shape in [[9, 7, 8], [1, 12, 5], [17, 1, 6], [1, 1, 1]] {
            // The body lies along the third, the first, and the second index.
            for turn in 0..3 {
                let mut rows = [[0.0; 4]; 4];
                for axis in 0..3 {
                    rows[(axis + turn) % 3][axis] = [0.8, 1.1, 1.7][axis];
                }
                rows[3][3] = 1.0;
                let grid = Grid { shape, affine: Affine::from_rows(rows).unwrap() };
                let voxels: Vec<i16> =
                    (0..grid.len()).map(|_| if random.below(10) < 4 { -900 } else { 30 }).collect();
                let volume = Volume::new(grid, voxels.clone(), 1.0, 0.0).unwrap();
                let body = (2 + 3 - turn) % 3;
                let neighbors = |p: [usize; 3], q: [usize; 3]| {
                    (0..3).map(|axis| p[axis].abs_diff(q[axis])).sum::<usize>() == 1
                };
                let mut outside: Vec<[usize; 3]> = (0..grid.len())
                    .filter(|&v| voxels[v] < 0)
                    .map(|v| grid.point(v))
                    .filter(|at| (0..3).any(|a| a != body && (at[a] == 0 || at[a] + 1 == shape[a])))
                    .collect();
                let mut done = 0;
                while done < outside.len() {
                    let at = outside[done];
                    let next = (0..grid.len()).filter(|&v| voxels[v] < 0).map(|v| grid.point(v));
                    let new: Vec<_> = next.filter(|&p| neighbors(at, p) && !outside.contains(&p)).collect();
                    outside.extend(new);
                    done += 1;
                }
                let depth = skin_depth(&volume, -300.0, 0.1, 4.0, None).unwrap();
                for v in 0..grid.len() {
                    let from = grid.mm(grid.point(v));
                    let distances = outside.iter().map(|&at| (grid.mm(at) - from).norm());
                    let exact = distances.fold(4.0, f64::min);
                    let found = f64::from(depth.hu(depth.voxels()[v]));
                    assert!((found - exact).abs() < 0.006, "{found} for {exact} at {v} of {shape:?}");
                }
            }
        }
    }

    #[test]
    fn a_part_has_the_depths_of_the_whole_and_skin_at_its_sides() {
        let volume = ball();
        for spacing in [1.0, 2.0] {
            let whole = skin_depth(&volume, -300.0, spacing, 6.0, None).unwrap();
            let corners = [Point3::new(-40.0, -8.0, 3.0), Point3::new(-12.0, 8.0, 21.0)];
            let part = skin_depth(&volume, -300.0, spacing, 6.0, Some(corners)).unwrap();
            let (all, grid) = (*whole.grid(), *part.grid());
            assert!(grid.len() < all.len() / 8, "{grid:?} of {all:?}");
            let mut compared = [0; 2];
            for v in 0..grid.len() {
                let (at, mm) = (grid.point(v), grid.mm(grid.point(v)));
                let in_all = all.affine.to_index(mm).map(|x| x.round() as usize);
                assert!((all.mm(in_all.into()) - mm).norm() < 1e-9);
                // The first side along x is that of the volume.
                let bare = at[0] + 1 == grid.shape[0]
                    || (1..3).any(|axis| at[axis] == 0 || at[axis] + 1 == grid.shape[axis]);
                let exact = if bare { 0 } else { whole.voxels()[all.index(in_all.into())] };
                assert_eq!(part.voxels()[v], exact, "at {at:?}");
                compared[usize::from(bare)] += usize::from(whole.voxels()[all.index(in_all.into())] > 0);
            }
            assert!(compared.into_iter().all(|n| n > 20), "tissue inside and at the sides: {compared:?}");
        }
    }
}
