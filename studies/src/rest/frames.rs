//! Frames of the demo, as far from rest as they are at each time.

use std::time::Instant;

use cutis_render::plot::{Axis, Mark, Scale, Series, line_chart};
use cutis_solver::{Formulation, Settings, Solver};
use cutis_solver_cpu::SolverCpu;
use serde::Serialize;

use super::search::{AT_REST, Demo, Found, distance};
use crate::kit::{Checks, Failure, Table, optional, percent};

/// Substeps and iterations of a frame. The first are those of the scene.
const SETTINGS: [(u32, u32); 3] = [(2, 2), (1, 8), (8, 1)];
/// Time that each setting may take, s.
const LIMIT_S: f64 = 60.0;
/// Times at which the distance is in the table, s.
const TIMES_S: [f64; 4] = [3.0, 10.0, 30.0, 60.0];

/// Frames with a setting.
#[derive(Clone, Debug, Serialize)]
pub struct Frames {
    name: String,
    /// Time in s and distance from rest after each frame.
    points: Vec<[f64; 2]>,
}

/// Runs frames for a minute with each setting.
///
/// # Errors
/// The solver refuses a setting.
pub fn measure(demo: &Demo, checks: &mut Checks) -> Result<Vec<Frames>, Failure> {
    let start = demo.system.system.to_f64().positions();
    let mut all = Vec::new();
    for (substeps, iterations) in SETTINGS {
        let settings =
            Settings { formulation: Formulation::Vbd, substeps, iterations, ..demo.system.settings };
        let mut solver = SolverCpu::new(demo.system.system.clone(), settings, None)?;
        let (mut s, mut points) = (0.0, Vec::new());
        while s < LIMIT_S {
            let before = Instant::now();
            solver.step(1)?;
            s += before.elapsed().as_secs_f64();
            let x: Vec<_> = solver.positions()?.iter().map(|x| x.cast::<f64>()).collect();
            points.push([s, distance(&x, &demo.rest, &start)]);
        }
        all.push(Frames { name: format!("frames, {substeps} × {iterations}"), points });
    }
    let nearest = all.iter().flat_map(|frames| &frames.points).map(|[_, e]| *e).fold(f64::INFINITY, f64::min);
    checks.control(
        format!(
            "the frames come as near as {} in {LIMIT_S} s, so that both end in one state",
            percent(nearest)
        ),
        nearest < 0.5,
    );
    Ok(all)
}

/// The distances at some times, and the time until a body stays within 1 %.
pub fn table(search: &Found, frames: &[Frames]) -> Table {
    let mut columns: Vec<String> = vec!["method".into()];
    columns.extend(TIMES_S.map(|time| format!("after {time} s")));
    columns.push("within 1 %, s".into());
    let mut table = Table::new(columns);
    let rows = std::iter::once(("search for rest", points(search)))
        .chain(frames.iter().map(|frames| (frames.name.as_str(), frames.points.clone())));
    for (name, points) in rows {
        let mut cells = vec![name.to_owned()];
        cells.extend(TIMES_S.map(|time| {
            let last = points.iter().take_while(|[s, _]| *s <= time).last();
            optional(last, |[_, error]| percent(*error))
        }));
        let outside = points.iter().rposition(|[_, error]| *error > AT_REST);
        let within = points.get(outside.map_or(0, |n| n + 1));
        cells.push(optional(within, |[s, _]| format!("{s:.1}")));
        table.add(cells);
    }
    table
}

/// Time and distance from rest after each step of a search.
fn points(search: &Found) -> Vec<[f64; 2]> {
    let prepared = search.prepared_s;
    search.steps.iter().map(|step| [prepared + step.s, step.error]).collect()
}

/// The distances over time as SVG.
pub fn chart(search: &Found, frames: &[Frames]) -> String {
    let mut named = vec![("search for rest".to_owned(), points(search))];
    // The last step is the reference itself.
    named[0].1.pop();
    for frames in frames {
        // Enough points for a line on logarithmic axes.
        let mut points: Vec<[f64; 2]> = Vec::new();
        for point in &frames.points {
            if points.last().is_none_or(|last| point[0] > 1.1 * last[0]) {
                points.push(*point);
            }
        }
        named.push((frames.name.clone(), points));
    }
    let series: Vec<Series<'_>> =
        named.iter().map(|(name, points)| Series { name, points, mark: Mark::Dots }).collect();
    let axis = |label| Axis { label, scale: Scale::Log };
    line_chart("demo: distance from rest", axis("time / s"), axis("distance / displacement"), &series)
}
