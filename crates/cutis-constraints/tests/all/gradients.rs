//! Gradients agree with finite differences and conserve momentum. The energy form is the gradient
//! of its energy.

use cutis_constraints::{
    Constraint, Distance, Eval, LipAdhesion, LipContact, SkinStrip, SkinStripAtRest, SkinStripTurn,
    SkinTension, SkinTensionPaper, Volume,
};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use crate::checks::{gradient_error, gradient_size, momentum_error, torque_error, with};
use crate::shapes::{Shape, shape};
use crate::strips::{StripCase, strip_case};

/// Bound on the error against finite differences. The negative controls are off by 1e-3 or more.
const EXACT: f64 = 1e-6;
/// Bound on the momentum that rounding creates.
const ROUNDING: f64 = 1e-12;

fn area(x: &[Point3<f64>; 3]) -> f64 {
    (x[1] - x[0]).cross(&(x[2] - x[0])).norm() / 2.0
}

/// Checks that `eval` returns the gradient of its value and conserves momentum, and that these
/// checks notice wrong gradients.
fn check<const N: usize>(eval: &impl Fn(&[Point3<f64>; N]) -> Eval<f64, N>, shape: &Shape<N>) {
    let grad = eval(&shape.x).grad;
    let error = gradient_error(eval, shape);
    assert!(error < EXACT, "gradient is off by {error}");
    let error = momentum_error(&grad);
    assert!(error < ROUNDING, "momentum of {error}");
    let error = torque_error(&grad, shape);
    assert!(error < ROUNDING, "torque of {error}");

    // Negative controls: a wrong sign, a factor of 1.001, and a couple that is invisible in the
    // sum.
    let altered = |alter: &dyn Fn(&mut [Vector3<f64>; N])| {
        let mut eval = eval(&shape.x);
        alter(&mut eval.grad);
        eval.grad
    };
    let replaced = |grad: [Vector3<f64>; N]| move |x: &[Point3<f64>; N]| Eval { c: eval(x).c, grad };
    let longest = (0..N).max_by(|&a, &b| grad[a].norm().total_cmp(&grad[b].norm())).unwrap_or(0);
    let flipped = altered(&|g| g[longest] = -g[longest]);
    assert!(gradient_error(replaced(flipped), shape) > 1.0);
    assert!(momentum_error(&flipped) > 1.0);
    let stretched = altered(&|g| g.iter_mut().for_each(|g| *g *= 1.001));
    assert!(gradient_error(replaced(stretched), shape) > 0.9e-3);
    let arm = shape.x[1] - shape.x[0];
    let across = arm.cross(&Vector3::new(arm.y, arm.z, -arm.x)).normalize() * (gradient_size(&grad) * 1e-3);
    let couple = altered(&|g| {
        g[0] += across;
        g[1] -= across;
    });
    assert!(momentum_error(&couple) < ROUNDING);
    assert!(torque_error(&couple, shape) > 1e-6);
}

/// Checks the gradient and the momentum of a constraint with a direction in space, not its torque.
fn check_forces<const N: usize>(eval: &dyn Fn(&[Point3<f64>; N]) -> Eval<f64, N>, shape: &Shape<N>) {
    let grad = eval(&shape.x).grad;
    let error = gradient_error(eval, shape);
    assert!(error < EXACT, "gradient is off by {error}");
    assert!(momentum_error(&grad) < ROUNDING);
    let longer = |x: &[Point3<f64>; N]| Eval { c: eval(x).c, grad: grad.map(|g| g * 1.001) };
    assert!(gradient_error(longer, shape) > 0.9e-3);
}

/// True where a strip has a kink or a wide enough image for finite differences.
fn is_smooth(case: &StripCase) -> bool {
    let [_, _, rest, scan, _, compression, ..] = case.params();
    let length = case.image(&case.x.x).norm();
    let far = |from: f64| (length - from).abs() > 0.01 * case.x.scale;
    // Below the rest length and without compression there is no gradient to compare.
    let pulls = length > rest || compression > 0.01;
    far(0.0) && far(0.1 * scan) && far(rest) && far(scan) && pulls
}

/// Rest size over current size, not so near 1 that a finite difference straddles the kink of
/// `max(0, C)`.
fn rest_ratio() -> impl Strategy<Value = f64> {
    prop_oneof![0.1..0.9f64, 1.1..5.0]
}

proptest! {
    #[test]
    fn distance_gradient(shape in shape::<2>(), ratio in rest_ratio()) {
        check(&with::<2, Distance>([ratio * shape.scale]), &shape);
    }

    #[test]
    fn volume_gradient(shape in shape::<4>(), ratio in rest_ratio()) {
        check(&with::<4, Volume>([ratio * shape.scale.powi(3)]), &shape);
    }

    #[test]
    fn skin_tension_gradient(shape in shape::<3>(), ratio in rest_ratio(), beta in 0.0..100.0f64) {
        check(&with::<3, SkinTension>([ratio * area(&shape.x), beta]), &shape);
    }

    /// Sides that overlap are pushed apart along the normal. Open ones have no contact.
    #[test]
    fn lip_contact_gradient(shape in shape::<4>(), part in 0.0..1.0f64, normal in proptest::array::uniform3(-1.0..1.0f64)) {
        let contact = with::<4, LipContact>([part, normal[0], normal[1], normal[2]]);
        let gap = ((shape.x[0] - shape.x[2]) * (1.0 - part) + (shape.x[1] - shape.x[3]) * part)
            .dot(&Vector3::from(normal));
        prop_assume!(gap.abs() > 1e-2 * shape.scale * Vector3::from(normal).norm());
        let Eval { c, grad } = contact(&shape.x);
        if gap < 0.0 {
            prop_assert!((c - gap).abs() <= 1e-12 * shape.scale);
            check_forces(&contact, &shape);
        } else {
            prop_assert!(c == 0.0 && grad == [Vector3::zeros(); 4]);
        }
    }

    /// Sides that adhere are held along the normal, whether they overlap or are apart.
    #[test]
    fn lip_adhesion_gradient(shape in shape::<4>(), part in 0.0..1.0f64, normal in proptest::array::uniform3(-1.0..1.0f64)) {
        let adhesion = with::<4, LipAdhesion>([part, normal[0], normal[1], normal[2]]);
        let gap = ((shape.x[0] - shape.x[2]) * (1.0 - part) + (shape.x[1] - shape.x[3]) * part)
            .dot(&Vector3::from(normal));
        prop_assert!((adhesion(&shape.x).c - gap).abs() <= 1e-12 * shape.scale);
        check_forces(&adhesion, &shape);
    }

    /// The slope of a triangle along the strip has a direction in space, so its torque is not zero.
    #[test]
    fn skin_strip_gradient(case in strip_case(100.0)) {
        prop_assume!(is_smooth(&case));
        check_forces(&with::<3, SkinStrip>(case.params()), &case.x);
        check_forces(&with::<3, SkinStripAtRest>(case.params()), &case.x);
    }

    /// The load has a direction in space, too.
    #[test]
    fn skin_strip_turn_gradient(case in strip_case(100.0)) {
        let turn = with::<3, SkinStripTurn>(case.turn_params());
        prop_assume!(is_smooth(&case) && gradient_size(&turn(&case.x.x).grad) > 0.05);
        check_forces(&turn, &case.x);
    }

    /// Only a triangle that is parallel to the skin has strips without a torque.
    #[test]
    fn a_flat_strip_has_no_torque(case in strip_case(100.0)) {
        let [b1, b2, rest, scan, stiffening, compression, rise @ ..] = case.params();
        let flat = [b1, b2, rest, scan, stiffening, compression, 0.0, 0.0, 0.0];
        for eval in [SkinStrip::eval, SkinStripAtRest::eval] {
            let grad = eval(&case.x.x, &flat).grad;
            prop_assert!(gradient_size(&grad) == 0.0 || torque_error(&grad, &case.x) < ROUNDING);
        }
        let [image, rise] = [case.image(&case.x.x), Vector3::from(rise)];
        let Eval { c, grad } = SkinStrip::eval(&case.x.x, &case.params());
        prop_assume!(c > 0.0 && rise.cross(&image).norm() > 0.1 * scan * image.norm());
        prop_assert!(torque_error(&grad, &case.x) > 1e-4);
    }

    #[test]
    fn the_turn_has_a_torque(case in strip_case(100.0)) {
        let turn = SkinStripTurn::eval(&case.x.x, &case.turn_params());
        let [scan, image] = [&case.scan.x, &case.x.x].map(|x| case.image(x));
        prop_assume!(scan.cross(&image).norm() > 0.1 * scan.norm() * image.norm() && turn.c > 0.0);
        prop_assert!(torque_error(&turn.grad, &case.x) > 1e-4);
    }

    /// Where nothing is amplified, the paper form is the plain area constraint.
    #[test]
    fn paper_form_gradient(shape in shape::<3>(), ratio in 1.1..5.0f64, beta in 0.0..100.0f64) {
        check(&with::<3, SkinTensionPaper>([ratio * area(&shape.x), beta, f64::MAX]), &shape);
    }

    /// `Ĉ ∇Ĉ` is the gradient of `U = ½C² + β max(0, C)³/(3 A0)` and equals the published force
    /// `C F ∇A`.
    #[test]
    fn energy_form_is_the_gradient_of_the_energy(
        shape in shape::<3>(), ratio in rest_ratio(), beta in 0.0..100.0f64,
    ) {
        let rest_area = ratio * area(&shape.x);
        let force = |eval: Eval<f64, 3>| eval.grad.map(|g| g * eval.c);
        let energy = |x: &[Point3<f64>; 3]| {
            let c = area(x) - rest_area;
            let u = 0.5 * c * c + beta * c.max(0.0).powi(3) / (3.0 * rest_area);
            Eval { c: u, grad: force(SkinTension::eval(x, &[rest_area, beta])) }
        };
        check(&energy, &shape);

        let published = force(SkinTensionPaper::eval(&shape.x, &[rest_area, beta, f64::MAX]));
        let ours = energy(&shape.x).grad;
        let difference: [Vector3<f64>; 3] = std::array::from_fn(|i| published[i] - ours[i]);
        prop_assert!(gradient_size(&difference) < 1e-12 * gradient_size(&ours));

        // Negative control: without the derivative of q the force differs wherever `C` is
        // amplified.
        if ratio < 1.0 && beta > 0.1 {
            let without = |x: &[Point3<f64>; 3]| {
                let c = SkinTension::eval(x, &[rest_area, beta]).c;
                let grad = SkinTension::eval(x, &[rest_area, 0.0]).grad;
                Eval { c: energy(x).c, grad: grad.map(|g| g * c) }
            };
            prop_assert!(gradient_error(without, &shape) > 1e-3);
        }
    }
}
