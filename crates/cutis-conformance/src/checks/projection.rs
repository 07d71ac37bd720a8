//! Check: solvers on the CPU handle the constraint.

use cutis_constraints::Constraint;
use cutis_solver_cpu::SolverCpu;

use crate::test_body::{Plan, TestBody, after_a_frame, differing};
use crate::{ConformanceError, Report, SCALES, Subject};

/// Runs separate elements and, unless [`anchored`](Subject::anchored), a chain of elements for a
/// frame: one projection and several, PBD, XPBD and vertex block descent, with and without
/// multipliers. The threaded backend must give the bits of the reference.
///
/// Controls: a value and a gradient that are off by 1e-3 must move the vertices by more than 4
/// times the rounding error of `f32`.
///
/// # Errors
/// A body that a solver refuses, or whose positions become infinite.
pub fn projection<C: Constraint<N>, const N: usize>(
    subject: &Subject<C, N>,
) -> Result<Report, ConformanceError> {
    let mut report = Report::new(C::NAME, "projection");
    for body in bodies(subject)? {
        for plan in Plan::of(subject.direction_only) {
            let what = format!("{}, {}", plan.name, body.name);
            let single = body.reference::<C, f32>(plan)?;
            let mut threaded = SolverCpu::new(body.system::<C, f32>(plan)?, plan.settings(), Some(2))?;
            let threaded = after_a_frame(&mut threaded)?;
            let different = differing(&threaded, &single) as f64;
            report.at_most(format!("{what}: coordinates with other bits on threads"), different, 0.0);
            let tolerance = body.tolerance(&single, &body.reference::<C, f64>(plan)?);
            body.controls::<C>(&mut report, plan, &single, tolerance)?;
        }
    }
    Ok(report)
}

/// Returns the bodies for the solvers.
pub(crate) fn bodies<C: Constraint<N>, const N: usize>(
    subject: &Subject<C, N>,
) -> Result<Vec<TestBody<N>>, ConformanceError> {
    let cases = subject.cases();
    let mut bodies = Vec::new();
    for scale in SCALES {
        bodies.push(TestBody::soup(&cases, scale)?);
    }
    if N > 1 && !subject.anchored {
        bodies.push(TestBody::chain(&cases, 1.0)?);
    }
    Ok(bodies)
}
