//! Error against run time, from the start until a body is at rest: the search, and frames with many
//! settings, on small bodies whose equilibrium Newton's method knows.

use std::time::Instant;

use cutis::rest::{Body, Options, Search};
use cutis_newton::{Options as NewtonOptions, Problem as NewtonProblem};
use cutis_render::plot::{Axis, Mark, Scale, Series, line_chart};
use cutis_solver::{Formulation, Settings, Solver};
use cutis_solver_cpu::SolverCpu;
use nalgebra::Point3;
use serde::Serialize;

use super::search::distance;
use crate::accuracy::front::pareto;
use crate::accuracy::problems::{Problem, named};
use crate::kit::{Checks, Failure, Table, number, optional, percent};

/// The problems of the study of accuracy in which no handle moves. A body that a handle pulls rests
/// where the handle ends.
const PROBLEMS: [&str; 4] = ["sheet", "incision", "abdomen", "hanging"];
/// Errors of the table.
const ERRORS: [f64; 3] = [0.1, 0.01, 0.001];
/// Stated error at which the search ends.
const EXACT: f64 = 1e-5;
/// Time that the frames of a setting may take, s.
const LIMIT_S: f64 = 5.0;
/// Frames of a setting end at this error.
const NEAR: f64 = 3e-4;

/// Substeps and iterations of a frame, with and without over-relaxation for vertex block descent.
const DESCENT: [(u32, u32); 9] = [(1, 1), (1, 4), (1, 8), (2, 2), (2, 4), (5, 1), (5, 2), (10, 1), (20, 1)];
const OVER_RELAXATION: [f64; 2] = [1.0, 1.4];
/// The same for XPBD.
const XPBD: [(u32, u32); 6] = [(5, 1), (10, 1), (10, 4), (20, 2), (40, 1), (80, 1)];

/// A method on one problem: time in s and error, from the start until rest.
#[derive(Clone, Debug, Serialize)]
struct Curve {
    name: String,
    points: Vec<[f64; 2]>,
}

/// The search and all settings on one problem.
#[derive(Clone, Debug, Serialize)]
pub struct Front {
    problem: &'static str,
    free: usize,
    search: Curve,
    frames: Vec<Curve>,
}

impl Curve {
    /// Time after which the error stays at most `error`.
    fn within(&self, error: f64) -> Option<f64> {
        let outside = self.points.iter().rposition(|[_, found]| found.is_nan() || *found > error);
        self.points.get(outside.map_or(0, |n| n + 1)).map(|[s, _]| *s)
    }
}

impl Front {
    /// The setting that is within `error` first, and its time in s.
    fn fastest(&self, error: f64) -> Option<(&str, f64)> {
        let within = self.frames.iter().filter_map(|curve| Some((curve.name.as_str(), curve.within(error)?)));
        within.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Measures the problems.
///
/// # Errors
/// A problem cannot be built, or a method refuses it.
pub fn measure(checks: &mut Checks) -> Result<Vec<Front>, Failure> {
    let mut fronts = Vec::new();
    for name in PROBLEMS {
        let Some(problem) = named(name, false)? else { continue };
        let front = one(&problem)?;
        let last = front.search.points.last().map_or(f64::INFINITY, |[_, error]| *error);
        let first = front.search.points.first().map_or(0.0, |[_, error]| *error);
        checks.add(
            format!("{name}: the search ends {} from the equilibrium of Newton's method", percent(last)),
            last <= ERRORS[2],
        );
        checks.control(format!("{name}: its first step is {} from it", percent(first)), first > ERRORS[2]);
        fronts.push(front);
    }
    Ok(fronts)
}

fn one(problem: &Problem) -> Result<Front, Failure> {
    let system = problem.vbd.as_ref().unwrap_or(&problem.xpbd);
    let gravity = problem.settings.gravity_m_s2;
    let start = Instant::now();
    let body = Body::of(system, gravity)?;
    let mut search = Search::new(&body, &Options { error: EXACT, ..Options::default() })?;
    let mut s = start.elapsed().as_secs_f64();
    let mut steps = Vec::new();
    while !search.is_at_rest() {
        let start = Instant::now();
        search.step()?;
        s += start.elapsed().as_secs_f64();
        steps.push((s, search.positions()));
    }
    let newton = NewtonProblem::of(&problem.xpbd.to_f64(), gravity)?;
    let rest = newton.equilibrium(&search.positions(), &NewtonOptions::default())?.positions;
    let start = problem.xpbd.to_f64().positions();
    let points = steps.iter().map(|(s, x)| [*s, distance(x, &rest, &start)]).collect();
    let mut frames = Vec::new();
    for over_relaxation in OVER_RELAXATION {
        for pair in DESCENT {
            let settings =
                Settings { formulation: Formulation::Vbd, relaxation: over_relaxation, ..problem.settings };
            let name =
                if over_relaxation == 1.0 { "vbd".to_owned() } else { format!("vbd ω {over_relaxation}") };
            frames.push(run(&name, system, settings, pair, &rest, &start)?);
        }
    }
    for pair in XPBD {
        let settings = Settings { formulation: Formulation::Xpbd, ..problem.settings };
        frames.push(run("xpbd", &problem.xpbd, settings, pair, &rest, &start)?);
    }
    let search = Curve { name: "search for rest".into(), points };
    Ok(Front { problem: problem.name, free: body.free_count(), search, frames })
}

/// Runs frames with a setting until the body is near rest or the time is up.
fn run(
    method: &str,
    system: &cutis_solver::System<f32>,
    settings: Settings,
    (substeps, iterations): (u32, u32),
    rest: &[Point3<f64>],
    start: &[Point3<f64>],
) -> Result<Curve, Failure> {
    let mut solver = SolverCpu::new(system.clone(), Settings { substeps, iterations, ..settings }, None)?;
    let (mut s, mut points) = (0.0, Vec::new());
    while s < LIMIT_S && points.last().is_none_or(|[_, error]: &[f64; 2]| *error > NEAR) {
        let before = Instant::now();
        if solver.step(1).is_err() {
            // A setting that does not stay finite reaches no error.
            points.push([s, f64::INFINITY]);
            break;
        }
        s += before.elapsed().as_secs_f64();
        let x: Vec<_> = solver.positions()?.iter().map(|x| x.cast::<f64>()).collect();
        points.push([s, distance(&x, rest, start)]);
    }
    Ok(Curve { name: format!("{method} {substeps} × {iterations}"), points })
}

/// For each problem and error the fastest frames, the search, and the ratio of their times.
pub fn table(fronts: &[Front]) -> Table {
    let mut table = Table::new([
        "problem",
        "vertices that move",
        "error at most",
        "fastest frames",
        "until then, s",
        "search, s",
        "frames over search",
    ]);
    for front in fronts {
        for error in ERRORS {
            let (fastest, search) = (front.fastest(error), front.search.within(error));
            let ratio = fastest.zip(search).map(|((_, frames), search)| frames / search);
            table.add([
                front.problem.to_owned(),
                front.free.to_string(),
                percent(error),
                optional(fastest, |(name, _)| name.to_owned()),
                optional(fastest, |(_, s)| number(s)),
                optional(search, number),
                optional(ratio, number),
            ]);
        }
    }
    table
}

/// Error over time for a problem as SVG: the search, and the best of all settings at each time.
pub fn chart(front: &Front) -> String {
    // An error counts at a time if no later one of its setting is larger.
    let all: Vec<[f64; 2]> = front.frames.iter().flat_map(|curve| lasting(&curve.points)).collect();
    let best: Vec<[f64; 2]> = pareto(&all).into_iter().map(|n| all[n]).collect();
    let name = format!("frames, best of {} settings", front.frames.len());
    let series = [
        Series { name: &front.search.name, points: &front.search.points, mark: Mark::Dots },
        Series { name: &name, points: &best, mark: Mark::Dots },
    ];
    let axis = |label| Axis { label, scale: Scale::Log };
    let title = format!("{}: distance from rest", front.problem);
    line_chart(&title, axis("time / s"), axis("distance / displacement"), &series)
}

/// Name of the file of a chart.
pub fn file(front: &Front) -> String {
    format!("rest-front-{}.svg", front.problem)
}

/// The points with the largest error from each on.
fn lasting(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut most = 0.0_f64;
    let mut lasting: Vec<[f64; 2]> = points
        .iter()
        .rev()
        .map(|&[s, error]| {
            most = most.max(error);
            [s, most]
        })
        .collect();
    lasting.reverse();
    lasting
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[[f64; 2]]) -> Curve {
        Curve { name: String::new(), points: points.to_vec() }
    }

    #[test]
    fn an_error_counts_from_when_it_lasts() {
        let points = [[1.0, 0.5], [2.0, 0.05], [3.0, 0.2], [4.0, 0.09], [5.0, 0.01]];
        assert_eq!(curve(&points).within(0.1), Some(4.0));
        assert_eq!(curve(&points).within(0.01), Some(5.0));
        assert_eq!(curve(&points).within(0.001), None);
        assert_eq!(curve(&[[1.0, 0.001], [2.0, f64::NAN]]).within(0.1), None);
        assert_eq!(lasting(&points)[1], [2.0, 0.2]);
    }
}
