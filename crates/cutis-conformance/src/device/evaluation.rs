//! Check: value and gradient on a device.

use cutis_constraints::{Constraint, Eval, Params};
use cutis_gpu::{Gpu, GpuError};
use cutis_shaders::solver;
use nalgebra::Vector3;

use super::{is_exact, report};
use crate::alteration::Alteration;
use crate::measure::{Deviation, Errors, errors, excess, largest, numbers, tolerance};
use crate::{Case, ConformanceError, Report, Subject};

/// Value and gradient on the device and on the CPU, in `f32`, compared with `f64` on the same
/// numbers, per scale and relative to [`Case::size`]. The device may deviate at most 4 times as
/// much as the CPU. On a software adapter every number must be equal.
///
/// Controls: the shader with the value or one gradient off by 1e-3, or with swapped neighboring
/// gradients, must be noticed.
///
/// # Errors
/// [`ConformanceError::Gpu`] if the shader is refused or the device fails.
pub fn evaluation<C: Constraint<N>, const N: usize>(
    subject: &Subject<C, N>,
    gpu: &Gpu,
) -> Result<Report, ConformanceError> {
    let mut report = report(C::NAME, "evaluation", gpu);
    let cases = subject.cases();
    let cpu: Vec<_> = cases.iter().map(Case::eval::<C, f32>).collect();
    let allowed = errors::<C, f32, N>(&cases, &cpu);
    let on_device = evaluate::<C, N>(gpu, C::WGSL, &cases)?;
    for (found, allowed) in errors::<C, f32, N>(&cases, &on_device).iter().zip(&allowed) {
        for (what, found, cpu) in
            [("value", found.value, allowed.value), ("gradient", found.gradient, allowed.gradient)]
        {
            let what = format!("{what} at {} m", allowed.scale);
            let tolerance = tolerance(cpu, f32::EPSILON.into());
            report.at_most(format!("{what}, worst"), found.worst, tolerance.worst);
            report.at_most(format!("{what}, root mean square"), found.rms, tolerance.rms);
        }
    }
    if is_exact(gpu) {
        let different = differing(&on_device, &cpu);
        report.at_most(
            format!("of {} numbers, different from the CPU", cpu.len() * (1 + 3 * N)),
            different as f64,
            0.0,
        );
    }
    for alteration in Alteration::of::<C, N>(&cases) {
        let altered = evaluate::<C, N>(gpu, &alteration.wgsl(C::WGSL), &cases)?;
        report.control(alteration, least_excess(&errors::<C, f32, N>(&cases, &altered), &allowed), 1.0);
        if is_exact(gpu) {
            report.control(format!("{alteration}, other numbers"), differing(&altered, &cpu) as f64, 0.0);
        }
    }
    Ok(report)
}

/// Returns the value and gradients of the samples on the device, from the WGSL source of a
/// constraint.
///
/// # Errors
/// [`GpuError::Shader`] if the source is refused, and the errors of the device.
pub(super) fn evaluate<C: Constraint<N>, const N: usize>(
    gpu: &Gpu,
    constraint: &str,
    cases: &[Case<N>],
) -> Result<Vec<Eval<f32, N>>, GpuError> {
    let point = |p: &nalgebra::Point3<f32>| [p.x, p.y, p.z, 0.0];
    let points: Vec<[f32; 4]> =
        cases.iter().flat_map(|case| case.positions::<f32>().each_ref().map(point)).collect();
    let params: Vec<C::Params<f32>> = cases.iter().map(Case::params::<C, f32>).collect();
    let kernel = gpu.kernel(C::NAME, &solver::evaluate(N, constraint), solver::EVALUATE)?;
    let points = gpu.buffer("points", &points)?;
    let params = gpu.buffer("params", Params::flat(&params))?;
    let found = gpu.zeroed::<[f32; 4]>("found", points.len())?;
    let group = gpu.bind(&kernel, 0, &[(0, points.whole()), (1, params.whole()), (2, found.whole())])?;
    let mut pass = gpu.pass(C::NAME);
    pass.dispatch(&kernel, &[&group], cases.len());
    pass.submit()?;
    let found = gpu.read(&found, 0..found.len())?;
    let eval = |vectors: &[[f32; 4]]| Eval {
        c: vectors[0][3],
        grad: std::array::from_fn(|i| Vector3::new(vectors[i][0], vectors[i][1], vectors[i][2])),
    };
    Ok(found.chunks_exact(N).map(eval).collect())
}

/// Returns the number of unequal numbers.
pub(super) fn differing<const N: usize>(a: &[Eval<f32, N>], b: &[Eval<f32, N>]) -> usize {
    a.iter().flat_map(numbers).zip(b.iter().flat_map(numbers)).filter(|(a, b)| a != b).count()
}

/// Returns the deviation of value or gradient divided by its tolerance, at the scale where it is
/// smallest.
fn least_excess(found: &[Errors], cpu: &[Errors]) -> f64 {
    let of = |found: Deviation, cpu: Deviation| excess(found, tolerance(cpu, f32::EPSILON.into()));
    let both = |(found, cpu): (&Errors, &Errors)| {
        largest(of(found.value, cpu.value), of(found.gradient, cpu.gradient))
    };
    found.iter().zip(cpu).map(both).fold(f64::INFINITY, f64::min)
}
