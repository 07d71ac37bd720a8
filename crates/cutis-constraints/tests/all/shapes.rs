//! Random shapes at three length scales, and how far they are from degenerate.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

/// Lengths of 1 mm, 1 m and 1 km.
pub const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];

/// A shape of `N` points with its length scale in m, somewhere within a few scales of the origin.
#[derive(Clone, Copy, Debug)]
pub struct Shape<const N: usize> {
    pub x: [Point3<f64>; N],
    pub scale: f64,
}

impl<const N: usize> Shape<N> {
    /// The shape with coordinates that `f32` holds exactly.
    pub fn rounded(&self) -> Self {
        Self { x: self.x.map(|p| p.map(|v| f64::from(v as f32))), scale: self.scale }
    }

    pub fn single(&self) -> [Point3<f32>; N] {
        self.x.map(|p| p.map(|v| v as f32))
    }
}

/// Shapes whose sizes (lengths, areas, volumes of all simplices) are at least a few hundredths of the scale's.
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

/// A reproducible sequence of numbers (splitmix64).
pub struct Random(pub u64);

impl Random {
    /// Uniform in 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A power of ten with an exponent uniform in `low` to `high`.
    pub fn power(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(low + (high - low) * self.uniform())
    }

    pub fn point(&mut self) -> Point3<f64> {
        Point3::new(self.uniform(), self.uniform(), self.uniform())
    }
}
