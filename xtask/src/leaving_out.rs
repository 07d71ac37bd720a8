//! `cargo xtask leaving-out`: what a region or a graded lattice saves, and what it does to the wound, against the whole body; on the phantom
//! and on a real abdomen. Writes `docs/results/leaving-out.md` and the CSV that each of its figures stands in.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::workspace::Workspace;

/// Scenes of `fixtures/scenes` and the real volume that each is laid out for.
const SCENES: [(&str, Option<&str>); 2] =
    [("demo", None), ("abdomen-incision", Some("abdomen_ts_122x101x112.nii.gz"))];

/// What is left out: region and grading, as TOML.
const VARIANTS: [(Option<&str>, Option<&str>); 15] = [
    (None, None),
    (Some("{ around_mm = 20 }"), None),
    (Some("{ around_mm = 30 }"), None),
    (Some("{ around_mm = 40 }"), None),
    (Some("{ around_mm = 60 }"), None),
    (Some("{ around_mm = 80 }"), None),
    (Some("{ around_mm = 120 }"), None),
    (None, Some("{ around_mm = 20, growth = 1.5, coarsest = 4 }")),
    (None, Some("{ around_mm = 40, growth = 1.2, coarsest = 2 }")),
    (None, Some("{ around_mm = 40, growth = 1.5, coarsest = 4 }")),
    (None, Some("{ around_mm = 40, growth = 2, coarsest = 8 }")),
    (None, Some("{ around_mm = 80, growth = 1.5, coarsest = 4 }")),
    (Some("{ around_mm = 60 }"), Some("{ around_mm = 20, growth = 1.5, coarsest = 4 }")),
    (Some("{ around_mm = 80 }"), Some("{ around_mm = 40, growth = 1.5, coarsest = 4 }")),
    (Some("{ around_mm = 120 }"), Some("{ around_mm = 40, growth = 1.5, coarsest = 4 }")),
];

/// Frames of the second run of each, which is for the time only.
const TIMED_FRAMES: &str = "10";

const HEAD: &str = "scene,region,grading,vertices,tetrahedra,memory_mb,ms_per_frame_min,ms_per_frame_mean,growth_mm,growth_mid_mm,\
    error_percent,border_mm,largest_mm\n";

/// Runs the scenes, each variant from the program's own report, and writes page and CSV.
pub fn run(workspace: &Workspace) -> Result<()> {
    let data = workspace.test_data()?;
    let scratch = workspace.target_dir()?.join("leaving-out");
    let docs = workspace.root.join("docs/results");
    let (mut csv, mut sections, mut machine) = (HEAD.to_owned(), String::new(), Value::Null);
    for (scene, volume) in SCENES {
        let path = match (&data, volume) {
            (_, None) => None,
            (Some(data), Some(name)) => Some(format!("volume.path={}", data.join("ct").join(name).display())),
            (None, Some(name)) => {
                let _ = writeln!(sections, "`{scene}` was left out: {name} is not on this machine.\n");
                continue;
            }
        };
        let (mut rows, mut runs) = (Vec::new(), Vec::new());
        for (region, grading) in VARIANTS {
            let mut set = vec!["output={report=true}".to_owned(), "solver.backend=cpu".to_owned()];
            set.extend(path.clone());
            set.extend(region.map(|region| format!("lattice.region={region}")));
            set.extend(grading.map(|grading| format!("lattice.grading={grading}")));
            println!("{scene} {}", set[2..].join(" "));
            let report = simulate(workspace, scene, &set, None, &scratch)?;
            machine = report["machine"].clone();
            rows.push(Row::of(region, grading, &report)?);
            runs.push(set);
        }
        // Once more in the opposite order, for the time: what else the machine does then falls on others.
        for (set, row) in runs.iter().zip(&mut rows).rev() {
            let again = simulate(workspace, scene, set, Some(TIMED_FRAMES), &scratch)?;
            row.ms_min = row.ms_min.min(number(&again, "/frames/ms_min")?);
        }
        check(scene, &rows)?;
        sections.push_str(&table(scene, &rows));
        rows.iter().for_each(|row| csv.push_str(&row.csv(scene, &rows[0])));
    }
    fs::create_dir_all(&docs)?;
    let page = page(workspace, &sections, &machine)?;
    fs::write(docs.join("leaving-out.csv"), csv)?;
    fs::write(docs.join("leaving-out.md"), page)?;
    println!("written: {}", docs.join("leaving-out.md").display());
    Ok(())
}

fn simulate(
    workspace: &Workspace,
    scene: &str,
    set: &[String],
    frames: Option<&str>,
    out: &Path,
) -> Result<Value> {
    workspace.run_program(|command| {
        command.arg("run").arg(format!("fixtures/scenes/{scene}.toml")).arg("--out").arg(out);
        command.args(set.iter().flat_map(|change| ["--set", change]));
        command.args(frames.iter().flat_map(|frames| ["--frames", frames]));
    })?;
    Ok(serde_json::from_slice(&fs::read(out.join("report.json"))?)?)
}

fn number(report: &Value, path: &str) -> Result<f64> {
    report.pointer(path).and_then(Value::as_f64).with_context(|| format!("the report has no {path}"))
}

/// One run.
struct Row {
    region: String,
    grading: String,
    vertices: f64,
    tets: f64,
    memory_mb: f64,
    ms_min: f64,
    ms_mean: f64,
    growth: f64,
    growth_mid: f64,
    /// None where nothing is frozen.
    border: Option<f64>,
    largest: f64,
}

impl Row {
    fn of(region: Option<&str>, grading: Option<&str>, report: &Value) -> Result<Self> {
        let number = |path: &str| number(report, path);
        let bytes = report["memory"].as_array().context("the report has no memory")?;
        let text = |choice: Option<&str>| {
            choice.map_or("none", |text| text.trim_matches(['{', '}', ' '])).to_owned()
        };
        Ok(Self {
            region: text(region),
            grading: text(grading),
            vertices: number("/sizes/vertices")?,
            tets: number("/sizes/tets")?,
            memory_mb: bytes.iter().filter_map(|part| part["bytes"].as_f64()).sum::<f64>() / 1e6,
            ms_min: number("/frames/ms_min")?,
            ms_mean: number("/frames/ms_mean")?,
            growth: number("/wound/final_mm")? - number("/wound/initial_mm")?,
            growth_mid: number("/wound/mid_mm")? - number("/wound/initial_mid_mm")?,
            border: report["border_displacement_mm"].as_f64(),
            largest: number("/max_displacement_mm")?,
        })
    }

    /// How far the growth is from that of the whole body, percent.
    fn error(&self, whole: &Self) -> f64 {
        100.0 * (self.growth / whole.growth - 1.0)
    }

    fn csv(&self, scene: &str, whole: &Self) -> String {
        format!(
            "{scene},\"{}\",\"{}\",{},{},{:.3},{:.3},{:.3},{:.4},{:.4},{:.3},{},{:.4}\n",
            self.region,
            self.grading,
            self.vertices,
            self.tets,
            self.memory_mb,
            self.ms_min,
            self.ms_mean,
            self.growth,
            self.growth_mid,
            self.error(whole),
            self.border.map(|border| format!("{border:.4}")).unwrap_or_default(),
            self.largest
        )
    }
}

/// The figures must be able to speak against leaving out: the smallest region errs more than the largest.
fn check(scene: &str, rows: &[Row]) -> Result<()> {
    let error = |row: usize| rows[row].error(&rows[0]).abs();
    ensure!(error(1) > error(6), "{scene}: a larger region does not err less");
    ensure!(
        rows[1].tets < rows[6].tets && rows[6].tets < rows[0].tets,
        "{scene}: a region leaves nothing out"
    );
    Ok(())
}

fn table(scene: &str, rows: &[Row]) -> String {
    let mut out = format!(
        "## `{scene}`\n\n\
         | region | grading | tetrahedra | of the whole | MB | ms/frame | of the whole | growth, mm | error | at the border, mm |\n\
         |---|---|---|---|---|---|---|---|---|---|\n"
    );
    let whole = &rows[0];
    for row in rows {
        let _ = writeln!(
            out,
            "| {} | {} | {} | {:.0} % | {:.1} | {:.1} | {:.0} % | {:.2} | {:+.1} % | {} |",
            row.region,
            row.grading,
            row.tets,
            100.0 * row.tets / whole.tets,
            row.memory_mb,
            row.ms_min,
            100.0 * row.ms_min / whole.ms_min,
            row.growth,
            row.error(whole),
            row.border
                .map(|border| format!("{border:.2} of {:.2}", row.largest))
                .unwrap_or_else(|| "–".into()),
        );
    }
    let regions = rows[1..7].iter().filter(|row| row.error(whole).abs() <= 5.0);
    if let Some(least) = regions.min_by(|a, b| a.ms_min.total_cmp(&b.ms_min)) {
        let _ = writeln!(
            out,
            "\nThe fastest region whose growth is within 5 % of the whole body's is `{}`: {:.0} % of the tetrahedra, {:.0} % of the \
             time. Next to its border tissue moves by up to {:.0} % of the largest displacement.",
            least.region,
            100.0 * least.tets / whole.tets,
            100.0 * least.ms_min / whole.ms_min,
            100.0 * least.border.unwrap_or(0.0) / least.largest,
        );
    }
    out.push('\n');
    out
}

fn page(workspace: &Workspace, sections: &str, machine: &Value) -> Result<String> {
    let commit = workspace.commit()?;
    Ok(format!(
        "# What leaving out saves, and what it costs\n\n\
         Written by `cargo xtask leaving-out` at commit {} on {} ({} cores, {}); CPU backend. All figures: \
         [leaving-out.csv](leaving-out.csv).\n\n\
         *Region*: `[lattice] region`, what lies beyond is frozen. *Grading*: `[lattice] grading`, cells grow away from a fine zone. \
         *MB*: memory of the solver. *ms/frame*: the shortest frame of two runs, taken in opposite orders, since the machine may have done other work too. *Growth*: what skin tension \
         opens the wound by; *error*: its difference from the whole body's. *At the border*: how far tissue moves next to where the \
         region ends, and the largest displacement anywhere: skin tension acts all over the skin in these scenes, so that all of the body \
         moves.\n\n{sections}\
         The error of a region is one of its size only: the lattice in it is that of the whole body, and so is the cut. That of a \
         grading is also one of the coarser lattice beside the zone, which has another surface there.\n",
        commit,
        machine["cpu"].as_str().unwrap_or("an unknown processor"),
        machine["cores"],
        machine["system"].as_str().unwrap_or_default(),
    ))
}
