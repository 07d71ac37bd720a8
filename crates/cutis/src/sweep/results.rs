//! The figures of a report that the table of a sweep has.

use crate::report::Report;

/// A figure: column, value, and whether it depends on the machine.
pub(super) struct Figure {
    pub(super) column: String,
    pub(super) value: f64,
}

/// Length in mm below which a value is what rounding left of zero: positions are less exact.
const ROUNDING_MM: f64 = 5e-7;

impl Figure {
    /// The value as a cell of the table.
    pub(super) fn text(&self) -> String {
        let is_rounding = self.column.ends_with("_mm") && self.value.abs() < ROUNDING_MM;
        if is_rounding { "0".into() } else { self.value.to_string() }
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

#[cfg(test)]
mod tests {
    use super::Figure;

    #[test]
    fn lengths_that_rounding_left_are_zero_and_others_keep_all_digits() {
        let text = |column: &str, value| Figure { column: column.into(), value }.text();
        assert_eq!(text("wound0_initial_mm", -1.456_952_299e-7), "0");
        assert_eq!(text("wound0_initial_mm", -0.0), "0");
        assert_eq!(text("wound0_final_mm", 31.388_349_254_112_38), "31.38834925411238");
        assert_eq!(text("wound0_final_mm", -2.5e-6), "-0.0000025");
        assert_eq!(text("rest_error", 1e-7), "0.0000001");
    }
}
