//! The blurred opacity of a body on its lattice, and its gradient.

use cutis_volume::Grid;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::BodySkin;
use crate::blur::Blurred;

/// Standard deviation of the blur along each axis, in units of the geometric mean of the three
/// lattice steps.
const SIGMA: f64 = 2.0;

/// HU up to which the opacity is 0, and the length of its ramp to 1: the table preset `paper`.
const RAMP_HU: [f32; 2] = [-449.0, 455.0];

/// The blurred opacity at the lattice points.
pub(super) struct Opacity(Blurred);

/// A gradient of the opacity.
pub(super) struct Gradient {
    /// Its length per lattice step, without unit.
    pub per_step: f64,
    /// Its direction in world axes. The length has no meaning.
    pub direction: Vector3<f64>,
}

impl Opacity {
    pub fn blurred(skin: &BodySkin<'_>) -> Self {
        let body = skin.hu().par_iter().zip(skin.vertices());
        let values = body.map(|(&hu, &vertex)| if vertex { of_hu(hu) } else { 0.0 }).collect();
        Self(Blurred::new(skin.lattice(), values, SIGMA))
    }

    /// The gradient at the center of a triangle whose corners are corners of one cell.
    pub fn gradient(&self, grid: &Grid, triangle: &[u32; 3]) -> Gradient {
        let corners = triangle.map(|point| grid.point(point as usize));
        let low = [0, 1, 2].map(|axis| corners.iter().fold(usize::MAX, |low, c| low.min(c[axis])));
        let share =
            [0, 1, 2].map(|axis| corners.iter().map(|c| (c[axis] - low[axis]) as f64).sum::<f64>() / 3.0);
        let mut derivatives = Vector3::zeros();
        for corner in 0..8 {
            let upper = [0, 1, 2].map(|axis| corner >> axis & 1);
            let weight = |axis: usize| if upper[axis] == 1 { share[axis] } else { 1.0 - share[axis] };
            let weight = weight(0) * weight(1) * weight(2);
            if weight > 0.0 {
                derivatives += self.0.derivatives([0, 1, 2].map(|axis| low[axis] + upper[axis])) * weight;
            }
        }
        let per_step = Vector3::from_fn(|axis, _| derivatives[axis] * self.0.gap(axis, low[axis])).norm();
        Gradient { per_step, direction: self.0.direction(&derivatives) }
    }
}

/// The opacity from 0 to 1 of a HU value.
fn of_hu(hu: f32) -> f32 {
    ((hu - RAMP_HU[0]) / RAMP_HU[1]).clamp(0.0, 1.0)
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
