//! Tables and charts of the page.

use cutis_render::plot::{Axis, Mark, Scale, Series, line_chart};

use super::compare::{Answer, Comparison, RING_MM, STAYED_MM};
use super::runs::WholeRun;
use crate::kit::{Row, Table};

impl Row for WholeRun {
    const COLUMNS: &'static [&'static str] = &[
        "scene",
        "elements",
        "links",
        "moved",
        "violated links",
        "energy, mm²",
        "sweeps",
        "propagation, ms",
        "relaxation, ms",
        "longest frame, ms",
        "opening, mm",
        "resampling, s",
    ];

    fn cells(&self) -> Vec<String> {
        let model = self.report.chainmail.clone().unwrap_or_default();
        let sizes = &self.report.sizes;
        vec![
            self.scene.clone(),
            sizes.vertices.to_string(),
            sizes.edges.to_string(),
            model.moved.to_string(),
            model.violated_links.to_string(),
            format!("{:.0} → {:.0}", model.energy_before, model.energy_after),
            model.relax_sweeps.to_string(),
            format!("{:.2}", self.part_ms("propagation")),
            format!("{:.2}", self.part_ms("relaxation")),
            format!("{:.1}", self.slowest_ms),
            format!("{:.2} → {:.2}", self.opening_mm[0], self.opening_mm[1]),
            format!("{:.2}", self.stage_s("resample the CT")),
        ]
    }
}

impl Row for Answer {
    const COLUMNS: &'static [&'static str] = &[
        "model",
        "longest frame, ms",
        "frames",
        "all frames, s",
        "vertices moved > 1 mm",
        "mean difference, mm",
        "95 %, mm",
        "largest, mm",
    ];

    fn cells(&self) -> Vec<String> {
        let mut cells = vec![self.name.to_owned(), format!("{:.2}", self.frame_ms), self.frames.to_string()];
        cells.extend([format!("{:.2}", self.all_s), self.moved.to_string()]);
        cells.extend(self.differs_mm.map(|mm| format!("{mm:.2}")));
        cells
    }
}

/// The results of one comparison, with the size of its body.
pub(super) fn models(comparison: &Comparison) -> String {
    format!(
        "`{}` at {} mm, {} vertices:\n\n{}",
        comparison.scene,
        comparison.spacing_mm,
        comparison.vertices,
        Table::of(&comparison.answers).markdown()
    )
}

/// Mean displacement over the distance from the dragged vertices, as SVG.
pub(super) fn chart(comparison: &Comparison) -> String {
    let curves: Vec<Vec<[f64; 2]>> = comparison
        .answers
        .iter()
        .map(|answer| {
            let middle = |(n, mm): (usize, &f64)| [(n as f64 + 0.5) * RING_MM, *mm];
            answer.rings_mm.iter().enumerate().map(middle).collect()
        })
        .collect();
    let named = comparison.answers.iter().zip(&curves);
    let series: Vec<Series<'_>> =
        named.map(|(answer, points)| Series { name: answer.name, points, mark: Mark::Line }).collect();
    let axis = |label| Axis { label, scale: Scale::Linear };
    line_chart(
        &format!("{}: reach of a drag", comparison.scene),
        axis("distance from the dragged vertices / mm"),
        axis("mean displacement / mm"),
        &series,
    )
}

const _: () = assert!(STAYED_MM == 1.0, "the head of the column names the limit");
