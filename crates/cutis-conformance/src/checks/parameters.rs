//! Check: every parameter has an effect on the samples, so that the other checks can notice a wrong
//! one.

use cutis_constraints::{Constraint, Params};

use crate::alteration::FACTOR;
use crate::measure::{largest, length};
use crate::{Case, Report, Subject};

/// Smallest relative effect of a change by 1e-3.
const VISIBLE: f64 = 1e-6;

/// The parameters are finite. A change of each by 1e-3 changes value or gradient by more than 1e-6
/// in at least one sample.
///
/// A parameter without effect is useless, or the materials make it ineffective, for example with an
/// amplification of 0. In the second case choose other materials with [`Subject::new`].
pub fn parameters<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Report {
    let mut report = Report::new(C::NAME, "parameters");
    let cases = subject.cases();
    let not_finite = cases.iter().filter(|case| !case.params.iter().all(|p| p.is_finite())).count();
    report.at_most("samples with a parameter that is not finite", not_finite as f64, 0.0);
    for k in 0..<C::Params<f64> as Params<f64>>::LEN {
        let effect = cases.iter().map(|case| effect::<C, N>(case, k)).fold(0.0, largest);
        report.control(format!("parameter {k} × {FACTOR}"), effect, VISIBLE);
    }
    report
}

/// Returns the effect of a change of parameter `k`, relative to the size of the sample.
fn effect<C: Constraint<N>, const N: usize>(case: &Case<N>, k: usize) -> f64 {
    let mut changed = case.clone();
    changed.params[k] *= FACTOR;
    let (before, after) = (case.eval::<C, f64>(), changed.eval::<C, f64>());
    let difference = std::array::from_fn::<_, N, _>(|i| before.grad[i] - after.grad[i]);
    let change = largest((before.c - after.c).abs(), length(&difference) * case.scale);
    change / case.size::<C>()
}
