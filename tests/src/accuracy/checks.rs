//! What must hold of the rows, and controls that must not pass: so that the command can fail.

use super::Failure;
use super::cases::Case;
use super::config::{Backend, Config, GPU, SOFTWARE_GPU, VBD, XPBD};
use super::row::{Measure, Row};
use super::sweep::substep;
use super::words::percent;
use super::yardstick::Yardstick;
use crate::worst::larger;

/// With some setting VBD settles as near to the equilibrium as this, E3.
const CONVERGED: f64 = 0.01;
/// And XPBD as near as this.
const CLOSE: f64 = 0.05;
/// E1 in `f32` and in `f64` differ by no more: where substeps are short, the last place of a position is a good part of a step.
const SINGLE: f64 = 0.05;
/// E1 of a wrong substep is larger.
const CONVERGED_STEP: f64 = 0.01;
/// An error may rise by so much where it ought to fall: rounding, and root mean squares of a sweep that moves the last vertices
/// most.
const SLACK: f64 = 1.05;

/// One check: what, and whether it holds.
pub struct Check {
    /// In words, with its figures.
    pub what: String,
    /// Whether it holds.
    pub holds: bool,
}

/// The checks of one problem.
///
/// # Errors
/// What keeps a control from being carried out.
pub fn of_problem(case: &Case, yardstick: &Yardstick, rows: &[Row]) -> Result<Vec<Check>, Failure> {
    let mut checks = Vec::new();
    let mut check = |holds: bool, what: String| checks.push(Check { what, holds });
    let name = case.name;

    for method in [XPBD, VBD] {
        let formulation = method.formulation;
        let mut line: Vec<(u32, f64)> = rows
            .iter()
            .filter(|row| {
                row.backend == Backend::CpuDouble.name() && row.method() == formulation && row.substeps == 10
            })
            .filter_map(|row| Some((row.iterations, row.e1?)))
            .collect();
        line.sort_by_key(|(iterations, _)| *iterations);
        let falls = line.len() > 2 && line.windows(2).all(|pair| pair[1].1 <= SLACK * pair[0].1);
        let errors: Vec<String> = line.iter().map(|(n, error)| format!("{n}: {error:.2e}")).collect();
        let errors = errors.join(", ");
        check(
            falls,
            format!("{name}: {formulation}: E1 falls with the iterations of 10 substeps ({errors})"),
        );
    }
    for (method, most) in [(XPBD, CLOSE), (VBD, CONVERGED)] {
        let least = rows
            .iter()
            .filter(|row| row.backend == Backend::CpuDouble.name() && row.method() == method.formulation)
            .filter_map(|row| row.valid_error(Measure::E3))
            .fold(f64::INFINITY, f64::min);
        let what = format!(
            "{name}: {}: some setting settles within {} of the equilibrium (E3 {least:.2e})",
            method.formulation,
            percent(most)
        );
        check(least < most, what);
    }
    let double = Backend::CpuDouble.name();
    for (backend, other, most) in [
        (Backend::Reference.name(), double, 0.0),
        (Backend::Cpu.name(), double, SINGLE),
        (SOFTWARE_GPU, Backend::Cpu.name(), 0.0),
        (GPU, Backend::Cpu.name(), SINGLE),
    ] {
        if let Some((count, apart)) = apart(rows, backend, other) {
            let what = format!(
                "{name}: {backend} and {other} have E1 within {most} of each other in {count} settings ({apart:.2e})"
            );
            check(count > 2 && apart <= most, what);
        }
    }

    // Controls: the measures must see a wrong answer.
    let fine =
        Config { backend: Backend::CpuDouble, method: XPBD, substeps: 10, iterations: 64, settles: false };
    let found = substep(case, &fine, &yardstick.states[0])?;
    let wrong = yardstick.step_of(0, fine.substeps, 1.1)?;
    let error = yardstick.error(&found, &wrong.minimum, &wrong.start);
    let refused = error > CONVERGED_STEP;
    check(
        refused,
        format!("{name}: control: the minimizer of a step 1.1 times as long is refused (E1 {error:.2e})"),
    );
    let still = yardstick.e3(yardstick.rest());
    check(
        (still - 1.0).abs() < 1e-12,
        format!("{name}: control: a body that never moved has an E3 of 1 ({still})"),
    );
    Ok(checks)
}

/// Largest difference in E1 between two backends at the same setting, and how many settings both ran; none if one did not run.
fn apart(rows: &[Row], backend: &str, other: &str) -> Option<(usize, f64)> {
    let setting = |row: &Row| (row.method(), row.substeps, row.iterations);
    let of = |backend: &str| -> Vec<&Row> { rows.iter().filter(|row| row.backend == backend).collect() };
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
        let row = |backend, iterations, e1| Row { backend, iterations, e1: Some(e1), ..Row::default() };
        let rows = [row("a", 1, 0.5), row("a", 2, 0.25), row("b", 2, 0.5), row("b", 3, 9.0)];
        assert_eq!(apart(&rows, "a", "b"), Some((1, 0.25)));
        assert_eq!(apart(&rows, "c", "b"), None);
        assert!(apart(&[row("a", 1, f64::NAN), row("b", 1, 0.0)], "a", "b").unwrap().1.is_nan());
    }
}
