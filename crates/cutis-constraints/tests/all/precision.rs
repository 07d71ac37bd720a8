//! Evaluations in `f32` agree with `f64` on the same numbers.

use cutis_constraints::{Constraint, Distance, Eval, SkinTension, SkinTensionPaper, Volume};
use nalgebra::Vector3;
use proptest::prelude::*;

use crate::checks::single_error;
use crate::shapes::{Shape, shape};

/// Bound in units of the machine epsilon of `f32`. The shapes are at worst about twenty times
/// longer than they are thick.
const BOUND: f64 = 400.0 * f32::EPSILON as f64;

fn check<const N: usize, const K: usize, C>(shape: &Shape<N>, params: [f64; K])
where
    C: Constraint<N, Params<f32> = [f32; K], Params<f64> = [f64; K]>,
{
    let shape = shape.rounded();
    let single_params = params.map(|p| p as f32);
    let params = single_params.map(f64::from);
    let single = C::eval(&shape.single(), &single_params);
    let double = C::eval(&shape.x, &params);
    let error = single_error(&single, &double, shape.scale);
    assert!(error < BOUND, "{}: {error}", C::NAME);

    // Negative controls: a value and a gradient with an error of 1e-3 of their sizes.
    let size = double.grad.iter().map(Vector3::norm).fold(0.0, f64::max);
    let off = Eval { c: single.c + (1e-3 * size * shape.scale) as f32, grad: single.grad };
    assert!(single_error(&off, &double, shape.scale) > BOUND);
    let off = Eval { c: single.c, grad: single.grad.map(|g| g * 1.001) };
    assert!(single_error(&off, &double, shape.scale) > BOUND);
}

proptest! {
    #[test]
    fn distance(shape in shape::<2>(), ratio in 0.1..5.0f64) {
        check::<2, 1, Distance>(&shape, [ratio * shape.scale]);
    }

    #[test]
    fn volume(shape in shape::<4>(), ratio in 0.1..5.0f64) {
        check::<4, 1, Volume>(&shape, [ratio * shape.scale.powi(3)]);
    }

    #[test]
    fn skin_tension(shape in shape::<3>(), ratio in 0.1..5.0f64, beta in 0.0..1e3f64) {
        check::<3, 2, SkinTension>(&shape, [ratio * shape.scale.powi(2), beta]);
    }

    #[test]
    fn paper_form(shape in shape::<3>(), ratio in 0.1..5.0f64, beta in 0.0..1e3f64) {
        check::<3, 3, SkinTensionPaper>(&shape, [ratio * shape.scale.powi(2), beta, 10.0]);
    }
}
