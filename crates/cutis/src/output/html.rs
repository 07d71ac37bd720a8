//! `report.html`: the report for people, one file with pictures and plots inside.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use base64::Engine;

use cutis_render::plot::{Axis, Mark, Scale, Series, line_chart};

use super::report::{MaterialRow, Report, Wound};
use super::rest_report::{RestReport, StopReport};
use super::step_report::StepReport;
use crate::run::files::{self, RunFolder};
use crate::run::frames::FrameRow;
use crate::{CostReport, Error};

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem;color:#222}\
h1{font-size:1.6rem}h2{font-size:1.15rem;margin-top:2rem}table{border-collapse:collapse}\
td,th{padding:.2rem .8rem .2rem 0;text-align:left;vertical-align:top;border-bottom:1px solid #ddd}\
td.n{text-align:right;font-variant-numeric:tabular-nums}figure{margin:1rem 0}.pair{display:grid;grid-template-columns:1fr 1fr;gap:0 1rem}.pair .wide{grid-column:1/-1}\
img{max-width:100%;height:auto}figcaption{color:#555}.warn{background:#fff4d6;padding:.5rem 1rem}pre{background:#f5f5f5;padding:1rem;overflow:auto}";

/// A picture of the page.
pub(crate) struct Figure {
    /// Its file in the run folder.
    pub(crate) path: fn(&RunFolder) -> PathBuf,
    pub(crate) caption: &'static str,
    /// Whether it takes the whole width of the page instead of half.
    pub(crate) wide: bool,
    /// The picture as a PNG file.
    pub(crate) png: Vec<u8>,
}

/// Writes `report.html`.
///
/// # Errors
/// [`Error::File`] if it cannot be written.
pub(crate) fn write(
    report: &Report,
    rows: &[FrameRow],
    figures: &[Figure],
    folder: &RunFolder,
) -> Result<(), Error> {
    let over_time = [opening_plot(rows), force_plot(rows), handle_plot(rows)];
    let search = report.rest.as_ref().and_then(rest_plot);
    let plots: Vec<String> = over_time.into_iter().chain([search]).flatten().collect();
    let scene = toml::to_string_pretty(&report.scene).unwrap_or_else(|e| e.to_string());
    files::write(&folder.html(), page(report, figures, &plots, &scene).as_bytes())
}

/// A plot of the openings over time; none without a wound or without frames.
fn opening_plot(rows: &[FrameRow]) -> Option<String> {
    let wounds = rows.first().map_or(0, |row| row.gapes.len());
    if wounds == 0 || rows.len() < 2 {
        return None;
    }
    let curves: Vec<(String, Vec<[f64; 2]>)> = (0..wounds)
        .flat_map(|n| {
            let name = |what: &str| if wounds == 1 { what.into() } else { format!("wound {} {what}", n + 1) };
            let mean = rows.iter().map(|row| [row.time_s, row.gapes[n].mean_mm]).collect();
            let middle = rows.iter().map(|row| [row.time_s, row.gapes[n].mid_mm]).collect();
            [(name("mean"), mean), (name("in the middle"), middle)]
        })
        .collect();
    Some(line_plot("Opening of the wound", "distance of the lips / mm", &curves))
}

/// A plot of the forces of the sutures over time; none without sutures or without frames.
fn force_plot(rows: &[FrameRow]) -> Option<String> {
    let sutures = rows.first().map_or(0, |row| row.sutures.len());
    if sutures == 0 || rows.len() < 2 {
        return None;
    }
    let curve = |n: usize| {
        let points = rows.iter().map(|row| [row.time_s, row.sutures[n][0]]).collect();
        (format!("suture {}", n + 1), points)
    };
    let curves: Vec<(String, Vec<[f64; 2]>)> = (0..sutures).map(curve).collect();
    Some(line_plot("Force of the sutures", "sum over the threads / N", &curves))
}

/// A plot of the forces of the handles over time; none without handles or without frames.
fn handle_plot(rows: &[FrameRow]) -> Option<String> {
    let handles = rows.first().map_or(0, |row| row.handles.len());
    if handles == 0 || rows.len() < 2 {
        return None;
    }
    let curve = |n: usize| {
        let points = rows.iter().map(|row| [row.time_s, row.handles[n]]).collect();
        (format!("handle {}", n + 1), points)
    };
    let curves: Vec<(String, Vec<[f64; 2]>)> = (0..handles).map(curve).collect();
    Some(line_plot("Force of the handles", "force / N", &curves))
}

/// A plot of the search for the state of rest; none if it made no step.
fn rest_plot(rest: &RestReport) -> Option<String> {
    let mut cycles = 0.0;
    let (mut forces, mut errors) = (Vec::new(), Vec::new());
    for step in &rest.steps {
        forces.push([cycles, step.force]);
        cycles += step.cycles as f64;
        errors.extend(step.error.map(|error| [cycles, error]));
    }
    forces.push([cycles, rest.force]);
    let curves = [("forces left, of all forces", forces), ("estimated distance from rest", errors)];
    let series: Vec<Series<'_>> =
        curves.iter().map(|(name, points)| Series { name, points, mark: Mark::Dots }).collect();
    let [x, y] = [("multigrid cycles", Scale::Linear), ("share", Scale::Log)];
    let axis = |(label, scale)| Axis { label, scale };
    (!rest.steps.is_empty()).then(|| line_chart("Search for the state of rest", axis(x), axis(y), &series))
}

/// A plot of curves over time.
fn line_plot(title: &str, values: &'static str, curves: &[(String, Vec<[f64; 2]>)]) -> String {
    let series: Vec<Series<'_>> =
        curves.iter().map(|(name, points)| Series { name, points, mark: Mark::Line }).collect();
    let axis = |label| Axis { label, scale: Scale::Linear };
    line_chart(title, axis("time / s"), axis(values), &series)
}

/// The page as HTML.
fn page(report: &Report, figures: &[Figure], plots: &[String], scene_toml: &str) -> String {
    let mut out = String::new();
    let mut put = |text: &str| out.push_str(text);
    put("<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">");
    put("<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">");
    put(&format!("<title>{}</title><style>", escape(&title(report))));
    put(STYLE);
    put("</style></head><body><h1>Cutis run</h1>");
    put(&summary(report));
    if !report.warnings.is_empty() {
        put(&format!("<div class=\"warn\"><b>Note</b><ul>{}</ul></div>", items(&report.warnings)));
    }
    put("<div class=\"pair\">");
    for figure in figures {
        let data = base64::engine::general_purpose::STANDARD.encode(&figure.png);
        let (class, caption) = (if figure.wide { "wide" } else { "half" }, escape(figure.caption));
        put(&format!(
            "<figure class=\"{class}\"><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\">\
             <figcaption>{caption}</figcaption></figure>"
        ));
    }
    put("</div>");
    for plot in plots {
        put(&format!("<figure>{plot}</figure>"));
    }
    put(&tables(report));
    if !report.left_out.is_empty() {
        put(&format!("<h2>Left out by the scene</h2><ul>{}</ul>", items(&report.left_out)));
    }
    put(&format!("<h2>Scene as it ran</h2><pre>{}</pre></body></html>\n", escape(scene_toml)));
    out
}

/// The name of the scene, so that the pages of several runs differ.
fn title(report: &Report) -> String {
    let scene = report.inputs.first().and_then(|input| Path::new(&input.path).file_stem());
    scene.map_or_else(|| "Cutis run".into(), |name| format!("{} - Cutis run", name.to_string_lossy()))
}

fn summary(report: &Report) -> String {
    let s = &report.sizes;
    let backend = &report.backend;
    let machine = match (&backend.adapter, &backend.adapter_kind, &backend.driver) {
        (Some(adapter), Some(kind), Some(driver)) => format!("{adapter}, {kind}; {driver}"),
        _ => format!("{}, {} threads", report.machine.cpu, backend.threads),
    };
    let mut text = format!(
        "<p>{} vertices, {} edges, {} tetrahedra and {} skin triangles; {} frames on <b>{}</b> ({}; {})",
        s.vertices,
        s.edges,
        s.tets,
        s.skin_triangles,
        report.frames.count,
        escape(&backend.name),
        escape(&backend.reason),
        escape(&machine),
    );
    if report.frames.count > 0 {
        let _ = write!(text, ", {:.1} ms per frame", report.frames.ms_mean);
    }
    text.push_str(".</p>");
    if let Some(rest) = &report.rest {
        let _ = write!(text, "<p>{}.</p>", escape(&capitalized(&rest.summary())));
    }
    for line in report.tension_summary() {
        let _ = write!(text, "<p>{}.</p>", escape(&capitalized(&line)));
    }
    for Wound { initial_mm, final_mm, mid_mm, .. } in &report.wounds {
        let _ = write!(
            text,
            "<p>The wound opened from <b>{initial_mm:.2} mm</b> to <b>{final_mm:.2} mm</b> (mean distance of the lips; {mid_mm:.2} mm in the middle).</p>"
        );
    }
    for suture in &report.sutures {
        let _ = write!(text, "<p>{}.</p>", escape(&capitalized(&suture.summary())));
    }
    for handle in &report.handles {
        let _ = write!(text, "<p>{}.</p>", escape(&capitalized(&handle.summary())));
    }
    text
}

/// A table of states of rest; empty if there are less than two.
fn states_of_rest(stops: &[StopReport]) -> String {
    let [first, _, ..] = stops else { return String::new() };
    let mut out =
        String::from("<h2>States of rest, one after the other</h2><table><tr><th>time</th><th>after</th>");
    let names = |out: &mut String, what: &str, unit: &str, count: usize| {
        for n in 0..count {
            let number = if count > 1 { format!(" {n}") } else { String::new() };
            let _ = write!(out, "<th>{what}{number}, {unit}</th>");
        }
    };
    names(&mut out, "opening", "mm", first.mid_mm.len());
    names(&mut out, "suture", "N", first.sutures_n.len());
    names(&mut out, "handle", "N", first.handles_n.len());
    out.push_str("<th>error</th><th>cycles</th></tr>");
    for stop in stops {
        let _ = write!(out, "<tr><td>{:.3} s</td><td>{}</td>", stop.time_s, escape(&stop.done.join(", ")));
        for value in [&stop.mid_mm, &stop.sutures_n, &stop.handles_n].into_iter().flatten() {
            let _ = write!(out, "<td class=\"n\">{value:.2}</td>");
        }
        let _ = write!(
            out,
            "<td class=\"n\">{:.2} %</td><td class=\"n\">{}</td></tr>",
            100.0 * stop.error,
            stop.cycles
        );
    }
    out.push_str("</table>");
    out
}

fn tables(report: &Report) -> String {
    let mut out = timeline(&report.steps);
    out.push_str(&states_of_rest(&report.stops));
    out.push_str("<h2>Time and memory per stage</h2><table>");
    for stage in &report.stages {
        let _ = write!(
            out,
            "<tr><td>{}</td><td class=\"n\">{:.1} ms</td><td>{}</td><td class=\"n\">{}</td></tr>",
            escape(&stage.name),
            stage.ms,
            escape(&stage.on),
            stage.peak_bytes.map(|bytes| format!("peak {:.0} MB", 1e-6 * bytes as f64)).unwrap_or_default()
        );
    }
    out.push_str("</table>");
    out.push_str(&material_table(&report.materials));
    out.push_str(&report.model_table().map_or_else(|| constraints(report), facts));
    out.push_str(&cost_table(&report.costs));
    if let Some(r) = &report.resample {
        let _ = write!(
            out,
            "<h2>Resampled CT</h2><p>{} voxels inside the deformed body, {} left as air, {} folds.</p>",
            r.covered_voxels, r.vacated_voxels, r.folds
        );
    }
    out
}

/// What was done to the body, in the order of time.
fn timeline(steps: &[StepReport]) -> String {
    if steps.is_empty() {
        return String::new();
    }
    let row = |step: &StepReport| {
        let StepReport { section, at_s, until_s, what } = step;
        let until = if until_s > at_s { format!(" to {until_s:.3}") } else { String::new() };
        let (section, what) = (escape(section), escape(what));
        format!("<tr><td class=\"n\">{at_s}{until} s</td><td>{section}</td><td>{what}</td></tr>")
    };
    format!("<h2>What was done</h2><table>{}</table>", steps.iter().map(row).collect::<String>())
}

/// The table of materials, with the source of each row.
fn material_table(materials: &[MaterialRow]) -> String {
    if materials.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "<h2>Materials</h2><table><tr><th>tissue</th><th>HU</th><th>depth, mm</th><th>Young's modulus, kPa</th>\
         <th>bulk modulus, kPa</th><th>vertices</th><th>tetrahedra</th><th>source</th></tr>",
    );
    let range = |range: Option<[f64; 2]>| {
        range.map_or_else(|| "any".to_owned(), |[low, high]| format!("{low} to {high}"))
    };
    for row in materials {
        let _ = write!(
            out,
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
            escape(&row.name),
            range(row.hu),
            range(row.depth_mm),
            row.youngs_modulus_pa / 1e3,
            row.bulk_modulus_pa / 1e3,
            row.vertices,
            row.tets,
            escape(row.source.as_deref().unwrap_or_default()),
        );
    }
    out.push_str("</table>");
    out
}

fn constraints(report: &Report) -> String {
    if report.residuals.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "<h2>Constraints</h2><table><tr><th>kind</th><th>colors</th><th>RMS error / rest size</th><th>largest</th></tr>",
    );
    for r in &report.residuals {
        let colors = report.colors.get(&r.kind).map(usize::to_string).unwrap_or_default();
        let _ = write!(
            out,
            "<tr><td>{}</td><td class=\"n\">{colors}</td><td class=\"n\">{:.3e}</td><td class=\"n\">{:.3e}</td></tr>",
            escape(&r.kind),
            r.rms,
            r.max
        );
    }
    out.push_str("</table>");
    out
}

/// A table of names and values.
fn facts((title, rows): (&str, Vec<(&str, String)>)) -> String {
    let row =
        |(what, value): &(&str, String)| format!("<tr><td>{what}</td><td class=\"n\">{value}</td></tr>");
    format!("<h2>{title}</h2><table>{}</table>", rows.iter().map(row).collect::<String>())
}

/// The cost report as a table.
fn cost_table(costs: &CostReport) -> String {
    let mut out = String::from(
        "<h2>What the solver costs</h2><table><tr><th>part</th><th>memory</th><th>on the GPU</th><th>per frame</th></tr>",
    );
    let megabytes =
        |bytes: usize| if bytes == 0 { String::new() } else { format!("{:.1} MB", bytes as f64 / 1e6) };
    for part in &costs.parts {
        let time = part.ms_per_frame.map(|ms| format!("{ms:.2} ms")).unwrap_or_default();
        let _ = write!(
            out,
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{time}</td></tr>",
            escape(&part.part),
            megabytes(part.host_bytes),
            megabytes(part.device_bytes),
        );
    }
    let _ = write!(out, "</table><p>Time: {}.</p>", escape(&costs.time));
    out
}

/// The text with a capital first letter.
fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn items(lines: &[String]) -> String {
    lines.iter().map(|line| format!("<li>{}</li>", escape(line))).collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
