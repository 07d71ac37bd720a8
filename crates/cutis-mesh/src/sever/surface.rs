//! Signed distance to a surface of triangles.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

/// The part of a triangle that is closest to a point.
#[derive(Clone, Copy)]
enum Feature {
    Face,
    /// The edge opposite to this corner.
    Edge(usize),
    Corner(usize),
}

/// The point of a surface that is closest to a position.
pub(super) struct Closest {
    /// Distance in m. It is positive on the side of the normals, and zero counts as positive.
    pub signed: f64,
    /// Number of the triangle.
    pub triangle: usize,
    /// Weights of the corners of the triangle. Their sum is 1.
    pub weights: [f64; 3],
}

/// An oriented surface of triangles, possibly with a border, in meters.
///
/// The sign of a distance comes from the normal of the closest face, edge or corner. The normal of
/// an edge is the mean of its faces, and that of a corner the mean of its faces, weighted by their
/// angles. So the sign is the same for all triangles that share the closest feature (Bærentzen and
/// Aanæs 2005, doi:10.1109/TVCG.2005.49).
#[derive(Debug)]
pub(super) struct Surface {
    corners: Vec<[Point3<f64>; 3]>,
    /// Normals of the face, of the three edges, and of the three corners of each triangle.
    normals: Vec<[Vector3<f64>; 7]>,
    /// Center and radius of a ball around each triangle.
    balls: Vec<(Point3<f64>, f64)>,
}

impl Surface {
    pub fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let corners: Vec<[Point3<f64>; 3]> =
            triangles.iter().map(|triangle| triangle.map(|p| points[p as usize])).collect();
        let faces: Vec<Vector3<f64>> = corners
            .iter()
            .map(|[a, b, c]| (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default())
            .collect();
        let mut of_edge: HashMap<[u32; 2], Vector3<f64>> = HashMap::new();
        let mut of_corner = vec![Vector3::zeros(); points.len()];
        let edge = |triangle: &[u32; 3], opposite: usize| {
            let [a, b] = [triangle[(opposite + 1) % 3], triangle[(opposite + 2) % 3]];
            [a.min(b), a.max(b)]
        };
        for ((triangle, corner), normal) in triangles.iter().zip(&corners).zip(&faces) {
            for n in 0..3 {
                *of_edge.entry(edge(triangle, n)).or_default() += normal;
                let [to, from] = [corner[(n + 1) % 3] - corner[n], corner[(n + 2) % 3] - corner[n]];
                of_corner[triangle[n] as usize] += normal * to.angle(&from);
            }
        }
        let normals = triangles.iter().zip(&faces).map(|(triangle, face)| {
            let [e0, e1, e2] = [0, 1, 2].map(|n| of_edge[&edge(triangle, n)]);
            let [c0, c1, c2] = triangle.map(|p| of_corner[p as usize]);
            [*face, e0, e1, e2, c0, c1, c2]
        });
        let ball = |[a, b, c]: &[Point3<f64>; 3]| {
            let center = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            (center, [a, b, c].into_iter().map(|p| (p - center).norm()).fold(0.0, f64::max))
        };
        Self { normals: normals.collect(), balls: corners.iter().map(ball).collect(), corners }
    }

    /// Smallest box around the surface: lower and upper corner.
    pub fn bounds(&self) -> [Point3<f64>; 2] {
        let all = self.corners.iter().flatten();
        let fold = |start: f64, least: fn(f64, f64) -> f64| {
            all.clone().fold(Point3::from([start; 3]), |bound, p| {
                Point3::from(std::array::from_fn(|axis| least(bound[axis], p[axis])))
            })
        };
        [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)]
    }

    /// The closest point within `reach` of a position.
    pub fn closest(&self, position: Point3<f64>, reach: f64) -> Option<Closest> {
        let mut best: Option<(f64, usize, [f64; 3], Feature)> = None;
        for (number, corners) in self.corners.iter().enumerate() {
            let limit = best.as_ref().map_or(reach, |(squared, ..)| squared.sqrt());
            let (center, radius) = self.balls[number];
            if (position - center).norm() > limit + radius {
                continue;
            }
            let (weights, feature) = closest_feature(corners, position);
            let squared = (position - at(corners, &weights)).norm_squared();
            if squared <= reach * reach && best.as_ref().is_none_or(|(least, ..)| squared < *least) {
                best = Some((squared, number, weights, feature));
            }
        }
        let (squared, triangle, weights, feature) = best?;
        let normals = &self.normals[triangle];
        let normal = match feature {
            Feature::Face => normals[0],
            Feature::Edge(opposite) => normals[1 + opposite],
            Feature::Corner(corner) => normals[4 + corner],
        };
        let side = (position - at(&self.corners[triangle], &weights)).dot(&normal);
        let distance = squared.sqrt();
        Some(Closest { signed: if side < 0.0 { -distance } else { distance }, triangle, weights })
    }
}

fn at(corners: &[Point3<f64>; 3], weights: &[f64; 3]) -> Point3<f64> {
    let sum = corners.iter().zip(weights).fold(Vector3::zeros(), |sum, (p, w)| sum + p.coords * *w);
    Point3::from(sum)
}

/// Weights of the corners at the point of a triangle that is closest to a position.
pub(crate) fn closest_in_triangle(corners: &[Point3<f64>; 3], position: Point3<f64>) -> [f64; 3] {
    closest_feature(corners, position).0
}

/// Weights of the corners at the closest point of a triangle, and the feature that it is on. It
/// tests the regions of the corners, then those of the edges (Ericson, Real-Time Collision
/// Detection, 2004, section 5.1.5).
fn closest_feature([a, b, c]: &[Point3<f64>; 3], p: Point3<f64>) -> ([f64; 3], Feature) {
    let (ab, ac) = (b - a, c - a);
    let dots = |from: &Point3<f64>| ((p - from).dot(&ab), (p - from).dot(&ac));
    let ((ab_a, ac_a), (ab_b, ac_b), (ab_c, ac_c)) = (dots(a), dots(b), dots(c));
    if ab_a <= 0.0 && ac_a <= 0.0 {
        return ([1.0, 0.0, 0.0], Feature::Corner(0));
    }
    if ab_b >= 0.0 && ac_b <= ab_b {
        return ([0.0, 1.0, 0.0], Feature::Corner(1));
    }
    if ac_c >= 0.0 && ab_c <= ac_c {
        return ([0.0, 0.0, 1.0], Feature::Corner(2));
    }
    let of_c = ab_a * ac_b - ab_b * ac_a;
    if of_c <= 0.0 && ab_a >= 0.0 && ab_b <= 0.0 {
        let part = ab_a / (ab_a - ab_b);
        return ([1.0 - part, part, 0.0], Feature::Edge(2));
    }
    let of_b = ab_c * ac_a - ab_a * ac_c;
    if of_b <= 0.0 && ac_a >= 0.0 && ac_c <= 0.0 {
        let part = ac_a / (ac_a - ac_c);
        return ([1.0 - part, 0.0, part], Feature::Edge(1));
    }
    let of_a = ab_b * ac_c - ab_c * ac_b;
    if of_a <= 0.0 && ac_b - ab_b >= 0.0 && ab_c - ac_c >= 0.0 {
        let part = (ac_b - ab_b) / ((ac_b - ab_b) + (ab_c - ac_c));
        return ([0.0, 1.0 - part, part], Feature::Edge(0));
    }
    let whole = of_a + of_b + of_c;
    ([of_a / whole, of_b / whole, of_c / whole], Feature::Face)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A roof with the ridge along y: two slopes of 45°.
    fn roof() -> Surface {
        let p = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
        let points = [
            p(-1.0, 0.0, 0.0),
            p(0.0, 0.0, 1.0),
            p(1.0, 0.0, 0.0),
            p(-1.0, 4.0, 0.0),
            p(0.0, 4.0, 1.0),
            p(1.0, 4.0, 0.0),
        ];
        Surface::new(&points, &[[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4]])
    }

    #[test]
    fn distances_to_a_roof_have_the_sign_of_their_side() {
        let roof = roof();
        let half = 0.5_f64.sqrt();
        for (at, expected) in [
            ([0.0, 2.0, 2.0], 1.0),
            ([0.0, 2.0, 0.0], -half),
            ([-1.0, 1.0, 1.0], half),
            ([0.2, 3.0, 0.0], -0.8 * half),
            ([0.0, 1.0, 1.0], 0.0),
        ] {
            let found = roof.closest(Point3::from(at), 10.0).unwrap();
            let down = (roof.normals[0][0].z).signum();
            assert!((found.signed * down - expected).abs() < 1e-12, "{at:?}: {}", found.signed);
        }
        assert!(roof.closest(Point3::new(0.0, 2.0, 3.1), 2.0).is_none());
    }

    #[test]
    fn weights_name_the_closest_point() {
        let roof = roof();
        for seed in 0..200 {
            let t = f64::from(seed);
            let p = Point3::new((1.3 * t).sin() * 2.0, (0.7 * t).cos() * 3.0 + 2.0, (2.1 * t).sin() * 2.0);
            let found = roof.closest(p, 10.0).unwrap();
            let q = at(&roof.corners[found.triangle], &found.weights);
            assert!(((p - q).norm() - found.signed.abs()).abs() < 1e-12);
            // No sampled point of the roof is closer.
            for corners in &roof.corners {
                for n in 0..=20 {
                    for m in 0..=20 - n {
                        let [u, v] = [n, m].map(|k| f64::from(k) / 20.0);
                        let other = at(corners, &[u, v, 1.0 - u - v]);
                        assert!((p - other).norm() >= found.signed.abs() - 1e-12);
                    }
                }
            }
        }
    }
}
