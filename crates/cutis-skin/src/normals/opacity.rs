//! The blurred opacity of a body on its lattice, and its gradient.

use cutis_mesh::{Lattice, Planes};
use cutis_volume::Affine;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::BodySkin;

/// Standard deviation of the blur along each axis, in units of the geometric mean of the three
/// lattice steps.
const SIGMA: f64 = 2.0;

/// Largest number of passes of the filter along an axis. Lattices with very uneven steps reach it.
const MOST_PASSES: f64 = 64.0;

/// HU up to which the opacity is 0, and the length of its ramp to 1: the table preset `paper`.
const RAMP_HU: [f32; 2] = [-449.0, 455.0];

/// The blurred opacity at the lattice points.
pub(super) struct Opacity {
    values: Vec<f32>,
    axes: [Axis; 3],
    /// The gradients of the three index coordinates in world axes, times a positive number.
    covectors: [Vector3<f64>; 3],
}

/// A gradient of the opacity.
pub(super) struct Gradient {
    /// Its length per lattice step, without unit.
    pub per_step: f64,
    /// Its direction in world axes. The length has no meaning.
    pub direction: Vector3<f64>,
}

impl Opacity {
    pub fn blurred(skin: &BodySkin<'_>) -> Self {
        let grid = skin.lattice().grid();
        let body = skin.hu().par_iter().zip(skin.vertices());
        let mut values: Vec<f32> = body.map(|(&hu, &vertex)| if vertex { of_hu(hu) } else { 0.0 }).collect();
        let mut other = vec![0.0; values.len()];
        let axes = [0, 1, 2].map(|axis| Axis::new(skin.lattice(), axis));
        let passes = passes(grid.affine.spacing_mm());
        for axis in [0, 1, 2] {
            for _ in 0..passes[axis] {
                smooth(&values, &mut other, grid.shape, axis, &axes[axis].filter);
                std::mem::swap(&mut values, &mut other);
            }
        }
        Self { values, axes, covectors: covectors(&grid.affine) }
    }

    /// The gradient at the center of a triangle whose corners are corners of one cell.
    pub fn gradient(&self, triangle: &[u32; 3]) -> Gradient {
        let [nx, ny] = [self.axes[0].gaps.len() + 1, self.axes[1].gaps.len() + 1];
        let corners = triangle.map(|p| p as usize).map(|p| [p % nx, p / nx % ny, p / (nx * ny)]);
        let low = [0, 1, 2].map(|axis| corners.iter().fold(usize::MAX, |low, c| low.min(c[axis])));
        let share =
            [0, 1, 2].map(|axis| corners.iter().map(|c| (c[axis] - low[axis]) as f64).sum::<f64>() / 3.0);
        let mut derivatives = Vector3::zeros();
        for corner in 0..8 {
            let upper = [0, 1, 2].map(|axis| corner >> axis & 1);
            let weight = |axis: usize| if upper[axis] == 1 { share[axis] } else { 1.0 - share[axis] };
            let weight = weight(0) * weight(1) * weight(2);
            if weight > 0.0 {
                derivatives += self.derivatives([0, 1, 2].map(|axis| low[axis] + upper[axis])) * weight;
            }
        }
        let gap = |axis: usize| self.axes[axis].gaps[low[axis].min(self.axes[axis].gaps.len() - 1)];
        let per_step = Vector3::from_fn(|axis, _| derivatives[axis] * gap(axis)).norm();
        let direction = (0..3).map(|axis| self.covectors[axis] * derivatives[axis]).sum();
        Gradient { per_step, direction }
    }

    /// The derivatives along the three axes at a lattice point, per step of the even lattice.
    fn derivatives(&self, point: [usize; 3]) -> Vector3<f64> {
        let [nx, ny] = [self.axes[0].gaps.len() + 1, self.axes[1].gaps.len() + 1];
        let flat = point[0] + nx * (point[1] + ny * point[2]);
        let strides = [1, nx, nx * ny];
        Vector3::from_fn(|axis, _| {
            let line =
                |n: usize| f64::from(self.values[flat + n * strides[axis] - point[axis] * strides[axis]]);
            self.axes[axis].derivative(point[axis], line)
        })
    }
}

/// The inverse transpose of the map from index to mm, times a positive number: cross products of
/// its columns. Columns of length 1 keep the products in range for any spacing.
fn covectors(affine: &Affine) -> [Vector3<f64>; 3] {
    let columns: [Vector3<f64>; 3] = [0, 1, 2].map(|axis| affine.step_mm(axis).normalize());
    let handed = columns[0].dot(&columns[1].cross(&columns[2])).signum();
    let lengths = affine.spacing_mm();
    let shortest = lengths.into_iter().fold(f64::INFINITY, f64::min);
    [0, 1, 2].map(|axis| {
        columns[(axis + 1) % 3].cross(&columns[(axis + 2) % 3]) * (handed * shortest / lengths[axis])
    })
}

/// The opacity from 0 to 1 of a HU value.
fn of_hu(hu: f32) -> f32 {
    ((hu - RAMP_HU[0]) / RAMP_HU[1]).clamp(0.0, 1.0)
}

/// Number of times that the filter (1, 2, 1)/4 is applied along each axis. Each adds ½ to the
/// variance in lattice steps. The blur is as wide along each axis, in mm, as whole passes allow.
fn passes(spacing_mm: [f64; 3]) -> [usize; 3] {
    let mean = spacing_mm.into_iter().map(f64::cbrt).product::<f64>();
    spacing_mm.map(|step| (2.0 * (SIGMA * mean / step).powi(2)).round().clamp(1.0, MOST_PASSES) as usize)
}

/// The planes across one axis.
struct Axis {
    /// Distances between neighboring planes in steps of the even lattice.
    gaps: Vec<f64>,
    /// Weights of the planes below and above each plane. The plane itself has the rest.
    filter: Vec<[f32; 2]>,
}

impl Axis {
    fn new(lattice: &Lattice, axis: usize) -> Self {
        let even = || vec![1.0; lattice.grid().shape[axis] - 1];
        let between =
            |planes: &Planes| planes.axes()[axis].windows(2).map(|pair| pair[1] - pair[0]).collect();
        let gaps: Vec<f64> = lattice.planes().map_or_else(even, between);
        let inner = gaps.windows(2).map(|gap| {
            let half = 0.5 / (gap[0] + gap[1]);
            [(half * gap[1]) as f32, (half * gap[0]) as f32]
        });
        // Reflection in the value at an end leaves that value unchanged.
        let end = || std::iter::once([0.0; 2]);
        let filter = end().chain(inner).chain(end()).collect();
        Self { gaps, filter }
    }

    /// The derivative at plane `n` of values on the planes. It is exact for a parabola. At an end
    /// it is the difference to the next plane, because the values continue by reflection.
    fn derivative(&self, n: usize, value: impl Fn(usize) -> f64) -> f64 {
        let slope = |gap: usize| (value(gap + 1) - value(gap)) / self.gaps[gap];
        if n == 0 {
            return slope(0);
        }
        if n == self.gaps.len() {
            return slope(n - 1);
        }
        let [below, above] = [self.gaps[n - 1], self.gaps[n]];
        (slope(n - 1) * above + slope(n) * below) / (below + above)
    }
}

/// Applies the filter of an axis once.
fn smooth(values: &[f32], out: &mut [f32], shape: [usize; 3], axis: usize, filter: &[[f32; 2]]) {
    let [nx, ny, _] = shape;
    out.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
        let here = &values[row * nx..][..nx];
        if axis == 0 {
            smooth_row(here, out, filter);
            return;
        }
        let (at, stride) = if axis == 1 { (row % ny, nx) } else { (row / ny, nx * ny) };
        if at == 0 || at + 1 == filter.len() {
            out.copy_from_slice(here);
            return;
        }
        let below = &values[row * nx - stride..][..nx];
        let above = &values[row * nx + stride..][..nx];
        for n in 0..nx {
            out[n] = mean(filter[at], below[n], here[n], above[n]);
        }
    });
}

fn smooth_row(row: &[f32], out: &mut [f32], filter: &[[f32; 2]]) {
    let last = row.len() - 1;
    out[0] = row[0];
    out[last] = row[last];
    for n in 1..last {
        out[n] = mean(filter[n], row[n - 1], row[n], row[n + 1]);
    }
}

fn mean([lower, upper]: [f32; 2], below: f32, here: f32, above: f32) -> f32 {
    lower * below + upper * above + 0.5 * here
}

#[cfg(test)]
mod tests {
    use cutis_volume::{Table, TableKind};

    use super::*;

    #[test]
    fn the_opacity_is_that_of_the_preset() {
        let preset = Table::preset(TableKind::Alpha, "paper").unwrap();
        for hu in [-1000.0, -449.0, -448.0, -221.5, 0.0, 5.9, 6.0, 3000.0] {
            assert!((of_hu(hu) - preset.at(hu)).abs() < 1e-6, "{hu}");
        }
    }
}
