//! Checks of the measurements, and controls that must be refused.

use super::config::{Backend, Config, GPU, SOFTWARE_GPU, VBD, XPBD};
use super::measurement::{Measure, Measurement};
use super::problems::Problem;
use super::reference::Reference;
use super::sweep::substep;
use crate::kit::{Checks, Failure, larger, percent};

/// Largest E3 of the best setting of VBD.
const CONVERGED: f64 = 0.01;
/// Largest E3 of the best setting of XPBD.
const CLOSE: f64 = 0.05;
/// Largest difference in E1 between `f32` and `f64`. With short substeps, the last digit of a
/// position is a large part of the motion in a step.
const SINGLE: f64 = 0.05;
/// The control with a wrong substep must have a larger E1.
const WRONG_STEP: f64 = 0.01;
/// Factor by which an error may rise where it should fall. The causes are rounding, and root mean
/// squares of a sweep that moves the last vertices most.
const SLACK: f64 = 1.05;

/// Checks the measurements of one problem.
///
/// # Errors
/// A control cannot be run.
pub fn check(problem: &Problem, reference: &Reference, rows: &[Measurement]) -> Result<Checks, Failure> {
    let mut checks = Checks::default();
    let (name, double) = (problem.name, Backend::CpuDouble.name());
    for (method, most) in [(XPBD, CLOSE), (VBD, CONVERGED)] {
        let formulation = method.formulation;
        let of_method = || rows.iter().filter(|row| row.backend == double && row.method() == formulation);
        let mut line: Vec<(u32, f64)> = of_method()
            .filter(|row| row.substeps == 10)
            .filter_map(|row| Some((row.iterations, row.e1?)))
            .collect();
        line.sort_by_key(|(iterations, _)| *iterations);
        let falls = line.len() > 2 && line.windows(2).all(|pair| pair[1].1 <= SLACK * pair[0].1);
        let errors: Vec<String> = line.iter().map(|(n, error)| format!("{n}: {error:.2e}")).collect();
        let errors = errors.join(", ");
        checks.add(
            format!("{name}: {formulation}: E1 falls with the iterations of 10 substeps ({errors})"),
            falls,
        );
        let least = of_method().filter_map(|row| row.valid_error(Measure::E3)).fold(f64::INFINITY, f64::min);
        let most_percent = percent(most);
        checks.add(
            format!(
                "{name}: {formulation}: some setting settles within {most_percent} of the equilibrium (E3 {least:.2e})"
            ),
            least < most,
        );
    }
    for (backend, other, most) in [
        (Backend::Reference.name(), double, 0.0),
        (Backend::Cpu.name(), double, SINGLE),
        (SOFTWARE_GPU, Backend::Cpu.name(), 0.0),
        (GPU, Backend::Cpu.name(), SINGLE),
    ] {
        if let Some((count, apart)) = apart(rows, backend, other) {
            checks.add(
                format!(
                    "{name}: E1 of {backend} and {other} differ by at most {most} in {count} settings ({apart:.2e})"
                ),
                count > 2 && apart <= most,
            );
        }
    }

    let fine =
        Config { backend: Backend::CpuDouble, method: XPBD, substeps: 10, iterations: 64, settles: false };
    let found = substep(problem, &fine, &reference.states[0])?;
    let wrong = reference.step_of(0, fine.substeps, 1.1)?;
    let error = reference.error(&found, &wrong.minimum, &wrong.start);
    checks.control(
        format!("{name}: the minimizer of a step 1.1 times as long is refused (E1 {error:.2e})"),
        error > WRONG_STEP,
    );
    let still = reference.e3(reference.rest());
    checks.control(
        format!("{name}: a body that never moved has an E3 of 1 ({still})"),
        (still - 1.0).abs() < 1e-12,
    );
    Ok(checks)
}

/// Number of settings that both backends ran, and their largest difference in E1. `None` if
/// `backend` did not run.
fn apart(rows: &[Measurement], backend: &str, other: &str) -> Option<(usize, f64)> {
    let setting = |row: &Measurement| (row.method(), row.substeps, row.iterations);
    let of =
        |backend: &str| -> Vec<&Measurement> { rows.iter().filter(|row| row.backend == backend).collect() };
    let (ours, theirs) = (of(backend), of(other));
    let differences: Vec<f64> = ours
        .iter()
        .filter_map(|row| {
            let same = theirs.iter().find(|other| setting(other) == setting(row))?;
            Some((row.e1? - same.e1?).abs())
        })
        .collect();
    (!ours.is_empty()).then(|| (differences.len(), differences.iter().copied().fold(0.0, larger)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backends_are_compared_setting_by_setting() {
        let row = |backend, iterations, e1| Measurement {
            backend,
            iterations,
            e1: Some(e1),
            ..Measurement::default()
        };
        let rows = [row("a", 1, 0.5), row("a", 2, 0.25), row("b", 2, 0.5), row("b", 3, 9.0)];
        assert_eq!(apart(&rows, "a", "b"), Some((1, 0.25)));
        assert_eq!(apart(&rows, "c", "b"), None);
        assert!(apart(&[row("a", 1, f64::NAN), row("b", 1, 0.0)], "a", "b").unwrap().1.is_nan());
    }
}
