//! The tables of a page.

use std::fmt::Write as _;

use super::text::escape;
use crate::CostReport;
use crate::output::report::{MaterialRow, Report};
use crate::output::rest_report::StopReport;
use crate::output::step_report::StepReport;

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

/// All tables of a report.
pub(super) fn tables(report: &Report) -> String {
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
            "<h2>Resampled CT</h2><p>{} voxels of the body moved, {} left as air, {} folds.</p>",
            r.moved_voxels, r.vacated_voxels, r.folds
        );
    }
    // A wide table scrolls by itself. No text of a user holds these tags.
    out.replace("<table>", "<div class=\"scroll\"><table>").replace("</table>", "</table></div>")
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
