//! Energies of skin strips: closed forms, never negative around the scan, and lowered by every
//! projection.

use cutis_constraints::{Constraint, Distance, Eval, SkinStrip, SkinStripAtRest, SkinStripTurn};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use crate::checks::project;
use crate::strips::{StripCase, strip_case};

/// `α U` of the strip with the image `image`, in m².
fn energy(case: &StripCase, image: &Vector3<f64>) -> f64 {
    let [_, _, rest, scan, stiffening, compression, ..] = case.params();
    let s = image.norm() - rest;
    let e = (image.norm() - scan).max(0.0);
    let spring = 0.5 * s * s * if s < 0.0 { compression } else { 1.0 };
    spring + stiffening * e.powi(3) / (6.0 * scan)
}

/// `α Ũ`: the energy without its linear part in the scan, times `load`, and its largest term.
fn energy_at_rest(case: &StripCase, image: &Vector3<f64>, load: f64) -> (f64, f64) {
    let [_, _, rest, scan, ..] = case.params();
    let in_scan = case.image(&case.scan.x);
    let pull = in_scan * (load * (scan - rest) / scan);
    let terms = [energy(case, image), -energy(case, &in_scan), -pull.dot(&(image - in_scan))];
    (terms.iter().sum(), terms.iter().fold(scan * scan, |most, term| most.max(term.abs())))
}

/// The images to try: the deformed triangle, the scan flipped, shrunk, slack, nearly at rest.
fn images(case: &StripCase) -> Vec<Vector3<f64>> {
    let (scan, other) = (case.image(&case.scan.x), case.image(&case.x.x));
    let near = [1.0, 1e-3].map(|share| scan + other * share);
    let along = [-2.0, -1.0, -0.3, 1e-9, 0.2, 0.7, 0.999, 1.001, 3.0].map(|share| scan * share);
    near.into_iter().chain(along).chain([other, other * 1e-6]).collect()
}

/// A triangle with the image `image` of the strip.
fn triangle(case: &StripCase, image: &Vector3<f64>) -> [Point3<f64>; 3] {
    let [b1, b2, ..] = case.params();
    let [x1, x2, x3] = case.scan.x;
    // Move the first two vertices along their weights.
    let correction = (image - case.image(&case.scan.x)) / (b1 * b1 + b2 * b2);
    [x1 + correction * b1, x2 + correction * b2, x3]
}

/// `½C²` of the two constraints at rest.
fn halves(case: &StripCase, x: &[Point3<f64>; 3]) -> [f64; 2] {
    let along = SkinStripAtRest::eval(x, &case.params()).c;
    let turn = SkinStripTurn::eval(x, &case.turn_params()).c;
    [0.5 * along * along, 0.5 * turn * turn]
}

/// The largest distance that a solver lets a projection move a vertex: see
/// [`Constraint::inverse_reach_squared`].
fn project_within_reach<C: Constraint<3>>(
    x: &[Point3<f64>; 3],
    params: &C::Params<f64>,
    inverse_mass: &[f64; 3],
) -> [Point3<f64>; 3] {
    let eval = C::eval(x, params);
    let square: f64 = (0..3).map(|i| inverse_mass[i] * eval.grad[i].norm_squared()).sum();
    let lightest = inverse_mass.iter().fold(0.0f64, |most, w| most.max(*w));
    let least =
        C::inverse_reach_squared(x, params).map_or(0.0, |inverse| lightest * eval.c * eval.c * inverse);
    let fraction = if square > 0.0 { square / square.max(least) } else { 0.0 };
    let limited = Eval { c: eval.c * fraction, grad: eval.grad };
    if square > 0.0 { project(x, inverse_mass, &limited) } else { *x }
}

fn masses() -> impl Strategy<Value = [f64; 3]> {
    proptest::array::uniform3((-3.0..3.0f64).prop_map(|power| 10f64.powf(power)))
}

proptest! {
    #[test]
    fn the_strip_has_the_energy_of_its_definition(case in strip_case(1e6)) {
        for image in images(&case) {
            let c = SkinStrip::eval(&triangle(&case, &image), &case.params()).c;
            let wanted = energy(&case, &case.image(&triangle(&case, &image)));
            let size = case.params()[3].powi(2).max(wanted);
            prop_assert!((0.5 * c * c - wanted).abs() < 1e-9 * size, "{c} {wanted}");
        }
    }

    /// The two constraints at rest share the energy without its linear part, which is nowhere
    /// negative. With a load 10 % too large, it is negative near the scan (control).
    #[test]
    fn the_energy_at_rest_is_the_sum_of_two_and_not_negative(case in strip_case(1e6)) {
        for image in images(&case) {
            let x = triangle(&case, &image);
            let [along, turn] = halves(&case, &x);
            let (wanted, size) = energy_at_rest(&case, &case.image(&x), 1.0);
            prop_assert!((along + turn - wanted).abs() < 1e-9 * size, "{along} + {turn} is not {wanted}");
            prop_assert!(wanted > -1e-9 * size);
        }
        let [_, _, rest, scan, ..] = case.params();
        let step = 0.01 * (scan - rest) / scan;
        prop_assume!(step > 1e-4);
        let longer = case.image(&case.scan.x) * (1.0 + step);
        let (wrong, size) = energy_at_rest(&case, &longer, 1.1);
        prop_assert!(case.params()[4] * step > 1.0 || wrong < -1e-9 * size, "{wrong}");
    }

    /// Without stiffening and with full compression a strip is a distance constraint between two
    /// weighted points.
    #[test]
    fn a_plain_strip_is_a_distance(case in strip_case(1e6)) {
        let [b1, b2, rest, scan, _, _, hx, hy, hz] = case.params();
        for image in images(&case) {
            let x = triangle(&case, &image);
            let strip = SkinStrip::eval(&x, &[b1, b2, rest, scan, 0.0, 1.0, hx, hy, hz]);
            let ends = [Point3::from(case.image(&x)), Point3::origin()];
            let distance = Distance::eval(&ends, &[rest]);
            prop_assert_eq!(strip.c, distance.c);
            for (grad, b) in strip.grad.iter().zip([b1, b2, -b1 - b2]) {
                prop_assert!((grad - distance.grad[0] * b).norm() < 1e-14);
            }
            let at_rest = SkinStripAtRest::eval(&x, &[b1, b2, rest, scan, 0.0, 1.0, hx, hy, hz]);
            let distance = Distance::eval(&ends, &[scan]);
            prop_assert!((at_rest.c - distance.c).abs() < 1e-12 * scan.max(distance.c));
        }
    }

    /// A rigid projection lowers the value of each kind and does not pass zero, for any masses.
    #[test]
    fn a_projection_does_not_overshoot(case in strip_case(1e6), masses in masses()) {
        let rounding = 1e-7 * case.params()[3];
        for image in images(&case) {
            let x = triangle(&case, &image);
            let values = |x: &[Point3<f64>; 3]| [
                SkinStrip::eval(x, &case.params()).c,
                SkinStripAtRest::eval(x, &case.params()).c,
                SkinStripTurn::eval(x, &case.turn_params()).c,
            ];
            let before = values(&x);
            let after = [
                values(&project_within_reach::<SkinStrip>(&x, &case.params(), &masses))[0],
                values(&project_within_reach::<SkinStripAtRest>(&x, &case.params(), &masses))[1],
                values(&project_within_reach::<SkinStripTurn>(&x, &case.turn_params(), &masses))[2],
            ];
            for (kind, (before, after)) in before.into_iter().zip(after).enumerate() {
                let slack = rounding + 1e-7 * before.abs();
                let between = if before > 0.0 { -slack..before + slack } else { before - slack..slack };
                prop_assert!(between.contains(&after), "kind {kind}: from {before} to {after}");
            }
            prop_assert!(after[2].abs() < 1e-5 * before[2].max(case.params()[3]), "turns back in one step");
        }
    }
}

/// Control: without the reach, a slack strip with little tension overshoots.
#[test]
fn without_the_reach_a_slack_strip_overshoots() {
    let params = [1.0, 0.0, 0.99, 1.0, 100.0, 0.0, 0.0, 0.0, 0.0];
    let x = [0.4, 0.0, 0.0].map(|x| Point3::new(x, 0.0, 0.0));
    let before = SkinStripAtRest::eval(&x, &params);
    let overshot = SkinStripAtRest::eval(&project(&x, &[1.0; 3], &before), &params);
    let limited =
        SkinStripAtRest::eval(&project_within_reach::<SkinStripAtRest>(&x, &params, &[1.0; 3]), &params);
    assert!(before.c < 0.0 && overshot.c > 5.0 * before.c.abs(), "{} {}", before.c, overshot.c);
    assert!(limited.c.abs() < 1e-12, "{}", limited.c);
}
