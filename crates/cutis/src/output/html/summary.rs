//! The sentences at the top of a page.

use std::fmt::Write as _;

use super::text::{capitalized, escape};
use crate::output::report::{Report, Wound};

/// The sentences about a run, as paragraphs.
pub(super) fn summary(report: &Report) -> String {
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
