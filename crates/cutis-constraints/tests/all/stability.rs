//! The energy form of skin tension under extreme amplification, stretch and mass ratios.

use cutis_constraints::{Constraint, Eval, Scalar, SkinTension, SkinTensionPaper};
use nalgebra::{Point3, Vector3};

use crate::shapes::{Random, SCALES};

const TRIANGLES: usize = 500;
const PROJECTIONS: usize = 200;
/// `α̃` over `Σ w|∇A|²` of the first projection: rigid to very soft.
const COMPLIANCES: [f64; 4] = [0.0, 1e-6, 1e-3, 1.0];

fn area<T: Scalar>(x: &[Point3<T>; 3]) -> T {
    SkinTension::eval(x, &[T::zero(), T::zero()]).c
}

/// What 200 XPBD projections did to a triangle.
struct Outcome {
    finite: bool,
    /// Largest area on the way, over the area at the start.
    largest: f64,
    /// Area at the end, over the rest area.
    end: f64,
}

/// A triangle, its inverse masses, its area over the rest area, and `β`.
struct Case {
    x: [Point3<f64>; 3],
    inverse_mass: [f64; 3],
    stretch: f64,
    beta: f64,
}

/// Runs XPBD with `eval`, which takes positions, rest area and `β`; `compliance` relative as above.
fn run<T: Scalar>(
    case: &Case,
    compliance: f64,
    eval: impl Fn(&[Point3<T>; 3], T, T) -> Eval<T, 3>,
) -> Outcome {
    let mut x = case.x.map(|p| p.map(T::constant));
    let inverse_mass = case.inverse_mass.map(T::constant);
    let weigh = |grad: &[Vector3<T>; 3]| {
        (0..3).fold(T::zero(), |sum, i| sum + grad[i].norm_squared() * inverse_mass[i])
    };
    let start = area(&x);
    let rest_area = start / T::constant(case.stretch);
    let alpha = T::constant(compliance) * weigh(&SkinTension::eval(&x, &[rest_area, T::zero()]).grad);
    let mut lambda = T::zero();
    let mut largest = 0.0f64;
    for _ in 0..PROJECTIONS {
        let Eval { c, grad } = eval(&x, rest_area, T::constant(case.beta));
        let denominator = weigh(&grad) + alpha;
        // As a solver does: no gradient and no compliance, no correction.
        let change = if denominator > T::zero() { (-c - alpha * lambda) / denominator } else { T::zero() };
        lambda += change;
        for i in 0..3 {
            x[i] += grad[i] * (inverse_mass[i] * change);
        }
        if !x.iter().flat_map(|p| p.iter()).all(|v| v.to_f64().is_finite()) {
            return Outcome { finite: false, largest: f64::INFINITY, end: f64::NAN };
        }
        largest = largest.max((area(&x) / start).to_f64());
    }
    Outcome { finite: true, largest, end: (area(&x) / rest_area).to_f64() }
}

/// Random triangles, inverse masses of a ratio to 1e6, stretch to 1e4 and `β` to 1e6.
fn cases() -> impl Iterator<Item = Case> {
    let mut random = Random(1);
    (0..TRIANGLES).map(move |_| {
        let scale = SCALES[(random.uniform() * 3.0) as usize];
        Case {
            x: std::array::from_fn(|_| random.point() * scale),
            inverse_mass: std::array::from_fn(|_| random.power(-3.0, 3.0)),
            stretch: random.power(0.0, 4.0),
            beta: random.power(-2.0, 6.0),
        }
    })
}

fn check_area_never_exceeds_its_start<T: Scalar>(rounding: f64) {
    for compliance in COMPLIANCES {
        let mut worst = 0.0f64;
        let mut farthest = 0.0f64;
        for (number, case) in cases().enumerate() {
            let outcome = run::<T>(&case, compliance, |x, rest, beta| SkinTension::eval(x, &[rest, beta]));
            assert!(outcome.finite, "triangle {number}, compliance {compliance}");
            worst = worst.max(outcome.largest);
            farthest = farthest.max((outcome.end - 1.0).abs());
        }
        println!(
            "compliance {compliance:e}: largest area/start {worst:.6}, end off the rest area by {farthest:.1e}"
        );
        assert!(worst <= 1.0 + rounding, "compliance {compliance}: area grew by {worst}");
    }
}

#[test]
fn area_never_exceeds_its_start() {
    check_area_never_exceeds_its_start::<f64>(1e-12);
}

#[test]
fn area_never_exceeds_its_start_in_single_precision() {
    check_area_never_exceeds_its_start::<f32>(1e-4);
}

/// Negative control: the same runs of the paper form without its clamp blow up.
#[test]
fn without_the_clamp_the_paper_form_diverges() {
    let unclamped = |x: &_, rest, beta| SkinTensionPaper::eval(x, &[rest, beta, f64::MAX]);
    let outcomes = cases().map(|case| run::<f64>(&case, 0.0, unclamped));
    let diverged = outcomes.filter(|outcome| !outcome.finite || outcome.largest > 10.0).count();
    println!("{diverged} of {TRIANGLES} triangles diverge without the clamp");
    assert!(diverged > TRIANGLES * 4 / 5, "{diverged}");
}

/// With its clamp, at stiffness 1, the paper form takes a Newton step at most and stays finite.
#[test]
fn with_the_clamp_the_paper_form_is_stable() {
    for (number, case) in cases().enumerate() {
        let outcome = run::<f64>(&case, 0.0, |x, rest, beta| SkinTensionPaper::eval(x, &[rest, beta, 1.0]));
        assert!(outcome.finite && outcome.largest <= 1.0 + 1e-12, "triangle {number}: {}", outcome.largest);
    }
}
