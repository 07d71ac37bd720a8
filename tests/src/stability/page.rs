//! The results as files: every row in docs/results/stability.csv, and per case the worst of it in docs/results/stability.md.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use cutis::report::Machine;

use super::options::Options;
use super::{Failure, Row};

/// Writes both files.
///
/// # Errors
/// Of the files.
pub fn write(rows: &[Row], options: &Options) -> Result<[PathBuf; 2], Failure> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/results");
    let paths = [folder.join("stability.csv"), folder.join("stability.md")];
    for (path, text) in paths.iter().zip([csv(rows), markdown(rows, options)]) {
        fs::write(path, text).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    }
    Ok(paths)
}

fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "case,backend,scale,outcome,energy_ratio,recovery_s,largest_error,rounding_share,wall_s,note\n",
    );
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.6e}"));
    for row in rows {
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{:.3},{}",
            quoted(&row.case),
            quoted(&row.backend),
            row.scale.map_or_else(String::new, |scale| format!("{scale:e}")),
            row.outcome,
            number(row.energy_ratio),
            number(row.recovery_s),
            number(row.error),
            number(row.heat),
            row.wall_s,
            quoted(row.outcome.note()),
        );
    }
    text
}

fn markdown(rows: &[Row], options: &Options) -> String {
    let Machine { cpu, cores, system } = Machine::here();
    let full = if options.full { " --full" } else { "" };
    let failed = rows.iter().filter(|row| !row.outcome.is_good()).count();
    let mut text = format!(
        "# Stability\n\n\
         Written by `cargo xtask stability{full} --write` on {cpu}, {cores} cores, {system}. {} rows, {failed} failed; all of them are in\n\
         `stability.csv`. What each column means, and what must hold: [the page of the book](../book/stability.md).\n\n\
         A line is a case on a backend, with the worst of its length scales 1e-3, 1 and 1e3.\n\n\
         | case | backend | outcome | worst energy ratio | recovery, s | largest error at the end | wall, s |\n\
         |---|---|---|---|---|---|---|\n",
        rows.len()
    );
    let mut done: Vec<(&str, &str)> = Vec::new();
    for row in rows.iter().filter(|row| row.scale.is_some()) {
        let key = (row.case.as_str(), row.backend.as_str());
        if done.contains(&key) {
            continue;
        }
        done.push(key);
        let same: Vec<&Row> =
            rows.iter().filter(|row| (row.case.as_str(), row.backend.as_str()) == key).collect();
        let outcome = same.iter().find(|row| !row.outcome.is_good()).unwrap_or(&same[0]).outcome.to_string();
        let worst = |value: fn(&Row) -> Option<f64>| {
            let most = same.iter().filter_map(|row| value(row)).fold(f64::NEG_INFINITY, f64::max);
            if most.is_finite() { short(most) } else { String::new() }
        };
        let _ = writeln!(
            text,
            "| {} | {} | {outcome} | {} | {} | {} | {} |",
            row.case,
            row.backend,
            worst(|row| row.energy_ratio),
            worst(|row| row.recovery_s),
            worst(|row| row.error),
            worst(|row| Some(row.wall_s)),
        );
    }
    text += "\n## Refused at the door\n\n| given | outcome | error |\n|---|---|---|\n";
    for row in rows.iter().filter(|row| row.scale.is_none()) {
        let _ = writeln!(text, "| {} | {} | {} |", row.case, row.outcome, row.outcome.note());
    }
    text
}

fn short(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else if (1e-2..1e3).contains(&value) {
        format!("{value:.3}")
    } else {
        format!("{value:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::Outcome;

    #[test]
    fn a_line_is_the_worst_of_its_scales() {
        let row = |scale, ratio, outcome| {
            let mut row = Row::new("springs", "cpu f32", Some(scale));
            (row.energy_ratio, row.outcome) = (Some(ratio), outcome);
            row
        };
        let mut door = Row::new("a mass, NaN", "builder", None);
        door.outcome = Outcome::Refused("vertex 1: \"mass\"".into());
        let rows = [row(1e-3, 2.0, Outcome::Failed("grew".into())), row(1.0, 1.0, Outcome::Bounded), door];
        let text = markdown(&rows, &Options::default());
        assert!(text.contains("| springs | cpu f32 | FAILED | 2.000 |"), "{text}");
        assert_eq!(text.matches("springs").count(), 1, "{text}");
        assert!(text.contains("3 rows, 1 failed"), "{text}");
        let text = csv(&rows);
        assert!(
            text.contains("\"a mass, NaN\",\"builder\",,refused,,,,,0.000,\"vertex 1: \"\"mass\"\"\""),
            "{text}"
        );
        assert_eq!(text.lines().count(), 4);
    }
}
