//! Check: the formula contains no length, so a shape gives the same results at every scale.

use cutis_constraints::Constraint;

use crate::measure::{largest, numbers};
use crate::{Case, Report, SCALES, Subject};

/// Bound on the rounding error in `f64`.
const BOUND: f64 = 1e-9;
/// Extreme lengths in m. At these scales an absolute length or epsilon of ordinary size dominates a
/// formula. Formulas up to the twelfth power of a length stay within the range of `f64`.
const EXTREMES: [f64; 2] = [1.0 / (1_u128 << 80) as f64, (1_u128 << 80) as f64];
/// The absolute length of the control, in m.
const LENGTH: f64 = 1e-20;

/// The same shapes have the same value over rest size, the same gradient times length over rest
/// size, and the same reach over length, in `f64` to 1e-9. The scales are 1 mm, 1 m, 1 km, 2⁻⁸⁰ m
/// and 2⁸⁰ m. This reveals an absolute length or an absolute epsilon in the formula, even if no
/// shape of ordinary size comes near it.
///
/// Skipped for constraints [`with_own_length`](Subject::with_own_length). Control: a length of
/// 1e-20 m added to one coordinate must be noticed.
pub fn scale<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Report {
    let check = "scale";
    if subject.has_length {
        return Report::skipped(C::NAME, check, "the constraint contains a length");
    }
    let mut report = Report::new(C::NAME, check);
    let meter = subject.similar_cases(1.0);
    let others = [EXTREMES[0], SCALES[0], SCALES[2], EXTREMES[1]].map(|scale| subject.similar_cases(scale));
    let error = |absolute: f64| {
        let mut worst = 0.0;
        for (case, of_meter) in others.iter().flat_map(|cases| cases.iter().zip(&meter)) {
            let expected = without_unit::<C, N>(of_meter, absolute);
            for (expected, found) in expected.iter().zip(without_unit::<C, N>(case, absolute)) {
                let size = expected.iter().map(|value| value.abs()).fold(0.0, largest);
                let difference = expected.iter().zip(found).map(|(a, b)| (a - b).abs()).fold(0.0, largest);
                // Zero at every scale is no difference.
                worst = largest(if difference == 0.0 { 0.0 } else { difference / size }, worst);
            }
        }
        worst
    };
    report.at_most("difference between scales", error(0.0), BOUND);
    report.control("a length of 1e-20 m", error(LENGTH), 100.0 * BOUND);
    report
}

/// Returns the value over rest size and the gradients times length over rest size, followed by the
/// reach over length if the constraint has a reach. One coordinate is moved by an absolute length.
fn without_unit<C: Constraint<N>, const N: usize>(case: &Case<N>, absolute: f64) -> Vec<Vec<f64>> {
    let mut moved = case.clone();
    moved.x[0].x += absolute;
    let mut eval = moved.eval::<C, f64>();
    let params = case.params::<C, f64>();
    // The size of a constraint without a rest size is that of its gradient.
    let rest_size = C::rest_size(&params);
    let rest_size = if rest_size == 0.0 { moved.size::<C>() } else { rest_size };
    eval.c /= rest_size;
    eval.grad = eval.grad.map(|g| g * (case.scale / rest_size));
    let reach = C::inverse_reach_squared(&moved.x, &params);
    let reach = reach.map(|inverse_squared| vec![inverse_squared * case.scale * case.scale]);
    [numbers(&eval).collect()].into_iter().chain(reach).collect()
}
