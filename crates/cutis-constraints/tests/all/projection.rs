//! One projection removes the error to first order at every scale and does not overshoot. The
//! volume gradient needs the factor 1/6.

use cutis_constraints::{Constraint, Distance, Eval, SkinTension, SkinTensionMaterial, SkinTensionPaper};
use cutis_constraints::{SkinTensionPaperMaterial, Volume};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use crate::checks::project;
use crate::shapes::{SCALES, shape};

/// A regular tetrahedron centered at the origin.
fn regular(scale: f64) -> [Point3<f64>; 4] {
    [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]]
        .map(|p| Point3::from(p) * scale)
}

/// Fraction of the error `C` that remains after one projection.
fn remaining<const N: usize>(eval: impl Fn(&[Point3<f64>; N]) -> Eval<f64, N>, x: &[Point3<f64>; N]) -> f64 {
    let before = eval(x);
    eval(&project(x, &[1.0; N], &before)).c / before.c
}

/// Without the 1/6, as in a widely copied implementation, the gradient is six times too long and
/// 5/6 of the error remain.
#[test]
fn volume_gradient_without_the_sixth_leaves_83_percent() {
    for scale in SCALES {
        let x = regular(scale);
        let volume = Volume::eval(&x, &[0.0]).c;
        let params = [volume / 1.001];
        let right = remaining(|x| Volume::eval(x, &params), &x);
        let wrong = remaining(
            |x| {
                let Eval { c, grad } = Volume::eval(x, &params);
                Eval { c, grad: grad.map(|g| g * 6.0) }
            },
            &x,
        );
        assert!(right.abs() < 1e-3, "{right}");
        assert!((wrong - 5.0 / 6.0).abs() < 1e-3, "{wrong}");
    }
}

#[test]
fn a_unit_tetrahedron_has_a_sixth_of_the_cube() {
    let x: [Point3<f64>; 4] = [
        Point3::origin(),
        Point3::new(1.0, 0.0, 0.0),
        Point3::new(0.0, 1.0, 0.0),
        Point3::new(0.0, 0.0, 1.0),
    ];
    let Eval { c, grad } = Volume::eval(&x, &[0.0]);
    assert!((c - 1.0 / 6.0).abs() < 1e-16);
    assert_eq!(grad[1] * 6.0, Vector3::x());
    let mirrored = [x[0], x[2], x[1], x[3]];
    assert!((Volume::eval(&mirrored, &[0.0]).c + 1.0 / 6.0).abs() < 1e-16);
}

/// A distance is linear along its gradient. One projection ends at the rest length for any masses.
#[test]
fn a_distance_projection_is_exact() {
    for scale in SCALES {
        let x = [Point3::origin(), Point3::new(2.0, 1.0, -2.0) * scale];
        let params = [scale];
        let moved = project(&x, &[1.0, 1e6], &Distance::eval(&x, &params));
        assert!(Distance::eval(&moved, &params).c.abs() < 1e-12 * scale);
        assert!((moved[0] - x[0]).norm() < 3e-6 * scale);
    }
}

/// The clamped paper form removes at most the whole error. Without the clamp it overshoots.
#[test]
fn the_clamped_paper_form_takes_at_most_a_newton_step() {
    let x: [Point3<f64>; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.9, 0.0]].map(Point3::from);
    for stiffness in [0.1, 0.5, 1.0] {
        let material = SkinTensionPaperMaterial::for_stiffness(stiffness, 0.1, 1e6).unwrap();
        let clamped = SkinTensionPaper::from_rest(&x, &material);
        let [rest_area, beta, most] = clamped;
        let newton = SkinTensionPaper::eval(&x, &[rest_area, 0.0, 1.0]).c;
        assert!(SkinTensionPaper::eval(&x, &clamped).c * stiffness <= newton * (1.0 + 1e-15));
        assert_eq!(most * stiffness, 1.0);
        assert!(SkinTensionPaper::eval(&x, &[rest_area, beta, f64::MAX]).c * stiffness > 1e5 * newton);
    }
}

#[test]
fn the_rest_scale_sets_the_pretension() {
    let x: [Point3<f64>; 3] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]].map(Point3::from);
    let material = SkinTensionMaterial { rest_area_scale: 0.9, amplification: 2.0 };
    let params = SkinTension::from_rest(&x, &material);
    assert_eq!(params, [3.0 * 0.9, 2.0]);
    assert!(SkinTension::eval(&x, &params).c > 0.3);
    assert_eq!(SkinTension::rest_size(&params), 2.7);
}

proptest! {
    /// One vertex moves along its own height, so the area changes linearly. `Ĉ` must increase with
    /// the area, and its projection must stop short of the rest area.
    #[test]
    fn the_energy_form_stops_short_of_the_rest_area(
        shape in shape::<3>(), stretch in 1.0..1e4f64, beta in 0.0..1e6f64,
    ) {
        let area = SkinTension::eval(&shape.x, &[0.0, 0.0]).c;
        let params = [area / stretch, beta];
        let before = SkinTension::eval(&shape.x, &params);
        let moved = project(&shape.x, &[1.0, 0.0, 0.0], &before);
        let after = SkinTension::eval(&moved, &params);
        prop_assert!(after.c <= before.c && after.c >= -1e-12 * area, "{} {}", before.c, after.c);
        // `Ĉ` is convex: a smaller area has no larger slope.
        prop_assert!(after.grad[0].norm() <= before.grad[0].norm() * (1.0 + 1e-12));
    }

    /// Negative control of the test above: the amplified error along the plain gradient overshoots.
    #[test]
    fn the_unclamped_paper_form_overshoots(shape in shape::<3>(), stretch in 2.0..1e4f64, beta in 1.0..1e6f64) {
        let area = SkinTension::eval(&shape.x, &[0.0, 0.0]).c;
        let params = [area / stretch, beta, f64::MAX];
        let before = SkinTensionPaper::eval(&shape.x, &params);
        let height = before.grad[0].norm_squared();
        let area_after = area - before.c * before.grad[0].norm_squared() / height;
        prop_assert!(area_after < params[0] * (1.0 - 1e-12));
    }
}
