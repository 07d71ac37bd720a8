//! What must hold of the rows, and controls that must not pass: so that the command can fail.

use super::Failure;
use super::cases::Case;
use super::config::{Backend, Config, PBD, XPBD};
use super::row::Row;
use super::sweep::substep;
use super::yardstick::Yardstick;

/// The settled body comes as near to the equilibrium as this with some setting, E3.
const CONVERGED: f64 = 0.01;
/// E1 of a well converged substep.
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

    let mut line: Vec<(u32, f64)> = rows
        .iter()
        .filter(|row| {
            row.backend == Backend::CpuDouble.name() && row.method() == XPBD.formulation && row.substeps == 10
        })
        .filter_map(|row| Some((row.iterations, row.e1?)))
        .collect();
    line.sort_by_key(|(iterations, _)| *iterations);
    let falls = line.len() > 2 && line.windows(2).all(|pair| pair[1].1 <= SLACK * pair[0].1);
    let errors: Vec<String> = line.iter().map(|(n, error)| format!("{n}: {error:.2e}")).collect();
    check(falls, format!("{name}: E1 falls with the iterations of 10 substeps ({})", errors.join(", ")));

    let least = |error: &dyn Fn(&Row) -> Option<f64>| {
        rows.iter()
            .filter(|row| row.formulation != PBD.formulation)
            .filter_map(error)
            .fold(f64::INFINITY, f64::min)
    };
    let (e1, e3) = (least(&|row| row.e1), least(&|row| row.e3));
    check(e1 < CONVERGED_STEP, format!("{name}: some substep is within 1 % of its minimiser (E1 {e1:.2e})"));
    check(
        e3 < CONVERGED,
        format!("{name}: some setting settles within 1 % of the equilibrium (E3 {e3:.2e})"),
    );

    // Controls: the measures must see a wrong answer.
    let fine =
        Config { backend: Backend::CpuDouble, method: XPBD, substeps: 10, iterations: 64, settles: false };
    let found = substep(case, &fine, &yardstick.states[0])?;
    let wrong = yardstick.step_of(0, fine.substeps, 1.1)?;
    let error = yardstick.error(&found, &wrong.minimum, &wrong.start);
    let refused = error > CONVERGED_STEP;
    check(
        refused,
        format!("{name}: control: the minimiser of a step 1.1 times as long is refused (E1 {error:.2e})"),
    );
    let still = yardstick.e3(yardstick.rest());
    check(
        (still - 1.0).abs() < 1e-12,
        format!("{name}: control: a body that never moved has an E3 of 1 ({still})"),
    );
    Ok(checks)
}
