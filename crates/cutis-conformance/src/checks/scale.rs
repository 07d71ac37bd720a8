//! Check: the formula contains no length, so a shape gives the same results at every scale.

use cutis_constraints::{Constraint, Eval};

use crate::measure::{largest, numbers};
use crate::{Case, Report, SCALES, Subject};

/// Bound on the rounding error in `f64`.
const BOUND: f64 = 1e-9;
/// The absolute length of the control, in m.
const LENGTH: f64 = 1e-6;

/// The same shapes at 1 mm, 1 m and 1 km have the same value over rest size, and the same gradient
/// times length over rest size, in `f64` to 1e-9. This reveals an absolute length or an absolute
/// epsilon in the formula.
///
/// Skipped for constraints [`with_own_length`](Subject::with_own_length). Control: a micrometer
/// added to one coordinate must be noticed.
pub fn scale<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Report {
    let check = "scale";
    if subject.has_length {
        return Report::skipped(C::NAME, check, "the constraint contains a length");
    }
    let mut report = Report::new(C::NAME, check);
    let cases = subject.similar_cases();
    let per_scale = cases.len() / SCALES.len();
    let meter = &cases[per_scale..2 * per_scale];
    let error = |absolute: f64| {
        let mut worst = 0.0;
        for (case, of_meter) in cases.chunks(per_scale.max(1)).flat_map(|scale| scale.iter().zip(meter)) {
            let (expected, found) =
                (without_unit::<C, N>(of_meter, absolute), without_unit::<C, N>(case, absolute));
            let size = numbers(&expected).map(f64::abs).fold(0.0, largest);
            let difference = numbers(&expected).zip(numbers(&found)).map(|(a, b)| (a - b).abs());
            worst = largest(difference.fold(0.0, largest) / size, worst);
        }
        worst
    };
    report.at_most("difference between scales", error(0.0), BOUND);
    report.control("a length of 1e-6 m", error(LENGTH), 100.0 * BOUND);
    report
}

/// Value over rest size and gradients times length over rest size, with one coordinate moved by an
/// absolute length.
fn without_unit<C: Constraint<N>, const N: usize>(case: &Case<N>, absolute: f64) -> Eval<f64, N> {
    let mut moved = case.clone();
    moved.x[0].x += absolute;
    let eval = moved.eval::<C, f64>();
    let rest_size = C::rest_size(&case.params::<C, f64>());
    Eval { c: eval.c / rest_size, grad: eval.grad.map(|g| g * (case.scale / rest_size)) }
}
