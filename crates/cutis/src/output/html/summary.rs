//! The sentences of a page: its heading, the result, and how it was computed.

use std::fmt::Write as _;
use std::path::Path;

use super::text::{capitalized, escape};
use crate::output::report::{Report, Wound, fixed};
use crate::output::rest_report::percent;
use crate::run::frames::FrameRow;
use crate::scene::Scene;

/// The heading: the CT, the scene, the program, the date and the time, and what a run is not.
pub(super) fn heading(report: &Report) -> String {
    let name = |number: usize| {
        let path = Path::new(&report.inputs.get(number)?.path);
        Some(path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned())
    };
    let ct = match report.scene.volume.phantom {
        Some(_) => "Synthetic CT".into(),
        None => name(1).unwrap_or_else(|| "CT".into()),
    };
    let scene = name(0).unwrap_or_else(|| "without a name".into());
    let when = report.finished_at.replace('T', " ").replace('Z', " UTC");
    format!(
        "<header><h1>{}, scene {}</h1><p class=\"note\">Computed by Cutis {} in {} s. Finished at {}.</p>\
         <p class=\"limits\">For research and teaching. <b>This is not a medical device.</b> Do not use it for \
         diagnosis, or to plan or guide a treatment.</p></header>",
        escape(&ct),
        escape(&scene),
        escape(&report.cutis_version),
        fixed(report.total_ms / 1e3, 1),
        escape(&when),
    )
}

/// The result: how far each wound opened, whether that is at rest, and the forces.
pub(super) fn result(report: &Report, rows: &[FrameRow]) -> String {
    let mut text = String::from("<p class=\"result\">");
    for (n, wound) in report.wounds.iter().enumerate() {
        let name = match report.wounds.len() {
            1 => "The wound".into(),
            _ => format!("Wound {} ({})", n + 1, wound_section(&report.scene, n)),
        };
        let Wound { initial_mm, final_mm, mid_mm, .. } = wound;
        let [initial, last, mid] = [initial_mm, final_mm, mid_mm].map(|&mm| fixed(mm, 2));
        let _ = write!(
            text,
            "{name} {} from <b>{initial} mm</b> to <b>{last} mm</b> (mean distance of the lips; {mid} mm in \
             the middle).<br>",
            opened_or_closed(*initial_mm, *final_mm)
        );
    }
    if report.wounds.is_empty() {
        text.push_str("The scene makes no wound. ");
    }
    let _ = write!(
        text,
        "{} The largest displacement of tissue is {} mm.</p>",
        state(report, rows),
        fixed(report.max_displacement_mm, 2)
    );
    let forces = report.sutures.iter().map(|suture| suture.summary());
    for line in forces.chain(report.handles.iter().map(|handle| handle.summary())) {
        let _ = write!(text, "<p>{}.</p>", escape(&capitalized(&line)));
    }
    text
}

/// What a wound did, by its opening at the start and at the end. Sutures close it.
fn opened_or_closed(initial_mm: f64, final_mm: f64) -> &'static str {
    if final_mm < initial_mm { "closed" } else { "opened" }
}

/// The section of a wound: incisions come before excisions.
fn wound_section(scene: &Scene, wound: usize) -> String {
    match wound.checked_sub(scene.incision.len()) {
        None => format!("incision[{wound}]"),
        Some(excision) => format!("excision[{excision}]"),
    }
}

/// One sentence on whether the last state is at rest.
fn state(report: &Report, rows: &[FrameRow]) -> String {
    if let Some(rest) = &report.rest {
        return format!(
            "The body is <b>at rest</b>, with an estimated error of {} % of the displacement.",
            percent(rest.error)
        );
    }
    let [.., before, last] = rows else { return "The run has no frames.".into() };
    let frames = format!("This is the state after {} frames, {} s", last.frame, fixed(last.time_s, 3));
    let changes = before.gapes.iter().zip(&last.gapes).map(|(a, b)| (b.mean_mm - a.mean_mm).abs());
    match changes.reduce(f64::max) {
        Some(change) => format!(
            "{frames}. It is <b>not shown to be at rest</b>: in the last frame the opening changed by {} mm. \
             <code>cutis settle</code> finds the state of rest and estimates its error.",
            fixed(change, 4)
        ),
        None => format!("{frames}."),
    }
}

/// How the result was computed: the sizes of the model, the backend, and the search for rest.
pub(super) fn computation(report: &Report) -> String {
    let s = &report.sizes;
    let backend = &report.backend;
    let machine = match (&backend.adapter, &backend.adapter_kind, &backend.driver) {
        (Some(adapter), Some(kind), Some(driver)) => format!("{adapter}, {kind}; {driver}"),
        _ => format!("{}, {} threads", report.machine.cpu, backend.threads),
    };
    let mut text = format!(
        "<p>The model has {} vertices, {} edges, {} tetrahedra and {} skin triangles. It ran {} frames on \
         <b>{}</b> ({}; {})",
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
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wound_that_became_narrower_has_closed() {
        assert_eq!(opened_or_closed(9.4, 6.89), "closed");
        assert_eq!(opened_or_closed(0.0, 6.89), "opened");
        assert_eq!(opened_or_closed(0.0, 0.0), "opened");
    }
}
