//! Check: degenerate shapes stay finite on a device.

use cutis_constraints::Constraint;
use cutis_gpu::Gpu;
use cutis_solver::SolverError;
use cutis_solver_gpu::SolverGpu;

use super::evaluation::{differing, evaluate};
use super::{is_exact, report};
use crate::alteration::wrapped;
use crate::checks::{degenerate_cases, finite};
use crate::test_body::{Plan, TestBody, after_a_frame};
use crate::{Case, ConformanceError, Report, SCALES, Subject};

/// The check [`degenerate`](fn@crate::checks::degenerate) on the device: value and gradient are
/// finite, on a software adapter they equal those of the CPU, and a solver that projects such
/// elements stays finite.
///
/// Control: a value with the exponent of infinity must be noticed. A division by zero is not a
/// suitable control, because its result depends on the device.
///
/// # Errors
/// [`ConformanceError::Gpu`] if the shader is refused or the device fails, and the errors of a
/// refused body.
pub fn degenerate<C: Constraint<N>, const N: usize>(
    subject: &Subject<C, N>,
    gpu: &Gpu,
) -> Result<Report, ConformanceError> {
    let mut report = report(C::NAME, "degenerate", gpu);
    let cases = degenerate_cases(subject);
    let not_finite = |wgsl: &str| -> Result<_, ConformanceError> {
        let found = evaluate::<C, N>(gpu, wgsl, &cases)?;
        Ok((found.iter().filter(|eval| !finite(eval)).count() as f64, found))
    };
    let (count, found) = not_finite(C::WGSL)?;
    report.at_most(format!("of {} samples, not finite", cases.len()), count, 0.0);
    if is_exact(gpu) {
        let cpu: Vec<_> = cases.iter().map(Case::eval::<C, f32>).collect();
        report.at_most("numbers that differ from the CPU", differing(&found, &cpu) as f64, 0.0);
    }
    let spoiled = wrapped(C::WGSL, "found.c = bitcast<f32>(bitcast<u32>(found.c) | 0x7f800000u);");
    report.control("the exponent of infinity", not_finite(&spoiled)?.0, 0.0);
    for scale in SCALES {
        let body = TestBody::soup(&cases, scale)?;
        for plan in Plan::of(subject.direction_only) {
            let mut solver = SolverGpu::new(gpu, body.system::<C, f32>(plan)?, plan.settings())?;
            let failed = match after_a_frame(&mut solver) {
                Ok(_) => 0.0,
                Err(SolverError::NotFinite { .. }) => 1.0,
                Err(error) => return Err(error.into()),
            };
            report.at_most(format!("{} at {scale} m, not finite", plan.name), failed, 0.0);
        }
    }
    Ok(report)
}
