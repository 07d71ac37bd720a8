//! Check: the GPU backend handles the constraint.

use cutis_constraints::Constraint;
use cutis_gpu::Gpu;
use cutis_solver_gpu::SolverGpu;

use super::{is_exact, report};
use crate::checks::bodies;
use crate::test_body::{Plan, after_a_frame, differing};
use crate::{ConformanceError, Report, Subject};

/// Runs the bodies of [`projection`](fn@crate::checks::projection) on the GPU backend. Its vertices
/// may deviate from the reference solver in `f64` at most 4 times as much as the reference solver
/// in `f32` does. On a software adapter they must equal those of the reference solver in `f32`.
///
/// Controls: a reference whose value or gradient is off by 1e-3 must be noticed.
///
/// # Errors
/// [`ConformanceError::SolverGpu`] and [`ConformanceError::Solver`] if the device fails, or the
/// shader or a body is refused.
pub fn projection<C: Constraint<N>, const N: usize>(
    subject: &Subject<C, N>,
    gpu: &Gpu,
) -> Result<Report, ConformanceError> {
    let mut report = report(C::NAME, "projection", gpu);
    for body in bodies(subject)? {
        for plan in Plan::of(subject.direction_only) {
            let what = format!("{}, {}", plan.name, body.name);
            let single = body.reference::<C, f32>(plan)?;
            let exact = body.reference::<C, f64>(plan)?;
            let mut solver = SolverGpu::new(gpu, body.system::<C, f32>(plan)?, plan.settings())?;
            let on_device = after_a_frame(&mut solver)?;
            let (found, tolerance) = (body.deviation(&on_device, &exact), body.tolerance(&single, &exact));
            report.at_most(format!("{what}: worst"), found.worst, tolerance.worst);
            report.at_most(format!("{what}: root mean square"), found.rms, tolerance.rms);
            if is_exact(gpu) {
                let different = differing(&on_device, &single) as f64;
                report.at_most(format!("{what}: coordinates that differ from the CPU"), different, 0.0);
            }
            body.controls::<C>(&mut report, plan, &on_device, tolerance)?;
        }
    }
    Ok(report)
}
