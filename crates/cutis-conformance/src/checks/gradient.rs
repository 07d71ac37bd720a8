//! Check: the gradient is the derivative of the value.

use cutis_constraints::{Constraint, Eval, UnitGradients};
use nalgebra::Vector3;

use crate::alteration::{Alteration, FACTOR};
use crate::measure::{largest, length};
use crate::{Case, Report, Subject};

/// Bound on the relative error against finite differences. The controls are off by 1e-3.
const BOUND: f64 = 1e-6;
/// Step of the differences, relative to the length scale.
const STEP: f64 = 1e-4;

/// The gradient agrees with central finite differences of fourth order in `f64` to 1e-6 of its own
/// length.
///
/// [`Constraint::unit_gradients`] gives the same gradients, and they have the length 1.
///
/// For a constraint with [`direction_only`](Subject::direction_only), only the directions are
/// compared. Controls: each gradient off by 1e-3, and swapped neighbors, must be noticed.
pub fn gradient<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Report {
    let mut report = Report::new(C::NAME, "gradient");
    let cases = subject.cases();
    let differences: Vec<_> = cases.iter().map(differences::<C, N>).collect();
    let error = |alter: &dyn Fn(Eval<f64, N>) -> Eval<f64, N>| {
        let of_case = |(case, expected): (&Case<N>, &[Vector3<f64>; N])| {
            relative_error(alter(case.eval::<C, f64>()).grad, *expected, subject.direction_only)
        };
        cases.iter().zip(&differences).map(of_case).fold(0.0, largest)
    };
    report.at_most("error against finite differences", error(&|eval| eval), BOUND);
    let alterations = Alteration::of::<C, N>(&cases).into_iter().filter(|&one| one != Alteration::Value);
    // With a single gradient, a wrong length does not change the direction.
    for alteration in alterations.filter(|_| N > 1 || !subject.direction_only) {
        report.control(alteration, error(&|eval| alteration.apply(eval)), 100.0 * BOUND);
    }
    unit_gradients::<C, N>(&cases, &mut report);
    report
}

/// The result of [`Constraint::unit_gradients`], if there is one, has the value and the gradients
/// of `eval`, and its vectors have the length that it gives. Control: a length off by 1e-3.
fn unit_gradients<C: Constraint<N>, const N: usize>(cases: &[Case<N>], report: &mut Report) {
    let pairs: Vec<_> = cases
        .iter()
        .filter_map(|case| Some((case.eval::<C, f64>(), case.unit_gradients::<C, f64>()?)))
        .collect();
    if pairs.is_empty() {
        return;
    }
    let error = |factor: f64| {
        let of_pair = |(eval, found): &(Eval<f64, N>, UnitGradients<f64, N>)| {
            let length = found.length * factor;
            let of_vertex = |(along, grad): (&Vector3<f64>, &Vector3<f64>)| {
                largest((along / length - grad).norm(), (along.norm() / length - 1.0).abs())
            };
            let of_vertices = found.along.iter().zip(&eval.grad).map(of_vertex).fold(0.0, largest);
            if eval.c == found.c { of_vertices } else { f64::INFINITY }
        };
        pairs.iter().filter(|(_, found)| found.length != 0.0).map(of_pair).fold(0.0, largest)
    };
    report.at_most("unit gradients against gradients", error(1.0), BOUND);
    report.control("their length × 1.001", error(FACTOR), 100.0 * BOUND);
}

/// Returns the central differences of the value in every coordinate.
fn differences<C: Constraint<N>, const N: usize>(case: &Case<N>) -> [Vector3<f64>; N] {
    let step = STEP * case.scale;
    let mut result = [Vector3::zeros(); N];
    for i in 0..N {
        for axis in 0..3 {
            let c = |steps: f64| {
                let mut moved = case.clone();
                moved.x[i][axis] += steps * step;
                moved.eval::<C, f64>().c
            };
            result[i][axis] = (8.0 * (c(1.0) - c(-1.0)) - (c(2.0) - c(-2.0))) / (12.0 * step);
        }
    }
    result
}

fn relative_error<const N: usize>(
    found: [Vector3<f64>; N],
    expected: [Vector3<f64>; N],
    direction_only: bool,
) -> f64 {
    let norm = |grad: &[Vector3<f64>; N]| grad.iter().map(Vector3::norm_squared).sum::<f64>().sqrt();
    let (found, expected) = if direction_only {
        let unit = |grad: [Vector3<f64>; N]| grad.map(|g| g / norm(&grad));
        (unit(found), unit(expected))
    } else {
        (found, expected)
    };
    let difference = std::array::from_fn::<_, N, _>(|i| found[i] - expected[i]);
    let size = largest(length(&found), length(&expected));
    if size == 0.0 { 0.0 } else { length(&difference) / size }
}
