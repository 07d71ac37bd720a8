//! Runs one case on one backend at one scale, samples the body, and checks the requirement.

use std::time::Instant;

use anyhow::bail;
use cutis_constraints::Scalar;
use cutis_solver::{Settings, Solver, System};
use nalgebra::Point3;

use super::Failure;
use super::case::{Case, End};
use super::energy::{History, Meter, after_last, positions};
use super::trial::{Outcome, Trial};

/// Creates the solver of a backend.
pub type Make<'a, T> = &'a dyn Fn(System<T>, Settings) -> Result<Box<dyn Solver<T>>, Failure>;

/// Error over rest size from which a degenerate element is named.
pub(super) const VIOLATED: f64 = 0.01;
/// Share of the energy that a body at rest may still have.
const AT_REST: f64 = 1e-6;

/// Runs `case` with its geometry multiplied by `scale`.
pub fn run<T: Scalar>(case: &Case, scale: f64, backend: &str, make: Make<'_, T>) -> Trial {
    let start = Instant::now();
    let mut trial =
        Trial { known_failure: case.known_failure, ..Trial::new(&case.name, backend, Some(scale)) };
    trial.outcome = match simulate(case, scale, make, &mut trial) {
        Ok(outcome) => outcome,
        Err(error) => Outcome::Failed(error.to_string()),
    };
    trial.wall_s = start.elapsed().as_secs_f64();
    trial
}

fn simulate<T: Scalar>(
    case: &Case,
    scale: f64,
    make: Make<'_, T>,
    trial: &mut Trial,
) -> Result<Outcome, Failure> {
    let settings = case.settings(scale);
    let mut solver = make(case.body.system(scale)?, settings)?;
    let rest: Vec<Point3<f64>> = case.body.rest.iter().map(|x| x * scale).collect();
    let meter = Meter::new(solver.system()?, &rest, &settings);
    let first = positions(solver.system()?);
    let mut history = History::default();
    history.add(meter.measure(solver.system()?), 0.0);
    let mut errors = vec![meter.error(solver.system()?)];
    let mut work = 0.0;
    let seconds_per_sample = settings.dt_s * case.run.frames as f64;
    for sample in 0..case.run.samples {
        work +=
            work_of_handles(solver.system()?, &meter, sample as f64 * seconds_per_sample, seconds_per_sample);
        solver.step(case.run.frames)?;
        work += meter.heat * f64::from(settings.substeps) * case.run.frames as f64;
        history.add(meter.measure(solver.system()?), work);
        errors.push(meter.error(solver.system()?));
    }
    trial.energy_ratio = Some(history.worst_ratio(meter.rounding));
    trial.error = errors.last().copied();
    trial.rounding_share = Some(
        history
            .share(meter.heat * f64::from(settings.substeps) * (case.run.samples * case.run.frames) as f64),
    );
    let collapsed = solver.system()?.check_collapsed(VIOLATED);
    let time = |sample: usize| sample as f64 * seconds_per_sample;
    let outcome = match case.end {
        End::Named => match collapsed {
            Err(error) => Ok(Outcome::Named(error.to_string())),
            Ok(()) => Err("no error, although elements have collapsed".to_owned()),
        },
        _ if collapsed.is_err() => Err(collapsed.err().map(|error| error.to_string()).unwrap_or_default()),
        End::Bounded => Ok(Outcome::Bounded),
        End::Unmoved if positions(solver.system()?) == first => Ok(Outcome::Settled),
        End::Unmoved => Err("a vertex has moved".to_owned()),
        End::Recovers(level) => match after_last(errors.iter().map(|&error| error.is_nan() || error > level))
        {
            Some(sample) => {
                trial.recovery_s = Some(time(sample));
                Ok(Outcome::Settled)
            }
            None => {
                Err(format!("an element is still off by {:.2e} of its rest size", errors[errors.len() - 1]))
            }
        },
        End::Rests => match history.rests_from(AT_REST, meter.rounding) {
            Some(sample) => {
                trial.recovery_s = Some(time(sample));
                Ok(Outcome::Settled)
            }
            None => Err("it does not come to rest".to_owned()),
        },
    };
    let ratio = trial.energy_ratio.unwrap_or(f64::INFINITY);
    match outcome {
        Ok(_) if ratio.is_nan() || ratio > case.energy => {
            bail!("the energy is {ratio:.2e} times the energy put in; at most {} is allowed", case.energy)
        }
        Ok(outcome) => Ok(outcome),
        Err(reason) => bail!(reason),
    }
}

/// Work of the handles: the elastic energy that moving their vertices would add if all others
/// stayed.
fn work_of_handles<T: Scalar>(system: &System<T>, meter: &Meter, from_s: f64, over_s: f64) -> f64 {
    if system.handles().is_empty() {
        return 0.0;
    }
    let before = positions(system);
    let mut after = before.clone();
    for handle in system.handles() {
        let path = handle.path(from_s + over_s).map(T::to_f64);
        for (&vertex, start) in handle.vertices().iter().zip(handle.start()) {
            after[vertex as usize] = start.map(T::to_f64) + path;
        }
    }
    (meter.elastic(system, &after) - meter.elastic(system, &before)).max(0.0)
}
