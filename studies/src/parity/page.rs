//! The page of the study: the comparison runs three times with different limits, each in a process
//! of its own.

use std::fs;

use anyhow::{Context, ensure};
use serde_json::Value;

use crate::kit::{Failure, Page, Table, command, execute, number, optional, results, target_dir};

/// The runs: name of the tables, and options.
const RUNS: [(&str, &[&str]); 3] = [
    ("default", &[]),
    ("small-chunks", &["--quick", "--chunk-cap", "200", "--baseline-limits"]),
    ("full-size", &["--full-size"]),
];

/// Tables of the page.
pub const TABLES: [&str; 6] = [
    "default",
    "default-provenance",
    "small-chunks",
    "small-chunks-provenance",
    "full-size",
    "full-size-provenance",
];

/// Runs the comparisons and writes their tables.
///
/// # Errors
/// A comparison fails, or a file cannot be written.
pub fn write() -> Result<(), Failure> {
    let mut page = Page::open("parity", &TABLES)?;
    let folder = target_dir()?.join("studies");
    fs::create_dir_all(&folder)?;
    for (name, options) in RUNS {
        let path = folder.join(format!("parity-{name}.json"));
        let mut command = command(std::env::current_exe()?);
        command.arg("parity").args(options).arg("--json").arg(&path);
        if options.contains(&"--full-size") {
            // With long dispatches the threads of the software driver are faster than the calling
            // thread.
            command.env_remove("LP_NUM_THREADS");
        }
        execute(&mut command)?;
        let found: Value =
            serde_json::from_slice(&fs::read(&path)?).with_context(|| path.display().to_string())?;
        ensure!(found["passed"] == true, "`parity {}` found a difference", options.join(" "));
        page.set(name, &tables(&found))?;
        page.set(&format!("{name}-provenance"), &provenance(options, &found))?;
    }
    page.save(&results())?;
    Ok(())
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or("unknown")
}

/// Command, commit, machine and adapters of a run.
fn provenance(options: &[&str], found: &Value) -> String {
    let machine = &found["machine"];
    let command = [&["cargo xtask study parity"], options].concat().join(" ");
    let mut line = format!(
        "Measured by `{command}` at commit {}, on {}, {} threads, {}. Load of the machine: {} at \
         the end.",
        text(&found["commit"]),
        text(&machine["cpu"]),
        machine["cores"],
        text(&machine["system"]),
        text(&found["load"]),
    );
    for adapter in found["adapters"].as_array().into_iter().flatten() {
        let [name, kind, api, driver, policy] =
            ["name", "kind", "api", "driver", "policy"].map(|key| text(&adapter[key]));
        line += &format!(" Adapter: {name} ({kind}, {api}, {driver}); requirement: {policy}.");
    }
    line
}

/// A table of rings, a table of the comparisons that are not exact, and the details of the
/// full-size run.
fn tables(found: &Value) -> String {
    let rows = found["rows"].as_array().map(Vec::as_slice).unwrap_or_default();
    let mut rings =
        Table::new(["ring", "comparisons", "exact", "within tolerance", "numbers", "controls rejected"]);
    for ring in ["op", "kernel", "scene", "invariant", "oracle", "full-size"] {
        let of_ring = || rows.iter().filter(move |row| row["ring"] == ring);
        let count = |outcome: &str| of_ring().filter(|row| row["outcome"] == outcome).count();
        let comparisons = of_ring().filter(|row| row["control"].is_null());
        let numbers: u64 = comparisons.clone().filter_map(|row| row["figures"]["compared"].as_u64()).sum();
        let counts = [comparisons.count(), count("exact"), count("within")].map(|n| n.to_string());
        if of_ring().next().is_some() {
            let ends = [numbers.to_string(), count("rejected").to_string()];
            rings.add([ring.to_owned()].into_iter().chain(counts).chain(ends));
        }
    }
    let mut text_of_tables = rings.markdown();
    let mut within = Table::new(["comparison", "largest difference", "allowed"]);
    let is_within = |row: &&Value| row["outcome"] == "within";
    for row in rows.iter().filter(is_within) {
        let figures = &row["figures"];
        let figure = |key: &str| optional(figures[key].as_f64(), number);
        let worst = format!("{} of {}", figure("worst"), text(&figures["of"]));
        within.add([text(&row["name"]), &worst, &figure("tolerance")]);
    }
    if rows.iter().any(|row| is_within(&row)) {
        text_of_tables += &format!("\n{}", within.markdown());
    }
    for details in rows.iter().filter_map(|row| row["details"].as_object()) {
        let mut table = Table::new(["figure", "value"]);
        for (key, value) in details {
            // Counts are exact.
            let figure = |value: f64| if value.fract() == 0.0 { value.to_string() } else { number(value) };
            table.add([key, &optional(value.as_f64(), figure)]);
        }
        text_of_tables += &format!("\n{}", table.markdown());
    }
    text_of_tables
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn comparisons_are_summed_by_ring_and_controls_are_counted() {
        let figures = json!({"compared": 7, "worst": 2e-7, "of": "extent", "tolerance": 1e-6});
        let row = |control, outcome| {
            json!({"ring": "op", "name": "springs", "adapter": "card", "control": control, "outcome": outcome,
                   "figures": figures, "details": {"device: first step, s": 1.25, "vertices": 4_809_249.0}})
        };
        let found = json!({
            "commit": "0123abc", "load": "1.50",
            "machine": {"cpu": "chip", "cores": 2, "system": "linux"},
            "adapters": [{"name": "card", "kind": "software", "api": "vulkan", "driver": "d 1", "policy": "equal"}],
            "rows": [row(Value::Null, "within"), row(json!("wrong"), "rejected"), row(json!("worse"), "rejected")],
        });
        let tables = tables(&found);
        assert!(tables.contains("| op | 1 | 0 | 1 | 7 | 2 |"), "{tables}");
        assert!(tables.contains("| springs | 2.0e-7 of extent | 1.0e-6 |"), "{tables}");
        assert!(tables.contains("| device: first step, s | 1.25 |\n| vertices | 4809249 |"), "{tables}");
        let provenance = provenance(&["--quick"], &found);
        for part in
            ["parity --quick` at commit 0123abc, on chip, 2 threads, linux", "card (software, vulkan, d 1)"]
        {
            assert!(provenance.contains(part), "no {part:?} in: {provenance}");
        }
    }
}
