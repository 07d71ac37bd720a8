//! Coincident points, flat shapes and zero rest sizes: results are finite, and an undefined
//! gradient is zero.

use cutis_constraints::{
    Constraint, Distance, Eval, Params, Scalar, SkinStrip, SkinStripAtRest, SkinStripTurn, SkinTension,
    SkinTensionPaper, Volume,
};
use nalgebra::{Point3, Vector3};

/// Both ends of the documented range of lengths, and lengths between them, in m.
const SCALES: [f64; 5] = [1e-7, 1e-3, 1.0, 1e3, 1e7];

fn eval<const N: usize, C: Constraint<N>, T: Scalar>(
    x: [[f64; 3]; N],
    scale: f64,
    params: &[f64],
) -> Eval<T, N> {
    let x = x.map(|p| Point3::from(p.map(|v| T::constant(v * scale))));
    let eval = C::eval(&x, &Params::from_fn(|k| T::constant(params[k])));
    let finite = eval.grad.iter().flatten().chain([&eval.c]).all(|v| v.to_f64().is_finite());
    assert!(finite, "{} at scale {scale}: {eval:?}", C::NAME);
    eval
}

fn is_zero<T: Scalar, const N: usize>(eval: &Eval<T, N>) -> bool {
    eval.grad == [Vector3::zeros(); N]
}

/// Points away from the origin. Their coordinates are not round, so that no result is exact by
/// chance.
const A: [f64; 3] = [0.1, -0.7, 1.3];
const B: [f64; 3] = [0.9, 0.3, 0.2];
const C: [f64; 3] = [-0.4, 0.8, 0.6];

fn lerp(t: f64) -> [f64; 3] {
    std::array::from_fn(|axis| A[axis] + t * (B[axis] - A[axis]))
}

fn edges<T: Scalar>() {
    for scale in SCALES {
        for rest in [0.0, 1.0] {
            let rest = rest * scale;
            let point = eval::<2, Distance, T>([A, A], scale, &[rest]);
            assert!(is_zero(&point));
            assert_eq!(point.c.to_f64(), -T::constant(rest).to_f64());
            assert!(!is_zero(&eval::<2, Distance, T>([A, B], scale, &[rest])));
        }
    }
}

fn triangles<T: Scalar>() {
    let flat = [[A, A, A], [A, A, B], [A, B, A], [B, A, A]];
    // These points lie on a line up to rounding. The normal is noise.
    let on_a_line = [[A, lerp(1.0 / 3.0), B], [A, B, lerp(0.3)], [lerp(0.7), A, B], [A, B, lerp(1.7)]];
    for scale in SCALES {
        for rest in [0.0, 1.0] {
            for beta in [0.0, 2.0, 1e6] {
                let rest = rest * scale * scale;
                for x in flat.iter().chain(&on_a_line) {
                    assert!(is_zero(&eval::<3, SkinTension, T>(*x, scale, &[rest, beta])), "{x:?}");
                    assert!(is_zero(&eval::<3, SkinTensionPaper, T>(*x, scale, &[rest, beta, 1.0])), "{x:?}");
                }
                assert!(!is_zero(&eval::<3, SkinTension, T>([A, B, C], scale, &[rest, beta])));
                // A sliver of relative width 1e-3 is not degenerate.
                let mut sliver = lerp(0.5);
                sliver[0] += 1e-3;
                assert!(!is_zero(&eval::<3, SkinTension, T>([A, B, sliver], scale, &[rest, beta])));
            }
        }
    }
}

fn tetrahedra<T: Scalar>() {
    for scale in SCALES {
        for rest in [0.0, 1.0] {
            let rest = rest * scale.powi(3);
            assert!(is_zero(&eval::<4, Volume, T>([A, A, A, A], scale, &[rest])));
            assert!(is_zero(&eval::<4, Volume, T>([A, B, A, B], scale, &[rest])));
            // In a plane the volume is 0, but its gradient is not. It points out of the plane.
            let flat = eval::<4, Volume, T>([A, B, C, A], scale, &[rest]);
            assert!(!is_zero(&flat));
            assert_eq!(flat.c.to_f64(), -T::constant(rest).to_f64());
        }
    }
}

/// Strips with the image of the triangle `A, B, C` in the scan.
fn strips<T: Scalar>() {
    let [b1, b2] = [1.0, -0.375];
    let image: [f64; 3] = std::array::from_fn(|axis| b1 * (A[axis] - C[axis]) + b2 * (B[axis] - C[axis]));
    let length = image.iter().map(|v| v * v).sum::<f64>().sqrt();
    let mirrored = [A, B, C].map(|p| p.map(|v| -v));
    for scale in SCALES {
        for (rest, stiffening, compression) in [(0.7, 0.0, 1.0), (1.0, 1e6, 0.0), (0.01, 5.0, 0.5)] {
            let params =
                [b1, b2, rest * length * scale, length * scale, stiffening, compression, 0.0, 0.0, 0.0];
            let [fx, fy, fz] = image.map(|v| v * scale);
            let turn = [b1, b2, fx, fy, fz, (1.0 - rest) * length * scale, 0.0, 0.0, 0.0];
            // Without extent there is no image.
            assert!(is_zero(&eval::<3, SkinStrip, T>([A, A, A], scale, &params)));
            assert!(is_zero(&eval::<3, SkinStripAtRest, T>([A, A, A], scale, &params)));
            assert!(is_zero(&eval::<3, SkinStripTurn, T>([A, A, A], scale, &turn)));
            // A mirrored triangle has the same length. Its image points backwards.
            let found = eval::<3, SkinStripTurn, T>(mirrored, scale, &turn).c.to_f64();
            let wanted = 2.0 * ((1.0 - rest).max(0.0) * length * length).sqrt() * scale;
            assert!((found - wanted).abs() < 1e-6 * length * scale, "{found} {wanted}");
            let flat = eval::<3, SkinStrip, T>([A, A, B], scale, &params);
            assert!(!is_zero(&flat) || compression == 0.0, "a flat triangle has an image");
        }
        for x in [[A, B, C], [A, A, A]] {
            eval::<3, SkinStrip, T>(x, scale, &[0.0; 9]);
            eval::<3, SkinStripAtRest, T>(x, scale, &[0.0; 9]);
            eval::<3, SkinStripTurn, T>(x, scale, &[0.0; 9]);
        }
    }
}

#[test]
fn degenerate_strips_are_finite() {
    strips::<f32>();
    strips::<f64>();
}

#[test]
fn degenerate_edges_are_finite() {
    edges::<f32>();
    edges::<f64>();
}

#[test]
fn degenerate_triangles_are_finite() {
    triangles::<f32>();
    triangles::<f64>();
}

#[test]
fn degenerate_tetrahedra_are_finite() {
    tetrahedra::<f32>();
    tetrahedra::<f64>();
}

/// Without a rest area there is no stretch to amplify, and a plain area constraint remains.
#[test]
fn a_zero_rest_area_is_not_amplified() {
    let plain = eval::<3, SkinTension, f64>([A, B, C], 1.0, &[0.0, 0.0]);
    assert_eq!(eval::<3, SkinTension, f64>([A, B, C], 1.0, &[0.0, 1e6]), plain);
    assert_eq!(eval::<3, SkinTensionPaper, f64>([A, B, C], 1.0, &[0.0, 1e6, 1e9]).c, plain.c);
    assert!(eval::<3, SkinTension, f64>([A, B, C], 1.0, &[1e-3, 1e6]).c > 100.0 * plain.c);
}
