//! Smooth curves: a value that varies along the body, and a path through points in space.

/// The first and last knots are at `∓REACH_MM`. A profile is constant beyond them.
const REACH_MM: f32 = 300.0;
const KNOTS: usize = 7;

/// A quantity along z: a Catmull–Rom spline through seven values, at −300, −200, …, 300 mm.
#[derive(Clone, Copy)]
pub(super) struct Profile([f32; KNOTS]);

impl Profile {
    pub(super) fn new(values: [f32; KNOTS]) -> Self {
        Self(values)
    }

    /// The value at height `z` in mm.
    pub(super) fn at(&self, z: f32) -> f32 {
        let last = KNOTS - 1;
        let s = ((z + REACH_MM) * (last as f32 / (2.0 * REACH_MM))).clamp(0.0, last as f32);
        let k = (s as usize).min(last - 1);
        let knots = [k.saturating_sub(1), k, k + 1, (k + 2).min(last)];
        catmull_rom(knots.map(|n| self.0[n]), s - k as f32)
    }

    /// The sum of this profile and the scaled `other`.
    pub(super) fn plus(&self, other: &Self, scale: f32) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + scale * other.0[k]))
    }

    /// This profile with all values scaled.
    pub(super) fn scaled(&self, scale: f32) -> Self {
        Self(self.0.map(|v| scale * v))
    }

    /// An upper bound of the curve: the largest knot plus the largest possible overshoot.
    pub(super) fn highest(&self) -> f32 {
        let (low, high) =
            self.0.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
        // Between knots the sum of the two outer weights of Catmull–Rom is not below −1/8.
        high + 0.125 * (high - low)
    }
}

/// Value of the uniform Catmull–Rom spline between `p[1]` and `p[2]`.
fn catmull_rom(p: [f32; 4], t: f32) -> f32 {
    let slope = 0.5 * (p[2] - p[0]);
    let curve = p[0] - 2.5 * p[1] + 2.0 * p[2] - 0.5 * p[3];
    let twist = 0.5 * (p[3] - p[0]) + 1.5 * (p[1] - p[2]);
    p[1] + t * (slope + t * (curve + t * twist))
}

/// A smooth path through `[x, y, z, radius]` points, with `steps` pieces between neighbors.
pub(super) fn smooth_path(points: &[[f32; 4]], steps: usize) -> Vec<[f32; 4]> {
    let Some(last) = points.len().checked_sub(1) else { return Vec::new() };
    let mut path = Vec::with_capacity(last * steps + 1);
    for k in 0..last {
        let around = [k.saturating_sub(1), k, k + 1, (k + 2).min(last)];
        path.extend((0..steps).map(|step| {
            let t = step as f32 / steps as f32;
            std::array::from_fn(|c| catmull_rom(around.map(|n| points[n][c]), t))
        }));
    }
    path.push(points[last]);
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profile_passes_through_its_knots_and_is_constant_beyond() {
        let profile = Profile::new([1.0, 4.0, 9.0, 2.0, 5.0, 7.0, 3.0]);
        for (k, value) in [1.0, 4.0, 9.0, 2.0, 5.0, 7.0, 3.0].into_iter().enumerate() {
            assert!((profile.at(-300.0 + 100.0 * k as f32) - value).abs() < 1e-5);
        }
        assert_eq!((profile.at(-900.0), profile.at(900.0)), (1.0, 3.0));
        assert!((0..=600).all(|z| profile.at(z as f32 - 300.0) <= profile.highest()));
    }

    #[test]
    fn path_passes_through_its_points() {
        let points = [[0.0, 0.0, 0.0, 1.0], [10.0, 0.0, 5.0, 2.0], [10.0, 8.0, 9.0, 1.0]];
        let path = smooth_path(&points, 4);
        assert_eq!(path.len(), 9);
        assert_eq!([path[0], path[4], path[8]], points);
        assert!(smooth_path(&[], 4).is_empty());
    }
}
