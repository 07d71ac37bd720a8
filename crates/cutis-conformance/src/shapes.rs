//! Random shapes of `N` points that are far from degenerate, and degenerate shapes.

use nalgebra::{Point3, Vector3};

use crate::random::Random;

/// Smallest thickness of a random shape: the least of the lengths of edges, the cross products of
/// triangles and the determinants of tetrahedra.
const THINNEST: f64 = 0.05;
/// Number of random shapes to try before the thickest one is taken.
const DRAWS: usize = 16;

/// Returns a random shape of points from −1 to 1 that is not degenerate.
pub(crate) fn solid<const N: usize>(random: &mut Random) -> [Point3<f64>; N] {
    let mut best = [Point3::origin(); N];
    let mut best_thickness = -1.0;
    for _ in 0..DRAWS {
        let x: [Point3<f64>; N] = std::array::from_fn(|_| random.point());
        let thickness = thickness(&x);
        if thickness > best_thickness {
            (best, best_thickness) = (x, thickness);
        }
        if best_thickness >= THINNEST {
            break;
        }
    }
    best
}

/// Returns the smallest edge length, triangle cross product or tetrahedron determinant among the
/// points.
fn thickness(x: &[Point3<f64>]) -> f64 {
    let mut least = f64::INFINITY;
    for (i, a) in x.iter().enumerate() {
        for (j, b) in x.iter().enumerate().skip(i + 1) {
            let ab = b - a;
            least = least.min(ab.norm());
            for (k, c) in x.iter().enumerate().skip(j + 1) {
                let normal = ab.cross(&(c - a));
                least = least.min(normal.norm());
                for d in x.iter().skip(k + 1) {
                    least = least.min(normal.dot(&(d - a)).abs());
                }
            }
        }
    }
    least
}

/// Degenerate shapes and their descriptions: all points at zero, at one place, on a line or in a
/// plane, and each pair of points at one place.
pub(crate) fn degenerate<const N: usize>() -> Vec<(String, [Point3<f64>; N])> {
    // These numbers are not round, so that no result is exact by chance.
    let (origin, along, across) =
        (Point3::new(0.1, -0.7, 1.3), Vector3::new(0.8, 1.0, -1.1), Vector3::new(-0.5, 1.5, -0.7));
    let step = |i: usize| i as f64 * (1.0 + i as f64) / 3.0;
    let mut shapes = vec![
        ("all at zero".to_owned(), [Point3::origin(); N]),
        ("all at one point".to_owned(), [origin; N]),
        ("on a line".to_owned(), std::array::from_fn(|i| origin + along * step(i))),
        ("on an axis".to_owned(), std::array::from_fn(|i| Point3::new(step(i), 0.0, 0.0))),
        (
            "in a plane".to_owned(),
            std::array::from_fn(|i| origin + along * step(i) + across * f64::from(i as u32 % 2)),
        ),
    ];
    let mut random = Random::new(2);
    for i in 0..N {
        for j in i + 1..N {
            let mut x = solid(&mut random);
            x[j] = x[i];
            shapes.push((format!("points {i} and {j} at one place"), x));
        }
    }
    shapes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_shapes_are_solid() {
        let mut random = Random::new(1);
        for _ in 0..1000 {
            assert!(thickness(&solid::<4>(&mut random)) > THINNEST / 5.0);
            assert!(thickness(&solid::<2>(&mut random)) > THINNEST);
        }
        assert_eq!(solid::<1>(&mut random).len(), 1);
        let eight = solid::<8>(&mut random);
        assert!(thickness(&eight) > 0.0);
    }

    #[test]
    fn degenerate_shapes_are_not_solid() {
        for (what, x) in degenerate::<4>() {
            assert!(thickness(&x) < 1e-12, "{what}");
        }
        assert_eq!(degenerate::<4>().len(), 5 + 6);
    }
}
