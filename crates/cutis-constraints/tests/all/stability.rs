//! The energy form of skin tension under extreme amplification, stretch and mass ratios.

use cutis_constraints::{Constraint, Eval, Scalar, SkinTension, SkinTensionPaper};
use nalgebra::{Point3, Vector3};

use cutis_test_kit::Random;

use crate::shapes::SCALES;

const TRIANGLES: usize = 500;
const PROJECTIONS: usize = 200;
/// `α̃` over `Σ w|∇A|²` of the first projection, from rigid to very soft.
const COMPLIANCES: [f64; 4] = [0.0, 1e-6, 1e-3, 1.0];

fn area<T: Scalar>(x: &[Point3<T>; 3]) -> T {
    SkinTension::eval(x, &[T::zero(), T::zero()]).c
}

/// The result of 200 XPBD projections of a triangle.
struct TriangleRun {
    finite: bool,
    /// Largest area during the run, over the area at the start.
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

/// Runs XPBD with `eval`, which takes positions, rest area and `β`. `compliance` is relative, as in
/// [`COMPLIANCES`].
fn run<T: Scalar>(
    case: &Case,
    compliance: f64,
    eval: impl Fn(&[Point3<T>; 3], T, T) -> Eval<T, 3>,
) -> TriangleRun {
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
        // Without gradient and compliance there is no correction, as in a solver.
        let change = if denominator > T::zero() { (-c - alpha * lambda) / denominator } else { T::zero() };
        lambda += change;
        for i in 0..3 {
            x[i] += grad[i] * (inverse_mass[i] * change);
        }
        if !x.iter().flat_map(|p| p.iter()).all(|v| v.to_f64().is_finite()) {
            return TriangleRun { finite: false, largest: f64::INFINITY, end: f64::NAN };
        }
        largest = largest.max((area(&x) / start).to_f64());
    }
    TriangleRun { finite: true, largest, end: (area(&x) / rest_area).to_f64() }
}

/// Random triangles with inverse mass ratios up to 1e6, stretches up to 1e4 and `β` up to 1e6.
fn cases() -> impl Iterator<Item = Case> {
    let mut random = Random::new(1);
    let power = |random: &mut Random, low, high| 10f64.powf(random.between(low, high));
    (0..TRIANGLES).map(move |_| {
        let scale = SCALES[random.below(3)];
        Case {
            x: std::array::from_fn(|_| random.point() * scale),
            inverse_mass: std::array::from_fn(|_| power(&mut random, -3.0, 3.0)),
            stretch: power(&mut random, 0.0, 4.0),
            beta: power(&mut random, -2.0, 6.0),
        }
    })
}

fn check_area_never_exceeds_its_start<T: Scalar>(rounding: f64) {
    for compliance in COMPLIANCES {
        let mut worst = 0.0f64;
        let mut largest_error = 0.0f64;
        for (number, case) in cases().enumerate() {
            let run = run::<T>(&case, compliance, |x, rest, beta| SkinTension::eval(x, &[rest, beta]));
            assert!(run.finite, "triangle {number}, compliance {compliance}");
            worst = worst.max(run.largest);
            largest_error = largest_error.max((run.end - 1.0).abs());
        }
        println!(
            "compliance {compliance:e}: largest area/start {worst:.6}, error at the end {largest_error:.1e}"
        );
        assert!(worst <= 1.0 + rounding, "compliance {compliance}: area grew by {worst}");
    }
}

#[test]
fn the_area_never_exceeds_its_start() {
    check_area_never_exceeds_its_start::<f64>(1e-12);
}

#[test]
fn the_area_never_exceeds_its_start_in_single_precision() {
    check_area_never_exceeds_its_start::<f32>(1e-4);
}

/// Negative control: the same runs diverge with the unclamped paper form.
#[test]
fn without_the_clamp_the_paper_form_diverges() {
    let unclamped = |x: &_, rest, beta| SkinTensionPaper::eval(x, &[rest, beta, f64::MAX]);
    let runs = cases().map(|case| run::<f64>(&case, 0.0, unclamped));
    let diverged = runs.filter(|run| !run.finite || run.largest > 10.0).count();
    println!("{diverged} of {TRIANGLES} triangles diverge without the clamp");
    assert!(diverged > TRIANGLES * 4 / 5, "{diverged}");
}

/// With its clamp, at stiffness 1, the paper form takes at most a Newton step and stays finite.
#[test]
fn with_the_clamp_the_paper_form_is_stable() {
    for (number, case) in cases().enumerate() {
        let run = run::<f64>(&case, 0.0, |x, rest, beta| SkinTensionPaper::eval(x, &[rest, beta, 1.0]));
        assert!(run.finite && run.largest <= 1.0 + 1e-12, "triangle {number}: {}", run.largest);
    }
}
