//! Fewer points for a large surface: points that lie close together and are connected become one.

use nalgebra::{Point3, Vector3};

/// Distance from the wounds at which cells are twice as wide as next to them, m.
const NEAR: f64 = 0.015;

/// Largest width of the cells, over that next to the wounds, as a power of two.
const WIDEST: f64 = 4.0;

/// Factor by which the cells grow in each round.
const GROWTH: f64 = 1.25;

/// Largest number of triangles for each point of the limit.
pub(super) const TRIANGLES_PER_POINT: usize = 3;

/// What is left of a surface.
#[derive(Debug, PartialEq)]
pub(super) struct Reduced {
    /// Numbers of the points that are left, ascending.
    pub(super) points: Vec<u32>,
    /// Triangles in positions of `points`.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Reduces a surface to at most `most` points and [`TRIANGLES_PER_POINT`] times as many triangles.
/// A surface that has no more keeps all that its triangles use.
///
/// A point stays where it is or goes. Space is divided into cells, which are narrow next to the
/// wounds and wider away from them. Points of one cell that edges within the cell connect become
/// the one that is next to their mean. The lips of a closed cut lie in the same cells, but no edge
/// connects them, so they stay apart. `from_wounds` returns the distance of a point, m.
pub(super) fn reduce(
    rest: &[Point3<f32>],
    triangles: &[[u32; 3]],
    from_wounds: &dyn Fn(Point3<f32>) -> f64,
    most: usize,
) -> Reduced {
    let mut keep: Vec<u32> = (0..rest.len() as u32).collect();
    let mut reduced = compact(triangles, &keep);
    if fits(&reduced, most) {
        return reduced;
    }
    let level = |point: &Point3<f32>| {
        let away = (from_wounds(*point) / NEAR + 1.0).log2();
        if away.is_finite() { away.clamp(0.0, WIDEST) as i32 } else { 0 }
    };
    let levels: Vec<i32> = rest.iter().map(level).collect();
    let (low, high) = bounds(rest);
    let extent = f64::from((high - low).amax());
    let extent = if extent.is_finite() && extent > 0.0 { extent } else { 1.0 };
    // A surface of `most` points has cells of about this width.
    let mut width = extent / (most.max(1) as f64).sqrt() / 8.0;
    while !fits(&reduced, most) {
        let cell = |n: usize| {
            let width = width * f64::from(1 << levels[n]);
            let at: Vector3<f64> = (rest[n] - low).cast() / width;
            (levels[n], [at.x as i64, at.y as i64, at.z as i64])
        };
        let cells: Vec<_> = (0..rest.len()).map(cell).collect();
        let mut groups = Groups::new(rest.len());
        for [a, b] in triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]) {
            if cells[a as usize] == cells[b as usize] {
                groups.join(a, b);
            }
        }
        if width > 4.0 * extent {
            // Each level is one cell now. Parts that no edge connects are still too many.
            let mut first: [Option<u32>; WIDEST as usize + 1] = [None; WIDEST as usize + 1];
            for n in 0..rest.len() as u32 {
                let first = *first[levels[n as usize] as usize].get_or_insert(n);
                groups.join(first, n);
            }
        }
        keep = groups.representatives(rest);
        reduced = compact(triangles, &keep);
        width *= GROWTH;
    }
    reduced
}

fn fits(reduced: &Reduced, most: usize) -> bool {
    reduced.points.len() <= most && reduced.triangles.len() <= TRIANGLES_PER_POINT * most
}

/// The triangles of a surface after each point has become another one. Triangles without area and
/// doubles go.
fn compact(triangles: &[[u32; 3]], became: &[u32]) -> Reduced {
    let now = triangles.iter().map(|corners| corners.map(|v| became[v as usize]));
    let mut left: Vec<[u32; 3]> = now.filter(|&[a, b, c]| a != b && b != c && c != a).collect();
    let sorted = |triangle: &[u32; 3]| {
        let mut corners = *triangle;
        corners.sort_unstable();
        corners
    };
    left.sort_by_key(sorted);
    left.dedup_by_key(|triangle| sorted(triangle));
    let mut points: Vec<u32> = left.iter().flatten().copied().collect();
    points.sort_unstable();
    points.dedup();
    let place = |v: u32| points.partition_point(|&point| point < v) as u32;
    let triangles = left.iter().map(|corners| corners.map(place)).collect();
    Reduced { points, triangles }
}

fn bounds(points: &[Point3<f32>]) -> (Point3<f32>, Point3<f32>) {
    let ends = (Point3::from([f32::INFINITY; 3]), Point3::from([f32::NEG_INFINITY; 3]));
    points.iter().fold(ends, |(low, high), point| (low.inf(point), high.sup(point)))
}

/// Disjoint groups of points.
struct Groups {
    parent: Vec<u32>,
}

impl Groups {
    fn new(points: usize) -> Self {
        Self { parent: (0..points as u32).collect() }
    }

    /// The lowest point of a group.
    fn first(&mut self, mut point: u32) -> u32 {
        while self.parent[point as usize] != point {
            let above = self.parent[self.parent[point as usize] as usize];
            self.parent[point as usize] = above;
            point = above;
        }
        point
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.first(a), self.first(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// For each point, the point of its group that is next to the mean of the group.
    fn representatives(&mut self, rest: &[Point3<f32>]) -> Vec<u32> {
        let firsts: Vec<u32> = (0..rest.len() as u32).map(|n| self.first(n)).collect();
        let mut sums = vec![(Vector3::<f64>::zeros(), 0.0); rest.len()];
        for (&first, point) in firsts.iter().zip(rest) {
            let (sum, count) = &mut sums[first as usize];
            *sum += point.coords.cast::<f64>();
            *count += 1.0;
        }
        let mut best = vec![(f64::INFINITY, 0); rest.len()];
        for (n, (&first, point)) in firsts.iter().zip(rest).enumerate() {
            let (sum, count) = sums[first as usize];
            let away = (point.coords.cast::<f64>() - sum / count).norm();
            if away < best[first as usize].0 {
                best[first as usize] = (away, n as u32);
            }
        }
        // A group whose positions are not numbers has no nearest point.
        let of =
            |&first: &u32| Some(best[first as usize]).filter(|best| best.0.is_finite()).map(|best| best.1);
        firsts.iter().map(|first| of(first).unwrap_or(*first)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square sheet of `n` × `n` points that are 1 mm apart, at a height in m.
    fn sheet(n: u32, height: f32) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
        let at = |k: u32| Point3::new((k % n) as f32 * 1e-3, (k / n) as f32 * 1e-3, height);
        let cells = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| i + n * j));
        let triangles = cells.flat_map(|k| [[k, k + 1, k + n], [k + 1, k + n + 1, k + n]]);
        ((0..n * n).map(at).collect(), triangles.collect())
    }

    #[test]
    fn a_small_surface_stays_as_it_is() {
        let (rest, mut triangles) = sheet(12, 0.0);
        let reduced = reduce(&rest, &triangles, &|_| 0.0, 144);
        assert_eq!(reduced.points, (0..144).collect::<Vec<u32>>());
        let mut found = reduced.triangles;
        triangles.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, triangles);
    }

    #[test]
    fn the_limit_holds_for_each_size_and_no_triangle_is_lost_to_a_wrong_number() {
        for (n, most) in [(13, 100), (60, 100), (200, 1000), (300, 7)] {
            let (rest, triangles) = sheet(n, 0.0);
            let reduced = reduce(&rest, &triangles, &|_| 0.0, most);
            assert!(reduced.points.len() <= most, "{n}: {}", reduced.points.len());
            assert!(reduced.triangles.len() <= TRIANGLES_PER_POINT * most);
            let used = reduced.triangles.iter().flatten().max().map(|&v| v as usize + 1);
            assert_eq!(used.unwrap_or(0), reduced.points.len());
            // Far fewer points than the limit would be a waste.
            assert!(most < 50 || reduced.points.len() > most / 4, "{n}: {}", reduced.points.len());
        }
    }

    /// Parts that nothing connects, places that are not numbers, and points that are all in one
    /// place.
    #[test]
    fn the_limit_holds_for_surfaces_that_are_none() {
        let apart: Vec<[u32; 3]> = (0..2000).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        let place = |of: &dyn Fn(f32) -> f32| (0..6000).map(|n| Point3::from([of(n as f32); 3])).collect();
        let places: [Vec<Point3<f32>>; 3] = [place(&|n| n * 1e-3), place(&|_| f32::NAN), place(&|_| 0.0)];
        for rest in &places {
            for distance in [0.0, f64::NAN, f64::INFINITY] {
                assert!(reduce(rest, &apart, &|_| distance, 50).points.len() <= 50);
            }
        }
        // The corners of each triangle have cells of three widths, so that none becomes a line.
        let distance = |point: Point3<f32>| [0.0, 0.05, 0.2][(point.x * 1e3).round() as usize % 3];
        for first in [0.0, f32::INFINITY, f32::NAN] {
            let mut rest = places[0].clone();
            rest[0].x = first;
            let left = reduce(&rest, &apart, &distance, 50).points.len();
            assert!((1..=50).contains(&left), "{left} points");
        }
    }

    /// Two sheets in one place, as the lips of a closed cut are.
    #[test]
    fn lips_stay_apart_and_the_surface_next_to_wounds_stays_fine() {
        let (mut rest, mut triangles) = sheet(80, 0.0);
        let (other, more) = sheet(80, 1e-6);
        triangles.extend(more.iter().map(|corners| corners.map(|v| v + rest.len() as u32)));
        rest.extend(other);
        let distance = |point: Point3<f32>| f64::from(point.x);
        let reduced = reduce(&rest, &triangles, &distance, 4000);
        let lower = |v: &u32| reduced.points[*v as usize] < 6400;
        let mixed = reduced.triangles.iter().filter(|t| t.iter().any(lower) != t.iter().all(lower));
        assert_eq!(mixed.count(), 0);
        let of_lower = (0..reduced.points.len() as u32).filter(lower).count();
        let of_upper = reduced.points.len() - of_lower;
        assert!(of_lower > 500 && of_lower.abs_diff(of_upper) < 10, "{of_lower} and {of_upper} points");
        let share = |range: std::ops::Range<f32>| {
            let within = |point: &Point3<f32>| range.contains(&point.x);
            let left = reduced.points.iter().filter(|&&v| within(&rest[v as usize])).count();
            left as f64 / rest.iter().filter(|point| within(point)).count() as f64
        };
        let (near, far) = (share(0.0..0.01), share(0.06..0.08));
        assert!(near > 2.0 * far, "{near} next to the wound, {far} away from it");
    }
}
