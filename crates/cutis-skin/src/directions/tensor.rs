//! Symmetric tensors without a trace, which describe directions without a sign.

use std::ops::{Add, AddAssign, Mul, Sub};

use nalgebra::{Matrix3, Vector3};

use super::any_tangent;

/// The components xx, xy, xz, yy and yz. The component zz is −xx − yy.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tensor(pub [f64; 5]);

impl Tensor {
    pub const ZERO: Self = Self([0.0; 5]);

    /// `d dᵀ − ⅓` for a unit vector `d`.
    pub fn of_direction(d: &Vector3<f64>) -> Self {
        Self([d.x * d.x - 1.0 / 3.0, d.x * d.y, d.x * d.z, d.y * d.y - 1.0 / 3.0, d.y * d.z])
    }

    /// The main direction in the plane perpendicular to a unit normal, and the gap between the two
    /// eigenvalues in this plane. The gap is 1 for [`Tensor::of_direction`] of a vector in the
    /// plane.
    pub fn main_in_plane(&self, normal: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let [xx, xy, xz, yy, yz] = self.0;
        let matrix = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, -xx - yy);
        let first = any_tangent(normal);
        let second = normal.cross(&first);
        let (along, across) = (matrix * first, matrix * second);
        // The angle of the main eigenvector is half that of (difference, twice the mixed term).
        let (difference, mixed) = (first.dot(&along) - second.dot(&across), 2.0 * first.dot(&across));
        let angle = mixed.atan2(difference) / 2.0;
        ((first * angle.cos() + second * angle.sin()).normalize(), difference.hypot(mixed))
    }

    /// Componentwise function of two tensors.
    pub fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|n| f(self.0[n], other.0[n])))
    }
}

impl Add for Tensor {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl AddAssign for Tensor {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Tensor {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul<f64> for Tensor {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self(self.0.map(|a| a * factor))
    }
}

#[cfg(test)]
mod tests {
    use cutis_test_kit::Random;

    use super::*;

    #[test]
    fn the_main_direction_of_one_stroke_is_the_stroke() {
        let mut random = Random::new(3);
        for _ in 0..200 {
            let normal = random.vector().normalize();
            let stroke = any_tangent(&normal).cross(&normal) * 0.6 + any_tangent(&normal) * 0.8;
            let (direction, gap) = Tensor::of_direction(&stroke).main_in_plane(&normal);
            assert!((direction.dot(&stroke).abs() - 1.0).abs() < 1e-12 && (gap - 1.0).abs() < 1e-12);
            assert_eq!(Tensor::of_direction(&stroke), Tensor::of_direction(&-stroke));
            // Control: two perpendicular strokes have no main direction.
            let crossed = Tensor::of_direction(&stroke) + Tensor::of_direction(&stroke.cross(&normal));
            assert!(crossed.main_in_plane(&normal).1 < 1e-12);
        }
    }

    #[test]
    fn the_gap_of_two_strokes_is_the_cosine_of_twice_the_half_angle() {
        for degrees in [0.0f64, 10.0, 45.0, 80.0] {
            let half = (degrees / 2.0).to_radians();
            let [a, b] = [half, -half].map(|angle| Vector3::new(angle.cos(), angle.sin(), 0.0));
            let mean = (Tensor::of_direction(&a) + Tensor::of_direction(&b)) * 0.5;
            let (direction, gap) = mean.main_in_plane(&Vector3::z());
            assert!((gap - (2.0 * half).cos()).abs() < 1e-12 && direction.x.abs() > 1.0 - 1e-12, "{degrees}");
        }
    }
}
