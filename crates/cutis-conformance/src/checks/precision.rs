//! Check: single precision is sufficient.

use cutis_constraints::Constraint;

use crate::alteration::Alteration;
use crate::measure::{Deviation, errors};
use crate::{Case, Report, Subject};

/// Bound on the deviation of `f32` from `f64`: a tenth of the error of the controls.
const BOUND: f64 = 1e-4;

/// Value and gradient in `f32` agree with `f64` on the same numbers to 1e-4, per scale, relative to
/// [`Case::size`]. With a larger rounding error, an error of 1e-3 on a device could remain hidden.
/// Controls: each alteration must be noticed.
pub fn precision<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Report {
    let mut report = Report::new(C::NAME, "precision");
    let cases = subject.cases();
    for errors in errors::<C, f32, N>(&cases, &cases.iter().map(Case::eval::<C, f32>).collect::<Vec<_>>()) {
        for (what, Deviation { worst, .. }) in [("value", errors.value), ("gradient", errors.gradient)] {
            report.at_most(format!("{what} in f32 at {} m", errors.scale), worst, BOUND);
        }
    }
    for alteration in Alteration::of::<C, N>(&cases) {
        let altered: Vec<_> = cases.iter().map(|case| alteration.apply(case.eval::<C, f32>())).collect();
        let worst = errors::<C, f32, N>(&cases, &altered)
            .iter()
            .map(|errors| f64::max(errors.value.worst, errors.gradient.worst))
            .fold(f64::INFINITY, f64::min);
        report.control(alteration, worst, BOUND);
    }
    report
}
