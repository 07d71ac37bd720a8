//! Random shapes at three length scales that are not degenerate.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

/// Length scales in m: 1 mm, 1 m and 1 km.
pub const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];

/// `N` points and their length scale in m, within a few scales of the origin.
#[derive(Clone, Copy, Debug)]
pub struct Shape<const N: usize> {
    pub x: [Point3<f64>; N],
    pub scale: f64,
}

impl<const N: usize> Shape<N> {
    /// The shape with coordinates that `f32` represents exactly.
    pub fn rounded(&self) -> Self {
        Self { x: self.x.map(|p| p.map(|v| f64::from(v as f32))), scale: self.scale }
    }

    pub fn single(&self) -> [Point3<f32>; N] {
        self.x.map(|p| p.map(|v| v as f32))
    }
}

/// Shapes in which the size of the simplex (length, area or volume) is at least a few hundredths of
/// that of the scale.
pub fn shape<const N: usize>() -> impl Strategy<Value = Shape<N>> {
    let points = proptest::array::uniform::<_, N>(proptest::array::uniform3(-1.0..1.0f64));
    (points, prop::sample::select(&SCALES))
        .prop_map(|(points, scale)| Shape { x: points.map(|p| Point3::from(p) * scale), scale })
        .prop_filter("far from degenerate", |shape| is_fat(&shape.x, shape.scale))
}

fn is_fat(x: &[Point3<f64>], scale: f64) -> bool {
    let edges: Vec<Vector3<f64>> = x[1..].iter().map(|p| (p - x[0]) / scale).collect();
    match edges[..] {
        [a] => a.norm() > 0.05,
        [a, b] => a.cross(&b).norm() > 0.05,
        [a, b, c] => a.dot(&b.cross(&c)).abs() > 0.05,
        _ => false,
    }
}
