//! The plots of a page, and the quantities in them.

use cutis_render::plot::{Axis, Mark, Scale, Series, line_chart};

use crate::output::rest_report::RestReport;
use crate::run::frames::FrameRow;

/// Largest number of rows that a page shows in plots. Of longer runs it shows rows at equal
/// distances.
const MOST_ROWS: usize = 1000;

/// A quantity of a run that changes with time.
pub(super) struct Quantity {
    /// Its plot.
    plot: &'static Plot,
    /// Name in the legend.
    pub(super) name: String,
    value: Box<dyn Fn(&FrameRow) -> f64>,
}

/// What quantities share a plot.
struct Plot {
    title: &'static str,
    axis: &'static str,
    unit: &'static str,
}

const OPENING: Plot = Plot { title: "Opening of the wound", axis: "distance of the lips / mm", unit: "mm" };
const SUTURES: Plot = Plot { title: "Force of the sutures", axis: "sum over the threads / N", unit: "N" };
const HANDLES: Plot = Plot { title: "Force of the handles", axis: "force / N", unit: "N" };

impl Quantity {
    /// The quantities that a row has.
    pub(super) fn of(row: &FrameRow) -> Vec<Self> {
        let wounds = row.gapes.len();
        let mut all = Vec::new();
        let mut add = |plot, name: String, value: Box<dyn Fn(&FrameRow) -> f64>| {
            all.push(Self { plot, name, value });
        };
        for n in 0..wounds {
            let name = |what: &str| if wounds == 1 { what.into() } else { format!("wound {} {what}", n + 1) };
            add(&OPENING, name("mean"), Box::new(move |row| row.gapes[n].mean_mm));
            add(&OPENING, name("in the middle"), Box::new(move |row| row.gapes[n].mid_mm));
        }
        for n in 0..row.sutures.len() {
            add(&SUTURES, format!("suture {}", n + 1), Box::new(move |row| row.sutures[n][0]));
        }
        for n in 0..row.handles.len() {
            add(&HANDLES, format!("handle {}", n + 1), Box::new(move |row| row.handles[n]));
        }
        all
    }

    /// Title of its plot.
    pub(super) fn title(&self) -> &'static str {
        self.plot.title
    }

    pub(super) fn unit(&self) -> &'static str {
        self.plot.unit
    }

    /// The value in a row that has the quantity.
    pub(super) fn value(&self, row: &FrameRow) -> f64 {
        (self.value)(row)
    }
}

/// At most [`MOST_ROWS`] and one rows of a run, at equal distances, with the first and the last.
pub(super) fn shown_rows(rows: &[FrameRow]) -> Vec<&FrameRow> {
    let last = rows.len().saturating_sub(1);
    let count = last.min(MOST_ROWS);
    let row = |n: usize| rows.get(n * last / count.max(1));
    (0..=count).filter_map(row).collect()
}

/// The plots over time, one for each kind of quantity. None without frames.
pub(super) fn over_time(quantities: &[Quantity], rows: &[&FrameRow]) -> Vec<String> {
    if rows.len() < 2 {
        return Vec::new();
    }
    let chart = |of_plot: &[Quantity]| {
        let Plot { title, axis, .. } = of_plot[0].plot;
        let curves: Vec<Vec<[f64; 2]>> = of_plot
            .iter()
            .map(|quantity| rows.iter().map(|row| [row.time_s, quantity.value(row)]).collect())
            .collect();
        let series: Vec<Series<'_>> = of_plot
            .iter()
            .zip(&curves)
            .map(|(Quantity { name, .. }, points)| Series { name, points, mark: Mark::Line })
            .collect();
        let axis_of = |label| Axis { label, scale: Scale::Linear };
        line_chart(title, axis_of("time / s"), axis_of(axis), &series)
    };
    quantities.chunk_by(|a, b| a.plot.title == b.plot.title).map(chart).collect()
}

/// A plot of the search for the state of rest; none if it made no step.
pub(super) fn search(rest: &RestReport) -> Option<String> {
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
    let [x, y] = [("multigrid cycles", Scale::Linear), ("share (no unit)", Scale::Log)];
    let axis = |(label, scale)| Axis { label, scale };
    (!rest.steps.is_empty()).then(|| line_chart("Search for the state of rest", axis(x), axis(y), &series))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_runs_have_a_bounded_number_of_rows_with_the_last_one() {
        let row = |frame| FrameRow {
            frame,
            time_s: f64::from(frame),
            ms: None,
            gapes: vec![],
            sutures: vec![],
            handles: vec![f64::from(frame)],
        };
        for count in [0, 1, 2, 1001, 1002, 5000] {
            let rows: Vec<FrameRow> = (0..count).map(row).collect();
            let shown = shown_rows(&rows);
            assert_eq!(shown.len(), (count as usize).min(MOST_ROWS + 1));
            assert_eq!(shown.last().map(|row| row.frame), count.checked_sub(1));
            assert!(shown.windows(2).all(|pair| pair[0].frame < pair[1].frame));
            let quantities = rows.first().map(Quantity::of).unwrap_or_default();
            assert_eq!(over_time(&quantities, &shown).len(), usize::from(count > 1));
        }
    }
}
