//! Check: degenerate shapes stay finite.

use cutis_constraints::{Constraint, Eval, Scalar};

use crate::measure::numbers;
use crate::random::Random;
use crate::{Case, Report, SCALES, Subject, shapes};

/// Value and gradient are finite where points coincide, lie on a line or in a plane, or are all at
/// zero. Such shapes occur as the deformed shape of a regular rest shape, as the rest shape, and as
/// both, at every scale, in `f32` and in `f64`.
///
/// Parameters of a degenerate rest shape that are not finite are ignored, because
/// [`SystemBuilder`](cutis_solver::SystemBuilder) refuses them. Control: a division by the distance
/// of two coincident points must be noticed.
pub fn degenerate<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Report {
    let mut report = Report::new(C::NAME, "degenerate");
    let cases = degenerate_cases(subject);
    count::<C, f32, N>(&mut report, "f32", &cases);
    count::<C, f64, N>(&mut report, "f64", &cases);
    let spoiled = cases.iter().map(|case| {
        let distance = (case.x[0] - case.x[N - 1]).norm();
        let eval = case.eval::<C, f64>();
        Eval { c: eval.c / distance, grad: eval.grad }
    });
    report.control("divided by a distance", spoiled.filter(|eval| !finite(eval)).count() as f64, 0.0);
    report
}

fn count<C: Constraint<N>, T: Scalar, const N: usize>(report: &mut Report, name: &str, cases: &[Case<N>]) {
    let wrong: Vec<&Case<N>> = cases.iter().filter(|case| !finite(&case.eval::<C, T>())).collect();
    report.at_most(format!("of {} samples in {name}, not finite", cases.len()), wrong.len() as f64, 0.0);
    if let Some(first) = wrong.first() {
        report.note(format!("in {name} at {:?} with parameters {:?}", first.x, first.params));
    }
}

pub(crate) fn finite<T: Scalar, const N: usize>(eval: &Eval<T, N>) -> bool {
    numbers(eval).all(|value| value.to_f64().is_finite())
}

/// Degenerate shapes with regular and with degenerate rest shapes, and regular shapes with
/// degenerate rest shapes.
pub(crate) fn degenerate_cases<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Vec<Case<N>> {
    let mut random = Random::new(3);
    let mut cases = Vec::new();
    for scale in SCALES {
        for (_, shape) in shapes::degenerate::<N>() {
            let place = |x: [nalgebra::Point3<f64>; N]| x.map(|p| p.map(|v| f64::from((v * scale) as f32)));
            let (flat, regular) = (place(shape), place(shapes::solid(&mut random)));
            for (x, rest) in [(flat, regular), (flat, flat), (regular, flat)] {
                let params = subject.params_of(&rest);
                cases.extend(params.into_iter().map(|params| Case { scale, x, params }));
            }
        }
    }
    cases
}
