//! The figures of a report that the table of a sweep has.

use crate::report::{Report, fixed};

/// A figure: column, value, and whether it depends on the machine.
pub(super) struct Figure {
    pub(super) column: String,
    pub(super) value: f64,
}

/// Decimals of a length in mm. Positions are less exact than that.
const DECIMALS_OF_MM: usize = 6;

impl Figure {
    /// The value as a cell of the table.
    pub(super) fn text(&self) -> String {
        if !self.column.ends_with("_mm") {
            return self.value.to_string();
        }
        let text = fixed(self.value, DECIMALS_OF_MM);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

/// Columns that depend on the machine and its load. They are the last ones of the table.
pub(super) const MEASURED: [&str; 3] = ["frame_ms", "seconds", "peak_mb"];

/// The figures of a report, and the wall time of the case in s. A figure that the run does not have
/// is absent.
pub(super) fn figures(report: &Report, seconds: f64) -> Vec<Figure> {
    let mut all = Vec::new();
    let mut put = |column: &str, value: f64| all.push(Figure { column: column.into(), value });
    put("vertices", report.sizes.vertices as f64);
    put("tetrahedra", report.sizes.tets as f64);
    put("frames", f64::from(report.frames.count));
    for (n, wound) in report.wounds.iter().enumerate() {
        put(&format!("wound{n}_initial_mm"), wound.initial_mm);
        put(&format!("wound{n}_final_mm"), wound.final_mm);
        put(&format!("wound{n}_mid_mm"), wound.mid_mm);
    }
    for (n, suture) in report.sutures.iter().enumerate() {
        put(&format!("suture{n}_n"), suture.force_n);
    }
    for (n, handle) in report.handles.iter().enumerate() {
        put(&format!("handle{n}_n"), handle.force_n);
    }
    put("max_displacement_mm", report.max_displacement_mm);
    report.border_displacement_mm.into_iter().for_each(|mm| put("border_displacement_mm", mm));
    if let Some(rest) = &report.rest {
        put("rest_error", rest.error);
        put("rest_force", rest.force);
    }
    let residual = report.residuals.iter().map(|residual| residual.rms).reduce(f64::max);
    residual.into_iter().for_each(|rms| put("residual_rms", rms));
    report.resample.iter().for_each(|resample| put("folds", resample.folds as f64));
    put("warnings", report.warnings.len() as f64);
    if report.frames.count > 0 {
        put("frame_ms", report.frames.ms_mean);
    }
    put("seconds", seconds);
    let peak = report.stages.iter().filter_map(|stage| stage.peak_bytes).max();
    peak.into_iter().for_each(|bytes| put("peak_mb", 1e-6 * bytes as f64));
    all
}

/// The order of a column, so that the tables of all sweeps have the same one.
pub(super) fn order(column: &str) -> (usize, usize, String) {
    const STARTS: [&str; 17] = [
        "vertices",
        "tetrahedra",
        "frames",
        "wound",
        "suture",
        "handle",
        "max_displacement_mm",
        "border_displacement_mm",
        "rest_error",
        "rest_force",
        "residual_rms",
        "folds",
        "warnings",
        "frame_ms",
        "seconds",
        "peak_mb",
        "",
    ];
    let group = STARTS.iter().position(|start| column.starts_with(start)).unwrap_or_default();
    let digits: String = column.chars().filter(char::is_ascii_digit).collect();
    let part = ["_initial_mm", "_final_mm", "_mid_mm"].iter().position(|end| column.ends_with(end));
    (group, digits.parse().unwrap_or_default(), part.unwrap_or_default().to_string())
}
