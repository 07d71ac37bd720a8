//! `cargo xtask parity-page`: the comparison of the backends, run three ways, and what it found: `docs/results/parity.md`.

use std::fmt::Write as _;
use std::fs;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::steps::parity_command;
use crate::workspace::{Workspace, execute};

/// The runs: what each is, and its options.
const RUNS: [(&str, &[&str]); 3] = [
    ("As the device is", &[]),
    (
        "In small chunks, within WebGPU's baseline limits",
        &["--quick", "--chunk-cap", "200", "--baseline-limits"],
    ),
    ("The largest lattice", &["--full-size"]),
];

/// Runs the comparisons and writes the page; an error if one of them fails.
pub fn run(workspace: &Workspace) -> Result<()> {
    let folder = workspace.target_dir()?.join("results");
    fs::create_dir_all(&folder)?;
    let mut text = String::from(
        "# Parity: the GPU backend against the CPU's `f32`\n\n\
         Written by `cargo xtask parity-page`. Every comparison has controls: the same with something wrong on purpose, which it\n\
         must reject; the column *controls* counts those rejected.\n",
    );
    for (number, (title, options)) in RUNS.into_iter().enumerate() {
        let path = folder.join(format!("parity-{number}.json"));
        let load = load();
        let mut command = parity_command(workspace, options);
        if options.contains(&"--full-size") {
            // Long dispatches: the driver's threads are worth their cost.
            command.env_remove("LP_NUM_THREADS");
        }
        execute(command.arg("--json").arg(&path))?;
        let found: Value =
            serde_json::from_slice(&fs::read(&path)?).context("the comparison wrote no JSON")?;
        ensure!(found["passed"] == true, "`parity {}` found a difference", options.join(" "));
        text += &section(title, options, load.as_deref(), &found);
    }
    let path = workspace.root.join("docs/results/parity.md");
    fs::write(&path, text)?;
    println!("written: {}", path.display());
    Ok(())
}

/// One run: with what it was made, how many rows ended how, and the rows.
fn section(title: &str, options: &[&str], load: Option<&str>, found: &Value) -> String {
    let text = |value: &Value| value.as_str().unwrap_or("unknown").replace('|', "\\|");
    let rows = found["rows"].as_array().map(Vec::as_slice).unwrap_or_default();
    let count = |outcome: &str| rows.iter().filter(|row| row["outcome"] == outcome).count();
    let command = [&["cargo xtask parity"], options].concat().join(" ");
    let mut page = format!(
        "\n## {title}\n\n`{command}` at commit {}, on {}, {} cores, {}; load of the machine at the start: {}.\n\n",
        text(&found["commit"]),
        text(&found["machine"]["cpu"]),
        found["machine"]["cores"],
        text(&found["machine"]["system"]),
        load.unwrap_or("unknown"),
    );
    for adapter in found["adapters"].as_array().into_iter().flatten() {
        let [name, kind, api, driver, policy] =
            ["name", "kind", "api", "driver", "policy"].map(|key| text(&adapter[key]));
        let _ = writeln!(page, "- {name} ({kind}, {api}, {driver}): {policy}");
    }
    let _ = writeln!(
        page,
        "\n{} rows exact, {} within tolerance, {} controls rejected, of {}.\n\n\
         | ring | comparison | outcome | compared | largest difference | controls |\n|---|---|---|---|---|---|",
        count("exact"),
        count("within"),
        count("rejected"),
        rows.len(),
    );
    for row in rows.iter().filter(|row| row["control"].is_null()) {
        let of_this = |other: &&Value| {
            ["ring", "name", "adapter"].iter().all(|key| other[key] == row[key])
                && other["outcome"] == "rejected"
        };
        let figures = &row["figures"];
        let _ = writeln!(
            page,
            "| {} | {} | {} | {} | {} of {} | {} |",
            text(&row["ring"]),
            text(&row["name"]),
            text(&row["outcome"]),
            figures["compared"],
            number(&figures["worst"]),
            text(&figures["of"]),
            rows.iter().filter(of_this).count(),
        );
    }
    for row in rows {
        let Some(details) = row["details"].as_object() else { continue };
        page.push_str("\nTimes are wall time, and the device's say nothing of hardware if it is software.\n\n| | |\n|---|---|\n");
        for (key, value) in details {
            let _ = writeln!(page, "| {key} | {} |", number(value));
        }
    }
    page
}

fn number(value: &Value) -> String {
    match value.as_f64() {
        None => "none".into(),
        Some(x) if x.fract() == 0.0 => format!("{x:.0}"),
        Some(x) if x.abs() < 1e-3 => format!("{x:.1e}"),
        Some(x) => format!("{x:.2}"),
    }
}

/// Average number of processes at work in the last minute, where the system says so.
fn load() -> Option<String> {
    fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next().map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_section_counts_the_rows_and_lists_the_comparisons() {
        let figures = json!({"compared": 7, "worst": 2e-7, "of": "extent"});
        let row = |control, outcome| {
            json!({"ring": "op", "name": "springs", "adapter": "card", "control": control, "outcome": outcome,
                   "figures": figures, "details": {"device: first step, s": 1.25}})
        };
        let found = json!({
            "commit": "0123abc",
            "machine": {"cpu": "chip", "cores": 2, "system": "linux"},
            "adapters": [{"name": "card", "kind": "software", "api": "vulkan", "driver": "d 1", "policy": "equal"}],
            "rows": [row(Value::Null, "within"), row(json!("wrong"), "rejected"), row(json!("worse"), "rejected")],
        });
        let text = section("Title", &["--quick"], Some("1.50"), &found);
        for part in [
            "`cargo xtask parity --quick` at commit 0123abc, on chip, 2 cores, linux",
            "at the start: 1.50.",
            "- card (software, vulkan, d 1): equal",
            "0 rows exact, 1 within tolerance, 2 controls rejected, of 3.",
            "| op | springs | within | 7 | 2.0e-7 of extent | 2 |\n",
            "| device: first step, s | 1.25 |",
        ] {
            assert!(text.contains(part), "no {part:?} in: {text}");
        }
        assert_eq!(text.matches("springs").count(), 1, "controls are counted, not listed: {text}");
    }
}
