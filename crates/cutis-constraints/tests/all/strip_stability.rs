//! Skin strips at rest under XPBD, with extreme stiffening, tension, shapes and mass ratios.

use cutis_constraints::{Constraint, Eval, Params, Scalar, SkinStrip, SkinStripAtRest, SkinStripTurn};
use cutis_constraints::{SkinStripLaw, SkinStripMaterial};
use cutis_test_kit::Random;
use nalgebra::Point3;

use crate::shapes::SCALES;

const TRIANGLES: usize = 500;
const ROUNDS: usize = 100;
/// `α̃` over `Σ w B²`, from rigid to very soft.
const COMPLIANCES: [f64; 4] = [0.0, 1e-3, 0.1, 10.0];

/// A strip with its parameters, the deformed triangle and the inverse masses of its vertices.
struct Case {
    along: [f64; 9],
    turn: [f64; 9],
    x: [Point3<f64>; 3],
    inverse_mass: [f64; 3],
}

/// Random triangles with inverse mass ratios up to 1e6, tensions up to 0.99 of the modulus, and
/// stiffening up to 1e6. In a third of them the triangle is almost collapsed.
fn cases() -> impl Iterator<Item = Case> {
    let mut random = Random::new(3);
    let power = |random: &mut Random, low, high| 10f64.powf(random.between(low, high));
    (0..TRIANGLES).map(move |number| {
        let scale = SCALES[random.below(3)];
        let law = SkinStripLaw {
            tension_n_per_m: 0.99 * random.uniform(),
            modulus_n_per_m: 1.0,
            stiffening: power(&mut random, -2.0, 6.0),
            compression: [0.0, 0.5, 1.0][random.below(3)],
        };
        let directions = [random.vector(), random.vector()].map(Into::into);
        let material = SkinStripMaterial::new(directions[0], directions[1], law).unwrap();
        let scan = std::array::from_fn(|_| random.point() * scale);
        let size = if number % 3 == 2 { 1e-5 * scale } else { scale };
        Case {
            along: SkinStrip::from_rest(&scan, &material),
            turn: SkinStripTurn::from_rest(&scan, &material),
            x: std::array::from_fn(|_| random.point() * size),
            inverse_mass: std::array::from_fn(|_| power(&mut random, -3.0, 3.0)),
        }
    })
}

/// A projection of a constraint in a solver, with or without its reach.
fn project<C: Constraint<3>, T: Scalar>(
    x: &mut [Point3<T>; 3],
    params: &[f64; 9],
    (w, compliance, reach): (&[T; 3], T, bool),
    lambda: &mut T,
) {
    let params = Params::from_fn(|k| T::constant(params[k]));
    let Eval { c, grad } = C::eval(x, &params);
    let mut square = (0..3).fold(T::zero(), |sum, i| sum + grad[i].norm_squared() * w[i]);
    let lightest = w.iter().fold(T::zero(), |most, w| if *w > most { *w } else { most });
    if let (true, Some(inverse)) = (reach, C::inverse_reach_squared(x, &params)) {
        let least = lightest * (c * inverse * c);
        square = if least > square { least } else { square };
    }
    let denominator = square + compliance;
    if denominator > T::zero() {
        let change = (-c - compliance * *lambda) / denominator;
        *lambda += change;
        for i in 0..3 {
            x[i] += grad[i] * (w[i] * change);
        }
    }
}

/// Twice `α Ũ`: the sum of the squares of the two constraints, in m².
fn energy<T: Scalar>(case: &Case, x: &[Point3<T>; 3]) -> f64 {
    let x = x.map(|p| p.map(T::to_f64));
    let values = [SkinStripAtRest::eval(&x, &case.along).c, SkinStripTurn::eval(&x, &case.turn).c];
    values.iter().map(|c| c * c).sum()
}

/// The largest energy after a round over the energy at the start, of all cases.
fn largest_energy<T: Scalar>(compliance: f64, reach: bool) -> f64 {
    let mut largest = 0.0f64;
    for (number, case) in cases().enumerate() {
        let mut x = case.x.map(|p| p.map(T::constant));
        let [b1, b2, ..] = case.along;
        let weights = [b1, b2, b1 + b2].map(|b| b * b);
        let square: f64 = (0..3).map(|i| case.inverse_mass[i] * weights[i]).sum();
        let inverse_mass = case.inverse_mass.map(T::constant);
        let setting = (&inverse_mass, T::constant(compliance * square), reach);
        let start = energy(&case, &x);
        let mut lambda = [T::zero(); 2];
        for _ in 0..ROUNDS {
            project::<SkinStripAtRest, T>(&mut x, &case.along, setting, &mut lambda[0]);
            project::<SkinStripTurn, T>(&mut x, &case.turn, setting, &mut lambda[1]);
            let now = energy(&case, &x) / start;
            assert!(now.is_finite(), "triangle {number}, compliance {compliance}");
            largest = largest.max(now);
        }
    }
    largest
}

/// Rigid strips only lose energy. With a compliance, XPBD keeps multipliers of former gradients,
/// and the energy of the two constraints may grow by a small factor, but not from round to round.
fn check<T: Scalar>() {
    for compliance in COMPLIANCES {
        let largest = largest_energy::<T>(compliance, true);
        println!("compliance {compliance:e}: largest energy over start {largest:.6}");
        assert!(largest <= if compliance == 0.0 { 1.0 } else { 3.0 }, "{largest}");
    }
}

#[test]
fn the_energy_does_not_run_away() {
    check::<f64>();
}

#[test]
fn the_energy_does_not_run_away_in_single_precision() {
    check::<f32>();
}

/// Control: without the reach a slack strip is pushed past its length in the scan.
#[test]
fn without_the_reach_the_energy_grows() {
    let largest = largest_energy::<f64>(0.0, false);
    println!("without the reach: largest energy over start {largest:.1e}");
    assert!(largest > 1e3, "{largest}");
}
