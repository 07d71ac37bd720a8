//! The numbers of `docs/book/errata.md`: Algorithm 1 of the skin tension paper as printed, compared
//! with the two forms of Cutis.
//!
//! `cargo test -p cutis-constraints --test all errata -- --nocapture --test-threads=1` prints them.
//! Source: DOI 10.15701/kcgs.2025.31.4.21, Algorithm 1.

use cutis_constraints::{Constraint, Eval, SkinTension, SkinTensionPaper};
use nalgebra::{Point3, Vector3};

type Triangle = [Point3<f64>; 3];

/// The gradients to use in Algorithm 1.
#[derive(Clone, Copy, PartialEq)]
enum Gradients {
    /// As printed: the wrong sign at the third vertex, and `4A` times too long.
    Printed,
    /// With the correct sign at the third vertex, and the length as printed.
    CorrectSign,
}

/// The corrections `ΔP_i` of Algorithm 1 with inverse masses `w`, line by line.
fn algorithm_1(
    gradients: Gradients,
    [p1, p2, p3]: &Triangle,
    w: [f64; 3],
    rest_area: f64,
    stiffness: f64,
    beta: f64,
) -> [Vector3<f64>; 3] {
    let n = (p2 - p1).cross(&(p3 - p1));
    let area = n.norm() / 2.0;
    let c = area - rest_area;
    let amplification = 1.0 + beta * ((area - rest_area) / rest_area).max(0.0);
    let third = match gradients {
        Gradients::Printed => p2 - p1,
        Gradients::CorrectSign => p1 - p2,
    };
    let grad = [(p2 - p3).cross(&n), (p3 - p1).cross(&n), third.cross(&n)];
    let denominator: f64 = (0..3).map(|i| w[i] * grad[i].norm_squared()).sum();
    let s = -stiffness * amplification * c / denominator;
    std::array::from_fn(|i| grad[i] * (s * w[i]))
}

/// The corrections of PBD with stiffness 1.
fn pbd(eval: &Eval<f64, 3>, w: [f64; 3]) -> [Vector3<f64>; 3] {
    let denominator: f64 = (0..3).map(|i| w[i] * eval.grad[i].norm_squared()).sum();
    std::array::from_fn(|i| eval.grad[i] * (-w[i] * eval.c / denominator))
}

/// The correct gradient with the printed amplification: the paper form without a clamp.
fn correct_gradient(x: &Triangle, w: [f64; 3], rest_area: f64, beta: f64) -> [Vector3<f64>; 3] {
    pbd(&SkinTensionPaper::eval(x, &[rest_area, beta, f64::MAX]), w)
}

fn moved(x: &Triangle, by: [Vector3<f64>; 3]) -> Triangle {
    std::array::from_fn(|i| x[i] + by[i])
}

fn area(x: &Triangle) -> f64 {
    (x[1] - x[0]).cross(&(x[2] - x[0])).norm() / 2.0
}

/// The rest shape of the tables: (0, 0), (1, 0), (0.2, 0.9), times `edge` in m.
fn rest_shape(edge: f64) -> Triangle {
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.9, 0.0]].map(|p| Point3::from(p) * edge)
}

fn equilateral() -> Triangle {
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.75f64.sqrt(), 0.0]].map(Point3::from)
}

/// `x` scaled so that its area is `stretch` times as large.
fn stretched(x: Triangle, stretch: f64) -> Triangle {
    x.map(|p| p * stretch.sqrt())
}

const ONES: [f64; 3] = [1.0; 3];

fn assert_near(value: f64, expected: f64, tolerance: f64) {
    assert!((value / expected - 1.0).abs() < tolerance, "{value} is not {expected}");
}

/// Fault 1: the gradient at the third vertex has the wrong sign, so the corrections do not sum to
/// zero.
#[test]
fn fault_1_as_printed_creates_momentum() {
    let x = stretched(rest_shape(1.0), 1.21);
    let rest_area = area(&rest_shape(1.0));
    let momentum = |by: [Vector3<f64>; 3]| {
        let sum: Vector3<f64> = by.iter().sum();
        sum.norm() / by.iter().map(Vector3::norm).sum::<f64>()
    };
    let printed = momentum(algorithm_1(Gradients::Printed, &x, ONES, rest_area, 1.0, 0.0));
    let sign = momentum(algorithm_1(Gradients::CorrectSign, &x, ONES, rest_area, 1.0, 0.0));
    let right = momentum(correct_gradient(&x, ONES, rest_area, 0.0));
    println!(
        "momentum |Σ m Δx| / Σ |m Δx|: as printed {printed:.3}, correct sign {sign:.0e}, Cutis {right:.0e}"
    );
    // The third correction is proportional to edge 12. Reversed, it counts twice.
    let [p1, p2, p3] = rest_shape(1.0);
    let (a, b, c) = ((p2 - p3).norm(), (p3 - p1).norm(), (p1 - p2).norm());
    assert_near(printed, 2.0 * c / (a + b + c), 1e-12);
    assert_near(printed, 0.640, 1e-3);
    assert!(sign < 1e-15 && right < 1e-15);
}

/// Fault 1, compared with finite differences: only the third gradient points the wrong way.
#[test]
fn fault_1_is_at_the_third_corner() {
    let x = stretched(rest_shape(1.0), 1.21);
    let cosines = |gradients| {
        // The correction of a stretched triangle points against the gradient.
        let by = algorithm_1(gradients, &x, ONES, area(&rest_shape(1.0)), 1.0, 0.0);
        std::array::from_fn::<f64, 3, _>(|i| {
            let step = 1e-6;
            let gradient = Vector3::from_fn(|axis, _| {
                let shifted = |steps: f64| {
                    let mut x = x;
                    x[i][axis] += steps * step;
                    area(&x)
                };
                (shifted(1.0) - shifted(-1.0)) / (2.0 * step)
            });
            -by[i].dot(&gradient) / (by[i].norm() * gradient.norm())
        })
    };
    for (gradients, name, expected) in [
        (Gradients::Printed, "as printed", [1.0, 1.0, -1.0]),
        (Gradients::CorrectSign, "with correct sign", [1.0, 1.0, 1.0]),
    ] {
        let cosines = cosines(gradients);
        println!("cosine between gradient {name} and true gradient, corners 1 to 3: {cosines:.6?}");
        for (cosine, expected) in cosines.into_iter().zip(expected) {
            assert_near(cosine, expected, 1e-8);
        }
    }
}

/// Fault 2: the gradients are `4A` times too long, so the correction is `1/(4A)` of a Newton step.
#[test]
fn fault_2_as_printed_depends_on_the_unit_of_length() {
    println!("area stretched by 21 %, one projection, k = 1, β = 0; area/rest area − 1 after it:");
    println!("edge in m   as printed   correct sign     correct gradient energy form");
    let rows = [1e-3, 1.0, 1e3].map(|edge| {
        let x = stretched(rest_shape(edge), 1.21);
        let rest_area = area(&rest_shape(edge));
        let left = |by| area(&moved(&x, by)) / rest_area - 1.0;
        let row = [
            left(algorithm_1(Gradients::Printed, &x, ONES, rest_area, 1.0, 0.0)),
            left(algorithm_1(Gradients::CorrectSign, &x, ONES, rest_area, 1.0, 0.0)),
            left(correct_gradient(&x, ONES, rest_area, 0.0)),
            left(pbd(&SkinTension::eval(&x, &[rest_area, 0.0]), ONES)),
        ];
        println!("{edge:9.0e}   {:10.4e}   {:14.4e}   {:14.4}   {:11.4}", row[0], row[1], row[2], row[3]);
        row
    });
    assert_near(rows[0][0], 5.715e8, 1e-3);
    assert_near(rows[0][1], 1.714e9, 1e-3);
    assert_near(rows[1][0], 0.1714, 1e-3);
    assert_near(rows[1][1], 0.1153, 1e-3);
    assert_near(rows[2][0], 0.21, 1e-5);
    assert_near(rows[2][1], 0.21, 1e-5);
    for [_, _, right, energy] in rows {
        assert_near(right, 0.00813, 1e-3);
        // Without amplification the energy form is the same constraint.
        assert_eq!(right, energy);
    }
}

/// Area over rest area after each projection of a triangle that starts at `stretch`. Stops when the
/// area is above 1e6 or not a number.
fn areas(x: &Triangle, stretch: f64, step: impl Fn(&Triangle, f64) -> [Vector3<f64>; 3]) -> Vec<f64> {
    let rest_area = area(x);
    let mut x = stretched(*x, stretch);
    let mut areas = Vec::new();
    for _ in 0..200 {
        x = moved(&x, step(&x, rest_area));
        areas.push(area(&x) / rest_area);
        if areas.last().is_none_or(|&a| a.is_nan() || a > 1e6) {
            break;
        }
    }
    areas
}

/// A row of the table of fault 3: `β`, `A/A0` at the start, and `A/A0` after the first projections
/// of the three forms.
struct AreaSeries {
    beta: f64,
    stretch: f64,
    diverges: bool,
    printed: &'static [f64],
    paper: &'static [f64],
    energy: &'static [f64],
}

const PLAIN: &[f64] = &[3.025, 1.3389, 1.0214];
const SERIES: [AreaSeries; 4] = [
    AreaSeries { beta: 0.0, stretch: 10.0, diverges: false, printed: PLAIN, paper: PLAIN, energy: PLAIN },
    AreaSeries {
        beta: 1.0,
        stretch: 1.5,
        diverges: false,
        printed: &[0.84375, 1.0072],
        paper: &[1.0417, 1.0004],
        energy: &[1.0885, 1.0041],
    },
    AreaSeries {
        beta: 1.0,
        stretch: 10.0,
        diverges: true,
        printed: &[122.5, 4.3733e5, 2.0911e16],
        paper: PLAIN,
        energy: &[4.6923, 2.3637, 1.3906],
    },
    AreaSeries {
        beta: 5.0,
        stretch: 1.5,
        diverges: true,
        printed: &[0.2604, 1.5251, 0.2154, 1.7142, 0.0039, 64.63],
        paper: &[1.0417, 1.0004],
        energy: &[1.1432, 1.0232],
    },
];

/// Fault 3: the amplification multiplies the step, which overshoots even with the correct gradient.
#[test]
fn fault_3_amplification_diverges() {
    println!("equilateral triangle, k = 1, correct gradient; area over rest area after each projection:");
    for AreaSeries { beta, stretch, diverges, printed, paper, energy } in SERIES {
        println!("β = {beta}, A/A0 = {stretch} at the start");
        let x = equilateral();
        let forms = [
            ("as printed", printed, areas(&x, stretch, |x, rest| correct_gradient(x, ONES, rest, beta))),
            (
                "paper form",
                paper,
                areas(&x, stretch, |x, rest| pbd(&SkinTensionPaper::eval(x, &[rest, beta, 1.0]), ONES)),
            ),
            (
                "energy form",
                energy,
                areas(&x, stretch, |x, rest| pbd(&SkinTension::eval(x, &[rest, beta]), ONES)),
            ),
        ];
        for (name, expected, areas) in forms {
            let first: Vec<_> = areas.iter().take(8).map(|a| format!("{a:.4}")).collect();
            println!("  {name:11}  {}", first.join(" "));
            for (&area, &expected) in areas.iter().zip(expected) {
                assert_near(area, expected, 1e-2);
            }
            let last = areas.last().copied().unwrap_or(f64::NAN);
            if diverges && name == "as printed" {
                assert!(last.is_nan() || last > 1e6, "{areas:?}");
            } else {
                assert_near(last, 1.0, 1e-12);
                assert!(areas.iter().all(|&a| a <= stretch));
            }
        }
    }
}
