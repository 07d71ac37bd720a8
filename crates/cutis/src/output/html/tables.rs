//! The tables of a page.

use super::table::{Cell, Table};
use super::text::escape;
use crate::CostReport;
use crate::output::report::{MaterialRow, Report, Stage, fixed};
use crate::output::rest_report::{StopReport, percent};
use crate::output::step_report::StepReport;

/// What was done, and the states that followed.
pub(super) fn history(report: &Report) -> String {
    timeline(&report.steps) + &states_of_rest(&report.stops)
}

/// The tables about the computation.
pub(super) fn computation(report: &Report) -> String {
    let mut out = stages(&report.stages);
    out.push_str(&report.model_table().map_or_else(|| constraints(report), facts));
    out.push_str(&costs(&report.costs));
    if let Some(r) = &report.resample {
        out.push_str(&format!(
            "<h3>Resampled CT</h3><p>{} voxels of the body moved, {} left as air, {} folds.</p>",
            r.moved_voxels, r.vacated_voxels, r.folds
        ));
    }
    out
}

/// What was done to the body, in the order of time.
fn timeline(steps: &[StepReport]) -> String {
    let mut table = Table::new(["time, s", "section", "what"]);
    for StepReport { section, at_s, until_s, what } in steps {
        let until = if until_s > at_s { format!(" to {until_s:.3}") } else { String::new() };
        table.add([Cell::number(format!("{at_s}{until}")), Cell::text(section), Cell::text(what)]);
    }
    table.html("<h2>What was done</h2>")
}

/// The states of rest, if there are at least two.
fn states_of_rest(stops: &[StopReport]) -> String {
    let [first, _, ..] = stops else { return String::new() };
    let mut titles = vec!["time, s".to_owned(), "after".into()];
    let mut names = |what: &str, unit: &str, count: usize| {
        for n in 0..count {
            let number = if count > 1 { format!(" {n}") } else { String::new() };
            titles.push(format!("{what}{number}, {unit}"));
        }
    };
    names("opening", "mm", first.mid_mm.len());
    names("suture", "N", first.sutures_n.len());
    names("handle", "N", first.handles_n.len());
    titles.extend(["estimated error, % of the displacement".into(), "multigrid cycles".into()]);
    let mut table = Table::new(titles);
    for stop in stops {
        let values = [&stop.mid_mm, &stop.sutures_n, &stop.handles_n].into_iter().flatten();
        let row = [Cell::number(fixed(stop.time_s, 3)), Cell::text(stop.done.join(", "))];
        let end = [Cell::number(percent(stop.error)), Cell::number(stop.cycles)];
        table.add(row.into_iter().chain(values.map(|&value| Cell::number(fixed(value, 2)))).chain(end));
    }
    table.html("<h2>States of rest, one after the other</h2>")
}

fn stages(stages: &[Stage]) -> String {
    let mut table = Table::new(["stage", "time, ms", "on", "peak memory, MB"]);
    for stage in stages {
        let peak = stage.peak_bytes.map(|bytes| fixed(1e-6 * bytes as f64, 0));
        let ms = Cell::number(fixed(stage.ms, 1));
        table.add([Cell::text(&stage.name), ms, Cell::text(&stage.on), Cell::known(peak)]);
    }
    table.html("<h3>Time and memory per stage</h3>")
}

/// The table of materials, with the source of each row.
pub(super) fn materials(materials: &[MaterialRow]) -> String {
    let mut table = Table::new([
        "tissue",
        "HU",
        "depth, mm",
        "Young's modulus, kPa",
        "bulk modulus, kPa",
        "vertices",
        "tetrahedra",
        "source",
    ]);
    let range = |range: Option<[f64; 2]>| {
        range.map_or_else(|| "any".to_owned(), |[low, high]| format!("{low} to {high}"))
    };
    for row in materials {
        table.add([
            Cell::text(&row.name),
            Cell::number(range(row.hu)),
            Cell::number(range(row.depth_mm)),
            Cell::number(row.youngs_modulus_pa / 1e3),
            Cell::number(row.bulk_modulus_pa / 1e3),
            Cell::number(row.vertices),
            Cell::number(row.tets),
            Cell::text(row.source.as_deref().unwrap_or_default()),
        ]);
    }
    table.html("<h2>Materials</h2>")
}

fn constraints(report: &Report) -> String {
    let mut table =
        Table::new(["kind", "colors", "RMS error, % of the rest size", "largest error, % of the rest size"]);
    for r in &report.residuals {
        let colors = report.colors.get(&r.kind).copied();
        let [rms, max] = [r.rms, r.max].map(|share| Cell::number(four_digits(100.0 * share)));
        table.add([Cell::text(&r.kind), Cell::known(colors), rms, max]);
    }
    table.html("<h3>Constraints</h3>")
}

/// A number with at least four digits after its leading zeros.
fn four_digits(value: f64) -> String {
    let size = value.abs();
    let decimals = if size > 0.0 && size.is_finite() { 3.0 - size.log10().floor() } else { 0.0 };
    fixed(value, decimals.clamp(0.0, 12.0) as usize)
}

/// A table of names and values.
fn facts((title, rows): (&str, Vec<(&str, String)>)) -> String {
    let mut table = Table::new(["", ""]);
    rows.into_iter().for_each(|(what, value)| table.add([Cell::text(what), Cell::number(value)]));
    table.html(&format!("<h3>{title}</h3>"))
}

/// The cost report as a table.
fn costs(costs: &CostReport) -> String {
    let megabytes = |bytes: usize| (bytes > 0).then(|| fixed(bytes as f64 / 1e6, 1));
    let mut table = Table::new(["part", "memory, MB", "on the GPU, MB", "time per frame, ms"]);
    for part in &costs.parts {
        let time = part.ms_per_frame.map(|ms| fixed(ms, 2));
        let memory = [part.host_bytes, part.device_bytes].map(|bytes| Cell::known(megabytes(bytes)));
        table.add([Cell::text(&part.part)].into_iter().chain(memory).chain([Cell::known(time)]));
    }
    table.html("<h3>What the solver costs</h3>") + &format!("<p>Time: {}.</p>", escape(&costs.time))
}

#[cfg(test)]
mod tests {
    use super::four_digits;

    #[test]
    fn shares_keep_four_digits() {
        assert_eq!([0.0, 100.0, 1.23456, 0.000123456].map(four_digits), ["0", "100.0", "1.235", "0.0001235"]);
        assert_eq!(four_digits(123_456.0), "123456");
    }
}
