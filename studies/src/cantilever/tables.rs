//! Tables of the page, from the file that `tests/python/cantilever.py` writes: the results of Cutis
//! and of the FEM.

use std::path::Path;

use anyhow::Context;
use nalgebra::Vector3;
use serde_json::Value;

use crate::kit::{Failure, Page, Provenance, Table, number, results};

/// Tables of the page.
pub const TABLES: [&str; 6] = ["provenance", "programs", "short-substeps", "real-time", "moduli", "controls"];

/// Writes the tables of the page.
///
/// # Errors
/// The file is not a result of the comparison, or the page cannot be written.
pub fn write(file: &Path, mut provenance: Provenance) -> Result<(), Failure> {
    let mut page = Page::open("cantilever", &TABLES)?;
    let found: Value = serde_json::from_slice(&std::fs::read(file)?)?;
    if let Some(gpu) = found["gpu"].as_str() {
        provenance.adapter(gpu);
    }
    let python = found["python"].as_str().unwrap_or("unknown");
    page.set("provenance", &format!("{} FEM: {python}.", provenance.markdown()))?;
    let cases = found["cases"].as_array().context("the file has no cases")?;
    page.set("programs", &programs(cases)?.markdown())?;
    page.set("short-substeps", &short_substeps(cases)?.markdown())?;
    page.set("real-time", &real_time(cases)?.markdown())?;
    page.set("moduli", &moduli(cases)?.markdown())?;
    page.set("controls", &controls(cases).markdown())?;
    page.save(&results())?;
    Ok(())
}

fn vector(value: &Value) -> Result<Vector3<f64>, Failure> {
    let numbers: [f64; 3] = serde_json::from_value(value.clone())?;
    Ok(numbers.into())
}

fn figure(value: &Value) -> String {
    number(value.as_f64().unwrap_or(f64::NAN))
}

/// Displacement of the end in percent: down, or sideways.
fn down(x: &Vector3<f64>) -> String {
    format!("{:.4}", -100.0 * x.y)
}

fn name(case: &Value) -> String {
    case["name"].as_str().unwrap_or_default().into()
}

/// Newton's method against scikit-fem.
fn programs(cases: &[Value]) -> Result<Table, Failure> {
    let mut table = Table::new([
        "case",
        "E, Pa",
        "down, % of length",
        "sideways, %",
        "difference of the end",
        "difference of all vertices (RMS)",
        "derivatives of the FEM",
    ]);
    for case in cases {
        let fem = &case["fem"];
        let x = vector(&fem["displacement"])?;
        let differences = ["newton_end", "newton_field", "derivatives"].map(|key| figure(&fem[key]));
        let sizes =
            [name(case), figure(&case["material"]["youngs_pa"]), down(&x), format!("{:.4}", 100.0 * x.z)];
        table.add(sizes.into_iter().chain(differences));
    }
    Ok(table)
}

/// Cells of a run: substeps × iterations, length of a substep, displacement, difference from the
/// FEM, at rest.
fn run_cells(run: &Value, reference: &Vector3<f64>) -> Result<[String; 5], Failure> {
    let stepping = &run["stepping"];
    let substeps = stepping["substeps"].as_f64().unwrap_or(f64::NAN);
    let length_ms = 1e3 * stepping["dt_s"].as_f64().unwrap_or(f64::NAN) / substeps;
    let setting = format!("{} × {}", stepping["substeps"], stepping["iterations"]);
    let rest = &run["rest"];
    if rest.is_null() {
        return Ok([setting, number(length_ms), "diverged".into(), "–".into(), "–".into()]);
    }
    let x = vector(&rest["displacement"])?;
    let at_rest = if rest["at_rest"] == true { "yes" } else { "no" };
    Ok([setting, number(length_ms), down(&x), number(100.0 * error(&x, reference)), at_rest.into()])
}

fn error(x: &Vector3<f64>, reference: &Vector3<f64>) -> f64 {
    (x - reference).norm() / reference.norm()
}

/// XPBD with short substeps against the FEM.
fn short_substeps(cases: &[Value]) -> Result<Table, Failure> {
    let mut table = Table::new([
        "case",
        "backend",
        "substeps × iterations",
        "substep, ms",
        "down, % of length",
        "error, %",
        "at rest",
        "strain over rounding in `f32`",
    ]);
    for case in cases {
        let reference = vector(&case["fem"]["displacement"])?;
        for run in case["converged"].as_array().into_iter().flatten() {
            let [backend, precision] =
                ["backend", "precision"].map(|key| run[key].as_str().unwrap_or_default().to_owned());
            let cells = run_cells(run, &reference)?;
            let resolution = figure(&case["fem"]["f32_resolution"]);
            table.add(
                [name(case), format!("{backend} {precision}")].into_iter().chain(cells).chain([resolution]),
            );
        }
    }
    Ok(table)
}

/// The real-time setting with the smallest error, for each case and formulation.
fn real_time(cases: &[Value]) -> Result<Table, Failure> {
    let mut table = Table::new([
        "case",
        "FEM: down, % of length",
        "formulation",
        "best setting",
        "substep, ms",
        "down, %",
        "error, %",
        "at rest",
    ]);
    for case in cases {
        let reference = vector(&case["fem"]["displacement"])?;
        for formulation in ["xpbd", "vbd", "pbd"] {
            let runs = case["real_time"].as_array().into_iter().flatten();
            let mut best: Option<(f64, &Value)> = None;
            for run in
                runs.filter(|run| run["stepping"]["formulation"] == formulation && !run["rest"].is_null())
            {
                let error = error(&vector(&run["rest"]["displacement"])?, &reference);
                if best.is_none_or(|(least, _)| error < least) {
                    best = Some((error, run));
                }
            }
            if let Some((_, run)) = best {
                let start = [name(case), down(&reference), formulation.to_owned()];
                table.add(start.into_iter().chain(run_cells(run, &reference)?));
            }
        }
    }
    Ok(table)
}

/// Moduli of the lattice over the modulus `E` of its springs.
fn moduli(cases: &[Value]) -> Result<Table, Failure> {
    let mut table = Table::new([
        "case",
        "along an axis / E",
        "along the diagonal / E",
        "isotropic / E",
        "Poisson's ratio",
        "isotropic: down, %",
        "same energy: down, %",
    ]);
    for case in cases {
        let (small, youngs) = (&case["fem"]["small_strain"], case["material"]["youngs_pa"].as_f64());
        let share = |key: &str| {
            let modulus = small[key].as_f64().zip(youngs).map(|(modulus, youngs)| modulus / youngs);
            format!("{:.4}", modulus.unwrap_or(f64::NAN))
        };
        table.add([
            name(case),
            share("along_axis_pa"),
            share("along_diagonal_pa"),
            share("youngs_pa"),
            figure(&small["poisson"]),
            down(&vector(&small["displacement"])?),
            down(&vector(&case["fem"]["displacement"])?),
        ]);
    }
    Ok(table)
}

/// Faults that the comparison must notice.
fn controls(cases: &[Value]) -> Table {
    let mut table = Table::new(["case", "fault", "difference of the end"]);
    for case in cases {
        for (what, difference) in case["fem"]["controls"].as_object().into_iter().flatten() {
            table.add([name(case), what.clone(), figure(difference)]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_best_setting_of_each_formulation_is_listed() {
        let run = |iterations, y: f64| {
            json!({"stepping": {"formulation": "xpbd", "dt_s": 0.01, "substeps": 10, "iterations": iterations},
                   "rest": {"displacement": [0.0, y, 0.0], "at_rest": true}})
        };
        let diverged = json!({"stepping": {"formulation": "xpbd", "dt_s": 0.01, "substeps": 1, "iterations": 1},
                              "rest": null});
        let case = json!({"name": "beam", "fem": {"displacement": [0.0, -0.1, 0.0]},
                          "real_time": [run(1, -0.3), diverged, run(2, -0.12)]});
        let text = real_time(&[case]).unwrap().markdown();
        assert!(text.contains("| beam | 10.0000 | xpbd | 10 × 2 | 1.00 | 12.0000 | 20.0 | yes |"), "{text}");
        assert_eq!(text.lines().count(), 3, "{text}");
    }
}
