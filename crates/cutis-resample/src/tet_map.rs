//! One tet over the points of a grid, with the displacement of its corners.

use nalgebra::{Point3, Vector3};

/// Part of the tolerance that covers the rounding of `f64`, so that a point on a shared face is
/// inside both tets.
const ROUNDING: f64 = 1.0 / 1024.0;

/// A tet with a displacement that is linear in it. Places are continuous indices.
pub struct TetMap {
    /// Barycentric coordinates `constant + gradient · x`.
    gradient: [Vector3<f64>; 4],
    constant: [f64; 4],
    /// The tolerance as a difference of each coordinate.
    slack: [f64; 4],
    moves: [Vector3<f64>; 4],
    low: [f64; 3],
    high: [f64; 3],
}

impl TetMap {
    /// A tet by its corners and their displacements. `tolerance` is a length in voxels. `None` if
    /// the tet has no volume.
    pub fn new(corners: &[Point3<f64>; 4], moves: &[Vector3<f64>; 4], tolerance: f64) -> Option<Self> {
        let [a, b, c, d] = corners;
        let (ab, ac, ad) = (b - a, c - a, d - a);
        let normals = [ac.cross(&ad), ad.cross(&ab), ab.cross(&ac)];
        let scale = 1.0 / ab.dot(&normals[0]);
        let [g1, g2, g3] = normals.map(|normal| normal * scale);
        let gradient = [-(g1 + g2 + g3), g1, g2, g3];
        if !gradient.iter().all(|g| g.iter().all(|c| c.is_finite())) {
            return None;
        }
        let at_a = [1.0, 0.0, 0.0, 0.0];
        let (low, high) = corners.iter().fold((*a, *a), |(low, high), p| (low.inf(p), high.sup(p)));
        Some(Self {
            constant: std::array::from_fn(|c| at_a[c] - gradient[c].dot(&a.coords)),
            slack: gradient.map(|g| tolerance * g.norm()),
            gradient,
            moves: *moves,
            low: low.coords.add_scalar(-tolerance).into(),
            high: high.coords.add_scalar(tolerance).into(),
        })
    }

    /// Calls `visit(index, place, is_inside)` for the points of a grid that the tet holds or comes
    /// near.
    pub fn points(&self, shape: [usize; 3], mut visit: impl FnMut(usize, Vector3<f64>, bool)) {
        let span = |axis: usize| within(self.low[axis], self.high[axis], shape[axis]);
        let columns = span(0);
        for k in span(2) {
            for j in span(1) {
                let row = Vector3::new(0.0, j as f64, k as f64);
                let (mut low, mut high) = (columns.start as f64, columns.end as f64 - 1.0);
                for c in 0..4 {
                    let (at, along) = (self.constant[c] + self.gradient[c].dot(&row), self.gradient[c].x);
                    let bound = (-self.slack[c] - at) / along;
                    if along > 0.0 {
                        low = low.max(bound);
                    } else if along < 0.0 {
                        high = high.min(bound);
                    } else if at < -self.slack[c] {
                        high = -1.0;
                    }
                }
                for i in within(low, high, shape[0]) {
                    let place = Vector3::new(i as f64, row.y, row.z);
                    let inside = (0..4).all(|c| self.coordinate(c, &place) >= -ROUNDING * self.slack[c]);
                    visit(i + shape[0] * (j + shape[1] * k), place, inside);
                }
            }
        }
    }

    /// The displacement at a place. For a place just outside the barycentric coordinates are
    /// clamped to the tet.
    pub fn displacement_mm(&self, place: Vector3<f64>, is_inside: bool) -> Vector3<f64> {
        let mut weights: [f64; 4] = std::array::from_fn(|c| self.coordinate(c, &place));
        if !is_inside {
            let clamped = weights.map(|weight| weight.max(0.0));
            let sum: f64 = clamped.iter().sum();
            weights = clamped.map(|weight| weight / sum);
        }
        let [first, others @ ..] = &self.moves;
        (1..4).fold(*first, |sum, c| sum + (others[c - 1] - first) * weights[c])
    }

    fn coordinate(&self, corner: usize, place: &Vector3<f64>) -> f64 {
        self.constant[corner] + self.gradient[corner].dot(place)
    }
}

/// The integers from `low` to `high`, both included, that are below `end`.
fn within(low: f64, high: f64, end: usize) -> std::ops::Range<usize> {
    let (low, high) = (low.max(0.0), high.min(end as f64 - 1.0));
    if low <= high { low.ceil() as usize..high.floor() as usize + 1 } else { 0..0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tet_lists_its_points_and_a_flat_one_none() {
        let corners = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]].map(Point3::from);
        let moves = [[0.0; 3], [6.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 9.0]].map(Vector3::from);
        let map = TetMap::new(&corners, &moves, 1e-6).unwrap();
        let mut found = Vec::new();
        map.points([4, 4, 4], |index, place, inside| {
            assert!(inside && place.sum() <= 3.0 && index as f64 == place.dot(&Vector3::new(1.0, 4.0, 16.0)));
            let moved = map.displacement_mm(place, true);
            assert!((moved - Vector3::new(2.0 * place.x, 0.0, 3.0 * place.z)).norm() < 1e-12);
            found.push(index);
        });
        assert_eq!(found.len(), 20);
        let mut near = 0;
        let shifted = corners.map(|p| Point3::new(p.x + 5e-7, p.y, p.z));
        TetMap::new(&shifted, &moves, 1e-6).unwrap().points([4, 4, 4], |_, place, inside| {
            near += usize::from(!inside);
            assert_eq!(inside, place.x > 0.0);
        });
        assert_eq!(near, 10, "the points of one face");
        let flat = [corners[0], corners[1], corners[2], Point3::new(1.0, 1.0, 0.0)];
        assert!(TetMap::new(&flat, &moves, 1e-6).is_none());
    }
}
