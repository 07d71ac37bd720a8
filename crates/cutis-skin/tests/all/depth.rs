//! Depths below the skin, against a comparison with every triangle.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use cutis_mesh::{Grading, Lattice, Planes, Split};
use cutis_skin::{SkinError, depth_mm};
use cutis_test_kit::Random;
use nalgebra::{Matrix3, Point3, Vector3};

use crate::shapes::{Body, grid, lattice};

/// Largest error in units of the shortest lattice step.
const TOLERANCE: f64 = 0.2;

fn ball() -> Body {
    Body::binary(lattice(25, Matrix3::identity() * 2.0), |p| {
        (p.coords - Vector3::new(0.3, 0.1, -0.4)).norm() - 19.0
    })
}

/// A body with bumps, dents and holes.
fn blob(seed: u64, lattice: Lattice, size: f64) -> Body {
    let mut random = Random::new(seed);
    let waves: Vec<(Vector3<f64>, f64)> =
        (0..6).map(|_| (random.vector() * (5.0 / size), random.between(0.0, 6.0))).collect();
    Body::binary(lattice, move |p| {
        let bumps: f64 = waves.iter().map(|(wave, phase)| (wave.dot(&p.coords) + phase).sin()).sum();
        p.coords.norm() / size + 0.15 * bumps - 1.0
    })
}

/// Distance from a point to a triangle: the smallest over a fine grid of its points, refined.
fn distance_to_triangle(at: Point3<f64>, [a, b, c]: [Point3<f64>; 3]) -> f64 {
    // Projected descent on the barycentric coordinates (s, t), which is convex.
    let (u, v, d) = (b - a, c - a, at - a);
    let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
    let value = |s: f64, t: f64| (d - u * s - v * t).norm();
    let best_t = |s: f64| ((d.dot(&v) - s * uv) / vv).clamp(0.0, 1.0 - s);
    let best_s = |t: f64| ((d.dot(&u) - t * uv) / uu).clamp(0.0, 1.0 - t);
    let on_hypotenuse = {
        let way = c - b;
        let s = ((at - b).dot(&way) / way.dot(&way)).clamp(0.0, 1.0);
        value(1.0 - s, s)
    };
    let inside = {
        let determinant = uu * vv - uv * uv;
        let (s, t) = (
            (vv * d.dot(&u) - uv * d.dot(&v)) / determinant,
            (uu * d.dot(&v) - uv * d.dot(&u)) / determinant,
        );
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 { value(s, t) } else { f64::INFINITY }
    };
    [inside, on_hypotenuse, value(0.0, best_t(0.0)), value(best_s(0.0), 0.0)]
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// Distances at the vertices of the body by comparing all triangles.
fn brute_force(body: &Body) -> Vec<(usize, f64)> {
    let grid = body.lattice.grid();
    let corners: Vec<_> = body.triangles.iter().map(|triangle| body.corners(triangle)).collect();
    let distance = |point: usize| {
        let at = body.lattice.mm(grid.point(point));
        corners.iter().map(|&corners| distance_to_triangle(at, corners)).fold(f64::INFINITY, f64::min)
    };
    (0..grid.len()).filter(|&point| body.vertices[point]).map(|point| (point, distance(point))).collect()
}

/// Largest error, and the share of exact values.
fn errors(found: &[f32], exact: &[(usize, f64)], step_mm: f64) -> (f64, f64) {
    let error = |&(point, exact): &(usize, f64)| (f64::from(found[point]) - exact).abs() / step_mm;
    let all: Vec<f64> = exact.iter().map(error).collect();
    let share = all.iter().filter(|&&error| error < 1e-5).count() as f64 / all.len() as f64;
    (all.into_iter().fold(0.0, f64::max), share)
}

/// The shortest ways along lattice edges from the skin.
fn along_edges(body: &Body) -> Vec<f32> {
    let grid = *body.lattice.grid();
    let mut depth = vec![f32::INFINITY; grid.len()];
    let mut queue: BinaryHeap<Reverse<(u64, usize)>> =
        body.triangles.iter().flatten().map(|&point| Reverse((0, point as usize))).collect();
    while let Some(Reverse((bits, point))) = queue.pop() {
        let distance = f64::from_bits(bits);
        if depth[point] <= distance as f32 {
            continue;
        }
        depth[point] = distance as f32;
        let [i, j, k] = grid.point(point);
        // The seven directions of Kuhn's edges.
        for corner in 1..8usize {
            for down in [false, true] {
                let step = |c: usize, axis: usize, n: usize| {
                    let by = corner >> axis & 1;
                    if down { c.checked_sub(by) } else { Some(c + by).filter(|&c| c < n) }
                };
                let Some(a) = step(i, 0, grid.shape[0]) else { continue };
                let Some(b) = step(j, 1, grid.shape[1]) else { continue };
                let Some(c) = step(k, 2, grid.shape[2]) else { continue };
                let length = (body.lattice.mm([a, b, c]) - body.lattice.mm([i, j, k])).norm();
                queue.push(Reverse(((distance + length).to_bits(), grid.index([a, b, c]))));
            }
        }
    }
    depth
}

#[test]
fn depths_are_the_distances_to_the_nearest_triangle() {
    let uneven = Matrix3::new(1.0, 0.0, 0.2, 0.0, 1.2, 0.0, 0.0, 0.0, 2.0);
    let even = grid(41, Matrix3::identity());
    let planes = Planes::new(&even, [[16.0, 24.0]; 3], &Grading { growth: 1.5, coarsest: 3.0 }).unwrap();
    let graded = Lattice::graded(even, Split::Kuhn6, planes).unwrap();
    let bodies = [
        ("ball", ball(), 2.0),
        ("blob", blob(1, lattice(25, Matrix3::identity() * 2.0), 19.0), 2.0),
        ("uneven blob", blob(2, lattice(25, uneven), 12.0), 1.0),
        ("graded blob", blob(3, graded, 15.0), 1.0),
    ];
    for (name, body, step_mm) in bodies {
        let exact = brute_force(&body);
        let deepest = exact.iter().map(|&(_, distance)| distance).fold(0.0, f64::max);
        assert!(exact.len() > 1500 && deepest > 4.0 * step_mm, "{name}: {} {deepest}", exact.len());
        let found = depth_mm(&body.skin(), f64::INFINITY).unwrap();
        let (worst, share) = errors(&found, &exact, step_mm);
        eprintln!("{name}: largest error {worst:.3} steps, exact at {:.1} %", 100.0 * share);
        assert!(worst <= TOLERANCE && share > 0.998, "{name}: {worst} {share}");
        let elsewhere = (0..found.len()).filter(|&point| !body.vertices[point]);
        assert!(elsewhere.into_iter().all(|point| found[point] == f32::INFINITY));
        body.triangles.iter().flatten().for_each(|&point| assert_eq!(found[point as usize], 0.0));
        // Control: ways along edges are too long.
        assert!(errors(&along_edges(&body), &exact, step_mm).0 > 3.0 * TOLERANCE, "{name}");
    }
}

#[test]
fn the_limit_cuts_off_without_changing_other_depths() {
    let body = blob(4, lattice(21, Matrix3::identity() * 2.0), 16.0);
    let all = depth_mm(&body.skin(), f64::INFINITY).unwrap();
    for limit in [0.5, 3.0, 7.3] {
        let found = depth_mm(&body.skin(), limit).unwrap();
        for (cut, full) in found.iter().zip(&all) {
            let expected = if f64::from(*full) <= limit { *full } else { f32::INFINITY };
            assert!((cut - expected).abs() < 1e-6 || *cut == expected, "{limit}: {cut} {full}");
        }
    }
    assert!(all.iter().any(|&depth| depth > 7.3 && depth.is_finite()));
    for limit in [0.0, -1.0, f64::NAN] {
        let refused = depth_mm(&body.skin(), limit);
        assert!(matches!(refused, Err(SkinError::Distance { key: "limit_mm", .. })), "{limit}");
    }
    let empty = Body { triangles: Vec::new(), ..body };
    assert!(depth_mm(&empty.skin(), 5.0).unwrap().iter().all(|depth| depth.is_infinite()));
}
