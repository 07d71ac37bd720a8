//! `plots.html`: the results of a sweep as plots and as a table, in one file that loads nothing.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use cutis_render::plot::{Axis as PlotAxis, Mark, Scale, Series, line_chart};
use sha2::{Digest, Sha256};

use super::cases::Case;
use super::folder::CaseState;
use super::study::{Axis, Study};
use super::table::Table;
use crate::output::html::text::escape;

const STYLE: &str = include_str!("../output/html/assets/page.css");

/// Most series in a plot.
const MOST_SERIES: usize = 24;

/// Columns that are plotted, by their endings, with the titles of the plots.
const PLOTTED: [(&str, &str); 8] = [
    ("_final_mm", "Opening of the wound at the end"),
    ("suture", "Force of the sutures"),
    ("handle", "Force of the handles"),
    ("max_displacement_mm", "Largest displacement"),
    ("rest_error", "Stated error of the state of rest"),
    ("residual_rms", "Largest residual of a constraint kind"),
    ("seconds", "Wall time of the case"),
    ("peak_mb", "Peak of the memory"),
];

/// The page.
pub(super) fn page(study: &Study, table: &Table) -> String {
    let name = study.file.file_stem().unwrap_or_default().to_string_lossy();
    let hash = STANDARD.encode(Sha256::digest(STYLE));
    let done = table.states.iter().filter(|state| state.is_done()).count();
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'sha256-{hash}'; \
         base-uri 'none'; form-action 'none'\">\n\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
         <title>{name} - Cutis sweep</title>\n<style>{STYLE}</style></head>\n<body><main><h1>Cutis sweep</h1>\
         <p>{file}: {done} of {all} cases are done.</p>",
        name = escape(&name),
        file = escape(&study.file.display().to_string()),
        all = table.rows.len(),
    );
    for (axis, at) in study.axes.iter().zip(0..).filter(|(axis, _)| axis.values.len() > 1) {
        let _ = write!(out, "<h2>Over {}</h2>", escape(&axis.key));
        plotted(table)
            .for_each(|(column, title)| out.push_str(&over_axis(study, table, (axis, at), column, title)));
    }
    out.push_str("<h2>All cases</h2>");
    plotted(table).for_each(|(column, title)| out.push_str(&over_cases(table, column, title)));
    out.push_str(&rows(study, table));
    out + "</main></body></html>\n"
}

/// The columns with plots, and their titles.
fn plotted(table: &Table) -> impl Iterator<Item = (&str, &'static str)> {
    let title = |column: &str| {
        let found = PLOTTED.iter().find(|(part, _)| column.ends_with(part) || column.starts_with(part));
        found.map(|(_, title)| *title)
    };
    let results = table.columns.iter().skip(table.settings);
    results.filter_map(move |column| Some((column.as_str(), title(column)?)))
}

/// A result over the values of an axis, with one series for each combination of the other settings.
fn over_axis(study: &Study, table: &Table, axis: (&Axis, usize), column: &str, title: &str) -> String {
    let (axis, at) = axis;
    let values: Vec<Option<f64>> = axis.values.iter().map(|value| value.parse().ok()).collect();
    let is_number = values.iter().all(Option::is_some);
    let place = |level: usize| values[level].filter(|_| is_number).unwrap_or(level as f64 + 1.0);
    let mut series: BTreeMap<Others<'_>, Vec<[f64; 2]>> = BTreeMap::new();
    for (case, value) in study.cases.iter().zip(table.numbers(column)) {
        let (Some(levels), Some(value)) = (&case.levels, value) else { continue };
        series.entry(Others::of(case, levels, at)).or_default().push([place(levels[at]), value]);
    }
    let label = match is_number {
        true => axis.key.clone(),
        false => {
            let values = axis.values.iter().enumerate().map(|(n, value)| format!("{}: {value}", n + 1));
            format!("{} ({})", axis.key, values.collect::<Vec<_>>().join(", "))
        }
    };
    series.values_mut().for_each(|points| points.sort_by(|a, b| a[0].total_cmp(&b[0])));
    let names: Vec<String> = series.keys().map(|others| others.name(study)).collect();
    let drawn = series.values().zip(&names).take(MOST_SERIES);
    let drawn: Vec<Series<'_>> =
        drawn.map(|(points, name)| Series { name, points, mark: Mark::Dots }).collect();
    let left_out = names.len() - drawn.len();
    let note = (left_out > 0).then(|| format!("{left_out} more series are in table.csv."));
    figure(title, &label, column, &drawn, note)
}

/// What the cases of a series have in common: all but the value on the axis of the plot.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Others<'a> {
    scene: &'a Path,
    scan: Option<&'a str>,
    /// Number of an axis, and number of the value on it.
    levels: Vec<(usize, usize)>,
}

impl<'a> Others<'a> {
    fn of(case: &'a Case, levels: &[usize], at: usize) -> Self {
        let levels = levels.iter().copied().enumerate().filter(|&(axis, _)| axis != at).collect();
        Self { scene: &case.scene, scan: case.scan.as_deref(), levels }
    }

    fn name(&self, study: &Study) -> String {
        let several = study.cases.iter().any(|case| case.scene != self.scene);
        let stem = self.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let level = |&(axis, level): &(usize, usize)| {
            let Axis { key, values } = &study.axes[axis];
            format!("{} = {}", key.rsplit('.').next().unwrap_or_default(), values[level])
        };
        let scene = several.then_some(stem);
        let parts =
            scene.into_iter().chain(self.scan.map(str::to_owned)).chain(self.levels.iter().map(level));
        let name = parts.collect::<Vec<_>>().join(", ");
        if name.is_empty() { "all cases".into() } else { name }
    }
}

/// A result of every case by its number.
fn over_cases(table: &Table, column: &str, title: &str) -> String {
    let numbers = table.numbers(column).into_iter().zip(1..);
    let points: Vec<[f64; 2]> = numbers.filter_map(|(value, n)| Some([f64::from(n), value?])).collect();
    let series = [Series { name: column, points: &points, mark: Mark::Rings }];
    figure(title, "number of the case in the table", column, &series, None)
}

/// A plot; nothing without points.
fn figure(title: &str, x: &str, y: &str, series: &[Series<'_>], note: Option<String>) -> String {
    if series.iter().all(|series| series.points.is_empty()) {
        return String::new();
    }
    let axis = |label| PlotAxis { label, scale: Scale::Linear };
    let chart = line_chart(title, axis(x), axis(y), series);
    let note = note.map(|note| format!("<figcaption>{}</figcaption>", escape(&note))).unwrap_or_default();
    format!("<figure class=\"plot\">{chart}{note}</figure>")
}

/// The table, with a link to the report of each case that is done.
fn rows(study: &Study, table: &Table) -> String {
    let mut out = String::from("<h2>Table</h2><div class=\"scroll\"><table><tr><th>number</th>");
    table.columns.iter().for_each(|column| {
        let _ = write!(out, "<th>{}</th>", escape(column));
    });
    out.push_str("</tr>");
    let cases = study.cases.iter().zip(&table.states).zip(&table.rows);
    for (number, ((case, state), row)) in cases.enumerate() {
        let _ = write!(out, "<tr><td class=\"n\">{}</td>", number + 1);
        for (n, cell) in row.iter().enumerate() {
            let shown = escape(&shortened(cell, n >= table.settings));
            let _ = match (n, state) {
                (0, CaseState::Done(_)) => {
                    let name = escape(&case.name);
                    write!(out, "<td><a href=\"cases/{name}/report.html\">{shown}</a></td>")
                }
                _ => write!(out, "<td>{shown}</td>"),
            };
        }
        out.push_str("</tr>");
    }
    out + "</table></div>"
}

/// A result with four digits after the point.
fn shortened(cell: &str, is_result: bool) -> String {
    match cell.parse::<f64>() {
        Ok(value) if is_result && value.fract() != 0.0 && value.abs() >= 1e-3 => format!("{value:.4}"),
        Ok(value) if is_result && value.fract() != 0.0 => format!("{value:.3e}"),
        _ => cell.to_owned(),
    }
}
