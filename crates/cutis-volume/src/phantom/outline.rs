//! Outlines of the trunk: closed curves around the long axis that vary along it.

use super::profile::Profile;
use super::solid::{Bounds, gauge_distance};

/// A closed curve around the long axis. Its half-width and its depths to the front and back are
/// profiles along z.
#[derive(Clone, Copy)]
pub(super) struct Outline {
    pub(super) side: Profile,
    pub(super) front: Profile,
    pub(super) back: Profile,
    pub(super) squareness: f32,
}

impl Outline {
    fn radii(&self, y: f32, z: f32) -> [f32; 2] {
        [self.side.at(z), if y > 0.0 { self.front.at(z) } else { self.back.at(z) }]
    }

    /// The point where the ray from the axis along `(x, y)` leaves the outline at height `z`.
    pub(super) fn exit(&self, [x, y]: [f32; 2], z: f32) -> [f32; 3] {
        let [a, b] = self.radii(y, z);
        let (u, v) = ((x / a) * (x / a), (y / b) * (y / b));
        let q = ((1.0 - self.squareness) * (u + v) + self.squareness * (u * u + v * v).sqrt()).sqrt();
        [x / q, y / q, z]
    }

    /// The y coordinate of the front surface at `(x, z)`, found by bisection. It is 0 if `x` is
    /// outside the outline.
    pub(super) fn front_at(&self, x: f32, z: f32) -> f32 {
        let (mut inside, mut outside) = (0.0, self.front.at(z));
        for _ in 0..32 {
            let middle = 0.5 * (inside + outside);
            let mut d = [f32::INFINITY];
            self.lower_row(&[x], middle, z, &mut d);
            *(if d[0] < 0.0 { &mut inside } else { &mut outside }) = middle;
        }
        inside
    }

    pub(super) fn bounds(&self) -> Bounds {
        let side = self.side.highest();
        Bounds {
            low: [-side, -self.back.highest(), f32::NEG_INFINITY],
            high: [side, self.front.highest(), f32::INFINITY],
        }
    }

    /// Lowers each `distance` to the signed distance of the outline, measured within the axial
    /// plane.
    pub(super) fn lower_row(&self, xs: &[f32], y: f32, z: f32, distance: &mut [f32]) {
        let [a, b] = self.radii(y, z);
        let (p, q) = (1.0 / a, 1.0 / b);
        for (d, &x) in distance.iter_mut().zip(xs) {
            let near =
                gauge_distance([x * p, y * q, 0.0], self.squareness, a.min(b), |h| [p * h[0], q * h[1], 0.0]);
            *d = d.min(near);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exit_and_front_points_lie_on_the_surface() {
        let outline = Outline {
            side: Profile::new([150.0; 7]),
            front: Profile::new([90.0, 100.0, 110.0, 105.0, 100.0, 95.0, 90.0]),
            back: Profile::new([80.0; 7]),
            squareness: 0.4,
        };
        let at = |p: [f32; 3]| {
            let mut d = [f32::INFINITY];
            outline.lower_row(&[p[0]], p[1], p[2], &mut d);
            d[0]
        };
        for (x, y) in [(1.0, 0.0), (0.3, 0.7), (-0.5, -0.5), (0.0, -2.0)] {
            assert!(at(outline.exit([x, y], 33.0)).abs() < 1e-3);
        }
        assert!(at([40.0, outline.front_at(40.0, -70.0), -70.0]).abs() < 1e-3);
        assert_eq!(outline.front_at(160.0, 0.0), 0.0);
    }
}
