//! Measures the time of a substep, part by part, for a plan.

use std::time::Instant;

use cutis_solver::{Settings, StepProfile, System};

use super::start;
use crate::backend::Chosen;
use crate::{CostReport, Error};

/// Time after which a measurement ends, s. At least one substep is measured.
const LONG_ENOUGH_S: f64 = 0.1;

/// Most iterations of a substep that are measured; further ones are assumed to take as long.
const MOST_ITERATIONS: u32 = 4;

/// Measures substeps of a system that is no longer needed, on a CPU backend. The first
/// substep touches all memory and is not counted; then follow as many as fit into a tenth of a
/// second.
///
/// # Errors
/// The errors of the backend. Exploding numbers are an error of the run, not of its plan.
pub(super) fn substeps(
    backend: &Chosen,
    system: System<f32>,
    settings: Settings,
    costs: CostReport,
) -> Result<CostReport, Error> {
    let iterations = settings.iterations.min(MOST_ITERATIONS);
    let substep = Settings { dt_s: settings.substep_s(), substeps: 1, iterations, ..settings };
    let (mut started, _) = start(backend, system, substep)?;
    let solver = started.solver();
    let (mut times, mut done) = (StepProfile::default(), 0.0);
    if let Err(error) = solver.step(1) {
        return Ok(CostReport { time: format!("not measured: {error}"), ..costs });
    }
    let start = Instant::now();
    while done == 0.0 || start.elapsed().as_secs_f64() < LONG_ENOUGH_S {
        if solver.step_timed(1, &mut times).is_err() {
            break;
        }
        done += 1.0;
    }
    let mut whole = StepProfile::default();
    for part in times.parts() {
        let once_per_substep =
            [StepProfile::VERTICES, StepProfile::HANDLES, StepProfile::MULTIPLIERS, StepProfile::CHECK]
                .contains(&part.name);
        let repeats =
            if once_per_substep { 1.0 } else { f64::from(settings.iterations) / f64::from(iterations) };
        whole.add(part.name, part.seconds * repeats);
    }
    let many = if done == 1.0 { "" } else { "s" };
    let how = format!("{done} substep{many} of the body at rest, on this machine as busy as it is now");
    Ok(costs.with_times(&whole, f64::max(done, 1.0) / f64::from(settings.substeps), &how))
}
