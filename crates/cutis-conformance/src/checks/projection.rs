//! What a solver does with the constraint on the CPU.

use cutis_constraints::Constraint;
use cutis_solver_cpu::SolverCpu;

use crate::alter::{Altered, WrongGradient, WrongValue};
use crate::body::{Body, Plan, after_a_frame, differing};
use crate::measure::Deviation;
use crate::{ConformanceError, Report, SCALES, Subject};

/// Bound on how far `f32` lands from `f64`, over the length scale.
const BOUND: f64 = 1e-4;

/// Elements on their own and, unless [`anchored`](Subject::anchored), a chain of elements, run for a frame: one projection and
/// several, PBD and XPBD, with multipliers and without.
///
/// The threaded backend ends with the bits of the reference, and `f32` within 1e-4 of the length scale of `f64`. Controls: a value
/// and a gradient that are off by 1e-3 must be seen.
///
/// # Errors
/// A body that is refused or leaves the finite numbers.
pub fn projection<C: Constraint<N>, const N: usize>(
    subject: &Subject<C, N>,
) -> Result<Report, ConformanceError> {
    let mut report = Report::new(C::NAME, "projection");
    for body in bodies(subject)? {
        for plan in Plan::of(subject.direction_only) {
            let what = format!("{}, {}", plan.name, body.name);
            let exact = body.reference::<C, f64>(plan)?;
            let single = body.reference::<C, f32>(plan)?;
            let mut threaded = SolverCpu::new(body.system::<C, f32>(plan)?, plan.settings(), Some(2))?;
            let threaded = after_a_frame(&mut threaded)?;
            report.at_most(
                format!("{what}: other bits on threads"),
                differing(&threaded, &single) as f64,
                0.0,
            );
            let worst = Deviation::of(body.distances(&single, &exact)).worst;
            report.at_most(format!("{what}: f32 from f64"), worst, BOUND);
            for (wrong, result) in [
                ("value", body.reference::<Altered<C, WrongValue>, f64>(plan)?),
                ("gradient", body.reference::<Altered<C, WrongGradient>, f64>(plan)?),
            ] {
                let seen = Deviation::of(body.distances(&single, &result)).worst;
                report.control(format!("{what}: {wrong} off by 1e-3"), seen, BOUND);
            }
        }
    }
    Ok(report)
}

/// The bodies that solvers run.
pub(crate) fn bodies<C: Constraint<N>, const N: usize>(
    subject: &Subject<C, N>,
) -> Result<Vec<Body<N>>, ConformanceError> {
    let cases = subject.cases();
    let mut bodies = Vec::new();
    for scale in SCALES {
        bodies.push(Body::soup(&cases, scale)?);
    }
    if N > 1 && !subject.anchored {
        bodies.push(Body::chain(&cases, 1.0)?);
    }
    Ok(bodies)
}
