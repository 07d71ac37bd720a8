//! A strip that is pulled aside comes to rest with its energy in two constraints, and keeps moving
//! with all of it in one.

use cutis_constraints::{Constraint, Distance, Eval, SkinStripAtRest, SkinStripTurn};
use nalgebra::{Point3, Vector3};

/// Frames of one iteration. The last hundred are measured.
const STEPS: usize = 4000;
/// Part of the velocity that a step keeps.
const KEPT: f64 = 0.9;

/// Weights of a strip from the first vertex to the third, its length and its stretch in the scan.
const SCAN: Vector3<f64> = Vector3::new(1.0, 0.0, 0.0);
const STRETCH: f64 = 0.1;

/// The strip's value and its gradient at the free end.
type Part = fn(&Point3<f64>) -> (f64, Vector3<f64>);

fn with_origin(end: &Point3<f64>) -> [Point3<f64>; 3] {
    [*end, Point3::origin(), Point3::origin()]
}

fn along(end: &Point3<f64>) -> (f64, Vector3<f64>) {
    let Eval { c, grad } =
        SkinStripAtRest::eval(&with_origin(end), &[1.0, 0.0, 1.0 - STRETCH, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    (c, grad[0])
}

fn turn(end: &Point3<f64>) -> (f64, Vector3<f64>) {
    let Eval { c, grad } =
        SkinStripTurn::eval(&with_origin(end), &[1.0, 0.0, SCAN.x, SCAN.y, SCAN.z, STRETCH, 0.0, 0.0, 0.0]);
    (c, grad[0])
}

/// One constraint with the whole energy: the root of the sum of the squares.
fn whole(end: &Point3<f64>) -> (f64, Vector3<f64>) {
    let ((c1, g1), (c2, g2)) = (along(end), turn(end));
    let c = c1.hypot(c2);
    if c > 0.0 { (c, (g1 * c1 + g2 * c2) / c) } else { (0.0, Vector3::zeros()) }
}

/// Steps the free end of a strip, of inverse mass `w`, with a spring to a point at its side. The
/// unit of compliance is that of the strip, with a time step of 1. Returns the mean length of the
/// strip and its range over the last steps.
fn settle(parts: &[Part], w: f64) -> (f64, f64) {
    let side = Point3::new(0.9, 0.4, 0.1);
    let mut x = Point3::from(SCAN);
    let mut velocity = Vector3::zeros();
    let mut lengths = Vec::new();
    for _ in 0..STEPS {
        let start = x;
        x += velocity;
        let mut correct = |compliance: f64, (c, grad): (f64, Vector3<f64>)| {
            x -= grad * (w * c / (w * grad.norm_squared() + compliance));
            x
        };
        let spring = Distance::eval(&[start + velocity, side], &[0.0]);
        let mut moved = correct(1.0 / STRETCH, (spring.c, spring.grad[0]));
        for part in parts {
            moved = correct(1.0, part(&moved));
        }
        velocity = (x - start) * KEPT;
        lengths.push(x.coords.norm());
    }
    let last = &lengths[STEPS - 100..];
    let (least, most) = last.iter().fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
    (last.iter().sum::<f64>() / last.len() as f64, most - least)
}

#[test]
fn two_constraints_come_to_rest_and_one_does_not() {
    for w in [3.0, 10.0, 30.0] {
        let (length, range) = settle(&[along, turn], w);
        println!("w {w}: two constraints: length {length:.4}, range {range:.1e}");
        assert!(range < 1e-12 && (length - 1.0).abs() < 0.02, "{length} {range}");
        let (length, range) = settle(&[whole], w);
        println!("w {w}: one constraint: length {length:.4}, range {range:.1e}");
        assert!(range > 0.02, "{length} {range}");
    }
}
