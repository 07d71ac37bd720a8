//! Checks of the path of an incision.

use nalgebra::{Point3, Vector3};

use crate::MeshError;

/// Largest angle in degrees by which a path may turn at a point.
const SHARPEST_DEG: f64 = 150.0;

/// Least distance of two sides of an outline over the path between them. At an end with the
/// sharpest possible angle it is 0.259.
const POINTED: f64 = 0.25;

/// Largest number of points of a path. It limits the time of the checks.
const MOST_POINTS: usize = 1000;

/// Checks that a path has two points or more, does not turn back, and does not cross itself:
/// segments with two lattice steps or more of the path between them are at least one step apart.
pub(crate) fn check_path(incision: usize, path_mm: &[[f64; 3]], step_mm: f64) -> Result<(), MeshError> {
    check(path_mm, step_mm, false, "make two incisions")
        .map_err(|why| MeshError::IncisionPath { incision, why })
}

/// Checks that an outline, whose last point is the first one again, does not turn back or cross
/// itself. Its two sides may come closer than a step next to a pointed end. Returns what is wrong.
pub(crate) fn check_outline(path_mm: &[[f64; 3]], step_mm: f64) -> Result<(), String> {
    check(path_mm, step_mm, true, "round it off or make it larger")
}

fn check(path_mm: &[[f64; 3]], step_mm: f64, closed: bool, remedy: &str) -> Result<(), String> {
    let refuse = |why: String| Err(why);
    if path_mm.len() < 2 {
        return refuse(format!("it has {} points; give two or more", path_mm.len()));
    }
    if path_mm.len() > MOST_POINTS {
        return refuse(format!("it has {} points; give at most {MOST_POINTS}", path_mm.len()));
    }
    let points: Vec<Point3<f64>> = path_mm.iter().map(|&point| point.into()).collect();
    if !points.iter().all(|point| point.iter().all(|value| value.is_finite())) {
        return refuse("a coordinate is not a finite number".to_owned());
    }
    if let Some(n) = points.windows(2).position(|ends| ends[0] == ends[1]) {
        return refuse(format!("points {n} and {} are the same; leave one out", n + 1));
    }
    let around = points.iter().chain(points.get(1).filter(|_| closed)).copied().collect::<Vec<_>>();
    for (n, corner) in around.windows(3).enumerate() {
        let turn = (corner[1] - corner[0]).angle(&(corner[2] - corner[1])).to_degrees();
        if turn > SHARPEST_DEG {
            return refuse(format!(
                "it turns by {turn:.0}° at point {}; at most {SHARPEST_DEG}° are possible: {remedy}",
                n + 1
            ));
        }
    }
    let segments = points.len() - 1;
    // Length of the path up to each point.
    let mut passed = vec![0.0];
    points.windows(2).for_each(|ends| passed.push(passed[passed.len() - 1] + (ends[1] - ends[0]).norm()));
    for a in 0..segments {
        let between = |b: usize| {
            let forth = passed[b] - passed[a + 1];
            if closed { forth.min(passed[segments] - passed[b + 1] + passed[a]) } else { forth }
        };
        for b in (a + 2..segments).filter(|&b| between(b) >= 2.0 * step_mm) {
            let apart = distance([points[a], points[a + 1]], [points[b], points[b + 1]]);
            // Both sides of a piece may meet at a pointed end.
            let least = if closed { step_mm.min(POINTED * between(b)) } else { step_mm };
            if apart < least {
                return refuse(format!(
                    "segments {a} and {b} come within {apart:.1} mm of each other, less than a lattice step of \
                     {step_mm:.1} mm; {remedy}"
                ));
            }
        }
    }
    Ok(())
}

/// Distance between two segments: where their lines come closest, if that is within both, or from
/// one of the ends.
fn distance([a, b]: [Point3<f64>; 2], [c, d]: [Point3<f64>; 2]) -> f64 {
    let (u, v) = (b - a, d - c);
    let closest = |from: Point3<f64>, along: Vector3<f64>, to: Point3<f64>| {
        ((to - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0)
    };
    // The interior minimum, if the segments are not parallel.
    let normal = u.cross(&v).norm_squared();
    let mut best = f64::INFINITY;
    if normal > 1e-12 * u.norm_squared() * v.norm_squared() {
        let w = c - a;
        let (s, t) = (w.cross(&v).dot(&u.cross(&v)) / normal, w.cross(&u).dot(&u.cross(&v)) / normal);
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            best = ((a + u * s) - (c + v * t)).norm();
        }
    }
    for point in [a, b] {
        best = best.min((c + v * closest(c, v, point) - point).norm());
    }
    for point in [c, d] {
        best = best.min((a + u * closest(a, u, point) - point).norm());
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(path: &[[f64; 3]]) -> String {
        check_path(3, path, 4.0).unwrap_err().to_string()
    }

    #[test]
    fn paths_that_cannot_be_cut_are_refused_by_name() {
        assert!(refused(&[[0.0; 3]]).contains("1 points"));
        assert!(refused(&vec![[0.0; 3]; 1001]).contains("at most 1000"));
        assert!(refused(&[[0.0; 3], [0.0; 3]]).contains("points 0 and 1"));
        assert!(refused(&[[0.0; 3], [f64::NAN, 0.0, 0.0]]).contains("finite"));
        assert!(refused(&[[0.0; 3], [20.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).contains("turns by 17"));
        let crossing = [[0.0; 3], [40.0, 0.0, 0.0], [40.0, 40.0, 0.0], [20.0, 40.0, 0.0], [20.0, -20.0, 0.0]];
        let text = refused(&crossing);
        assert!(text.contains("incision 3") && text.contains("segments 0 and 3"), "{text}");
        assert!(check_path(0, &[[0.0; 3], [20.0, 0.0, 0.0], [30.0, 15.0, 0.0]], 4.0).is_ok());
        // Control: the same shape with its parts farther apart.
        let open = [[0.0; 3], [40.0, 0.0, 0.0], [40.0, 40.0, 0.0], [20.0, 40.0, 0.0], [20.0, 10.0, 0.0]];
        assert!(check_path(0, &open, 4.0).is_ok());
    }

    /// Controls: a path with the same points, and an outline with a narrow middle.
    #[test]
    fn the_sides_of_an_outline_may_meet_at_a_pointed_end() {
        let lens = |middle: f64| {
            let side = |sign: f64| {
                [0.0, 6.0, 12.0, 18.0, 24.0, 30.0, 36.0].map(move |x: f64| {
                    let half = 0.28 * x.min(36.0 - x);
                    [x, sign * if x == 18.0 { middle } else { half }, 0.0]
                })
            };
            side(-1.0).into_iter().chain(side(1.0).into_iter().rev().skip(1)).collect::<Vec<[f64; 3]>>()
        };
        assert_eq!(check_outline(&lens(5.0), 4.0), Ok(()));
        assert!(check_path(0, &lens(5.0), 4.0).is_err());
        assert!(check_outline(&lens(1.0), 4.0).unwrap_err().contains("of each other"));
    }

    #[test]
    fn distances_between_segments_are_those_of_dense_samples() {
        let p = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
        let cases = [
            ([p(0.0, 0.0, 0.0), p(10.0, 0.0, 0.0)], [p(3.0, 4.0, -5.0), p(3.0, 4.0, 5.0)]),
            ([p(0.0, 0.0, 0.0), p(10.0, 0.0, 0.0)], [p(12.0, 1.0, 0.0), p(20.0, 3.0, 1.0)]),
            ([p(0.0, 0.0, 0.0), p(10.0, 2.0, 0.0)], [p(1.0, 3.0, 0.0), p(11.0, 5.0, 0.0)]),
        ];
        for ([a, b], [c, d]) in cases {
            let mut least = f64::INFINITY;
            for s in 0..=400 {
                for t in 0..=400 {
                    let [s, t] = [s, t].map(|n| f64::from(n) / 400.0);
                    least = least.min(((a + (b - a) * s) - (c + (d - c) * t)).norm());
                }
            }
            assert!((distance([a, b], [c, d]) - least).abs() < 1e-2, "{least}");
        }
    }
}
