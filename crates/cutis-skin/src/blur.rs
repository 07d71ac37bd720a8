//! Fields on a lattice, blurred, and their gradients.

use cutis_mesh::{Lattice, Planes};
use cutis_volume::Affine;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Largest number of passes of the filter along an axis. Lattices with very uneven steps reach it.
const MOST_PASSES: f64 = 64.0;

/// A blurred field with one value per lattice point.
///
/// The blur repeats the filter (1, 2, 1)/4 along each axis. In a graded lattice the filter and the
/// differences have the weights of the distances between planes, so that a linear field keeps its
/// exact gradient. At the ends of the lattice the field continues by reflection in its end value.
pub(crate) struct Blurred {
    values: Vec<f32>,
    axes: [Axis; 3],
    passes: [usize; 3],
    /// The gradients of the three index coordinates in world axes, times a positive number.
    covectors: [Vector3<f64>; 3],
}

impl Blurred {
    /// Blurs `values`. `sigma` is the standard deviation of the blur along each axis, in units of
    /// the geometric mean of the three lattice steps.
    pub fn new(lattice: &Lattice, mut values: Vec<f32>, sigma: f64) -> Self {
        let grid = lattice.grid();
        let mut other = vec![0.0; values.len()];
        let axes = [0, 1, 2].map(|axis| Axis::new(lattice, axis));
        let passes = passes(grid.affine.spacing_mm(), sigma);
        for axis in [0, 1, 2] {
            for _ in 0..passes[axis] {
                smooth(&values, &mut other, grid.shape, axis, &axes[axis].filter);
                std::mem::swap(&mut values, &mut other);
            }
        }
        Self { values, axes, passes, covectors: covectors(&grid.affine) }
    }

    /// The value at a lattice point.
    pub fn at(&self, [i, j, k]: [usize; 3]) -> f64 {
        let [nx, ny] = [self.axes[0].gaps.len() + 1, self.axes[1].gaps.len() + 1];
        f64::from(self.values[i + nx * (j + ny * k)])
    }

    /// The derivatives along the three axes at a lattice point, per step of the even lattice.
    pub fn derivatives(&self, point: [usize; 3]) -> Vector3<f64> {
        let line = |axis: usize, n: usize| {
            let mut on_line = point;
            on_line[axis] = n;
            self.at(on_line)
        };
        Vector3::from_fn(|axis, _| self.axes[axis].derivative(point[axis], |n| line(axis, n)))
    }

    /// Direction in world axes of a gradient with these derivatives. The length has no meaning.
    pub fn direction(&self, derivatives: &Vector3<f64>) -> Vector3<f64> {
        (0..3).map(|axis| self.covectors[axis] * derivatives[axis]).sum()
    }

    /// The distance between plane `n` across an axis and the next plane, in steps of the even
    /// lattice. At the last plane it is the distance to the plane before.
    pub fn gap(&self, axis: usize, n: usize) -> f64 {
        let gaps = &self.axes[axis].gaps;
        gaps[n.min(gaps.len() - 1)]
    }

    /// Variance of the blur along each axis in lattice steps.
    pub fn variances(&self) -> [f64; 3] {
        self.passes.map(|passes| 0.5 * passes as f64)
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

/// Number of times that the filter (1, 2, 1)/4 is applied along each axis. Each adds ½ to the
/// variance in lattice steps. The blur is as wide along each axis, in mm, as whole passes allow.
fn passes(spacing_mm: [f64; 3], sigma: f64) -> [usize; 3] {
    let mean = spacing_mm.into_iter().map(f64::cbrt).product::<f64>();
    spacing_mm.map(|step| (2.0 * (sigma * mean / step).powi(2)).round().clamp(1.0, MOST_PASSES) as usize)
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
