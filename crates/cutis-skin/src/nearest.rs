//! Finds the nearest of many points.

use nalgebra::Point3;

/// Points in cubes as wide as the reach of a search.
pub(crate) struct Nearest<'a> {
    points: &'a [Point3<f64>],
    reach: f64,
    /// The cube and the number of each point, ascending.
    cubes: Vec<([i64; 3], usize)>,
}

impl<'a> Nearest<'a> {
    /// Prepares searches up to a distance `reach` above 0.
    pub fn new(points: &'a [Point3<f64>], reach: f64) -> Self {
        let mut cubes: Vec<_> = points.iter().enumerate().map(|(n, p)| (cube(p, reach), n)).collect();
        cubes.sort_unstable();
        Self { points, reach, cubes }
    }

    /// The number of the nearest point that is not farther than the reach. The lowest number wins a
    /// tie.
    pub fn within_reach(&self, at: &Point3<f64>) -> Option<usize> {
        let [x, y, z] = cube(at, self.reach);
        let mut best: Option<(f64, usize)> = None;
        for (dx, dy) in [-1, 0, 1].into_iter().flat_map(|dx| [-1, 0, 1].map(|dy| (dx, dy))) {
            let column = |dz: i64| [x.saturating_add(dx), y.saturating_add(dy), z.saturating_add(dz)];
            let start = self.cubes.partition_point(|(cube, _)| *cube < column(-1));
            let near = self.cubes[start..].iter().take_while(|(cube, _)| *cube <= column(1));
            for &(_, n) in near {
                let distance = (self.points[n] - at).norm();
                if distance <= self.reach && best.is_none_or(|best| (distance, n) < best) {
                    best = Some((distance, n));
                }
            }
        }
        best.map(|(_, n)| n)
    }

    /// Distance to the nearest point, by comparing all of them. Infinite if there are none.
    pub fn distance(&self, at: &Point3<f64>) -> f64 {
        self.points.iter().map(|point| (point - at).norm()).fold(f64::INFINITY, f64::min)
    }
}

/// The cube of a point. Casts saturate, so that far points share the outermost cubes.
fn cube(point: &Point3<f64>, width: f64) -> [i64; 3] {
    [point.x, point.y, point.z].map(|c| (c / width).floor() as i64)
}

#[cfg(test)]
mod tests {
    use cutis_test_kit::Random;

    use super::*;

    #[test]
    fn the_nearest_point_is_that_of_a_full_search() {
        let mut random = Random::new(5);
        for scale in [1e-3, 1.0, 1e3] {
            let points: Vec<Point3<f64>> = (0..300).map(|_| random.point() * scale).collect();
            let reach = 0.3 * scale;
            let nearest = Nearest::new(&points, reach);
            let (mut found, mut none) = (0, 0);
            for _ in 0..300 {
                let at = random.point() * (2.0 * scale);
                let full = (0..points.len())
                    .min_by(|&a, &b| (points[a] - at).norm().total_cmp(&(points[b] - at).norm()));
                let full = full.filter(|&n| (points[n] - at).norm() <= reach);
                assert_eq!(nearest.within_reach(&at), full);
                found += usize::from(full.is_some());
                none += usize::from(full.is_none());
            }
            assert!(found > 20 && none > 20, "{found} {none}");
        }
        let far = Point3::new(1e300, -1e300, f64::MAX);
        assert_eq!(Nearest::new(&[Point3::origin()], 1.0).within_reach(&far), None);
        assert_eq!(Nearest::new(&[], 1.0).distance(&far), f64::INFINITY);
    }
}
