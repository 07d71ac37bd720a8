//! Trials of accelerations: how many sweeps a substep takes with each, serial and in `f64`, against its minimizer.
//!
//! What wins here and is not dearer belongs into the solvers; what does not is reported and stays out of them. The sweeps are
//! this module's own, written from the formulas; that they are those of the solvers is one of the checks.

mod coarse;
mod mix;
mod page;
mod step;

use nalgebra::Point3;
use rayon::prelude::*;

use super::Failure;
use super::cases::Case;
use super::checks::Check;
use super::config::{Backend, Config, VBD, XPBD};
use super::sweep::substep;
use super::yardstick::Yardstick;

use mix::{Mixer, Mixing};
use step::{Iterate, Method, Step};

pub use page::{Tried, csv, page};

/// Errors that a trial has to come below.
pub const LEVELS: [f64; 2] = [0.01, 0.001];
/// Sweeps after which a trial ends.
pub const MOST_SWEEPS: usize = 256;
/// The grid of the coarse start has a step of so many mean lengths of a constraint's first edge.
const COARSER: f64 = 3.0;
/// Substeps of a frame.
pub const SUBSTEPS: [u32; 4] = [1, 5, 10, 20];
/// An error beyond this is not one of an iteration that converges.
const DIVERGED: f64 = 1e3;

/// Which sweeps go through the colors backwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    /// None.
    OneWay,
    /// Every other.
    ThereAndBack,
    /// The second half of all.
    HalfAndHalf,
}

/// What is tried.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    method: Method,
    relaxed: f64,
    order: Order,
    mixing: Mixing,
    coarse_start: bool,
}

impl Recipe {
    const fn plain(method: Method) -> Self {
        Self { method, relaxed: 1.0, order: Order::OneWay, mixing: Mixing::Plain, coarse_start: false }
    }

    /// All that are tried.
    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for method in [Method::Xpbd, Method::Vbd] {
            let plain = Self::plain(method);
            all.extend(
                [Order::OneWay, Order::ThereAndBack, Order::HalfAndHalf].map(|order| Self { order, ..plain }),
            );
            all.push(Self { coarse_start: true, ..plain });
            all.extend([1.2, 1.4, 1.5, 1.6, 1.7, 1.8].map(|relaxed| Self { relaxed, ..plain }));
            all.extend([0.8, 0.9, 0.95, 0.99].map(|r| Self { mixing: Mixing::Chebyshev(r), ..plain }));
            all.extend([1, 2, 4, 8].map(|depth| Self { mixing: Mixing::Anderson(depth), ..plain }));
        }
        let order = Order::HalfAndHalf;
        all.extend([1.2, 1.4, 1.6].map(|relaxed| Self { relaxed, order, ..Self::plain(Method::Vbd) }));
        all
    }

    /// As in the table.
    fn name(&self) -> String {
        let mut words = vec![match self.method {
            Method::Xpbd => XPBD.formulation.to_owned(),
            Method::Vbd => VBD.formulation.to_owned(),
        }];
        words.extend((self.relaxed != 1.0).then(|| format!("ω {}", self.relaxed)));
        match self.order {
            Order::OneWay => (),
            Order::ThereAndBack => words.push("there and back".to_owned()),
            Order::HalfAndHalf => words.push("half there, half back".to_owned()),
        }
        match self.mixing {
            Mixing::Plain => (),
            Mixing::Chebyshev(radius) => words.push(format!("Chebyshev ρ {radius}")),
            Mixing::Anderson(depth) => words.push(format!("Anderson {depth}")),
        }
        words.extend(self.coarse_start.then(|| "coarse start".to_owned()));
        words.join(", ")
    }
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Substeps of a frame.
    pub substeps: u32,
    /// The recipe.
    pub name: String,
    /// E1 before the first sweep.
    pub at_start: f64,
    /// The first sweep after which E1 stays below each of [`LEVELS`].
    pub sweeps: [Option<usize>; 2],
    /// The least E1 of all sweeps.
    pub least: f64,
    /// E1 after the last sweep.
    pub last: f64,
}

/// Tries everything on `case`.
///
/// # Errors
/// A search that does not converge.
pub fn run(case: &Case) -> Result<(Tried, Vec<Check>), Failure> {
    let tell = |what: &str| eprintln!("  {}: {what}", case.name);
    let yardstick = Yardstick::new(case, &[SUBSTEPS[0]], &tell)?;
    let (mut outcomes, mut checks, mut nodes) = (Vec::new(), Vec::new(), 0);
    for substeps in SUBSTEPS {
        tell(&format!("{substeps} substeps a frame"));
        let step = Step::new(&yardstick, &case.settings, substeps)?;
        checks.extend(same_as_solvers(case, &yardstick, &step, substeps)?);
        let (coarse, count) = coarse_x(&step, &yardstick);
        nodes = count;
        let found: Vec<Outcome> =
            Recipe::all().par_iter().map(|recipe| outcome(&step, *recipe, &coarse, substeps)).collect();
        outcomes.extend(found);
    }
    Ok((Tried { problem: case.name, what: case.what.clone(), nodes, outcomes }, checks))
}

/// The coarse start.
fn coarse_x(step: &Step<'_>, yardstick: &Yardstick) -> (Vec<Point3<f64>>, usize) {
    let rest = yardstick.rest();
    let (mut sum, mut count) = (0.0, 0usize);
    for kind in step.kinds() {
        for k in 0..kind.len() {
            if let [a, b, ..] = step::vertices(kind, k) {
                sum += (rest[*a as usize] - rest[*b as usize]).norm();
                count += 1;
            }
        }
    }
    coarse::start(step, rest, step.start(Method::Vbd).x, COARSER * sum / count.max(1) as f64)
}

fn outcome(step: &Step<'_>, recipe: Recipe, coarse: &[Point3<f64>], substeps: u32) -> Outcome {
    let mut start = step.start(recipe.method);
    if recipe.coarse_start {
        start.x = coarse.to_vec();
    }
    let at_start = step.error(&start.x);
    let errors = match recipe.order {
        Order::HalfAndHalf => halves(step, recipe, &start),
        _ => sweep_by_sweep(step, recipe, start),
    };
    let stays_below = |level: f64| {
        let last_above = errors.iter().rposition(|(_, error)| error.is_nan() || *error >= level);
        errors.get(last_above.map_or(0, |n| n + 1)).map(|(sweeps, _)| *sweeps)
    };
    Outcome {
        substeps,
        name: recipe.name(),
        at_start,
        sweeps: LEVELS.map(stays_below),
        least: errors.iter().map(|(_, error)| *error).fold(f64::INFINITY, f64::min),
        last: errors.last().map_or(f64::NAN, |(_, error)| *error),
    }
}

/// Sweeps so far and E1, after every sweep.
fn sweep_by_sweep(step: &Step<'_>, recipe: Recipe, mut iterate: Iterate) -> Vec<(usize, f64)> {
    let mut mixer = Mixer::new(recipe.mixing);
    let mut errors = Vec::new();
    for sweep in 0..MOST_SWEEPS {
        let before = iterate.clone();
        let backwards = recipe.order == Order::ThereAndBack && sweep % 2 == 1;
        step.sweep(recipe.method, &mut iterate, recipe.relaxed, backwards);
        iterate = mixer.next(&before, iterate);
        errors.push((sweep + 1, step.error(&iterate.x)));
        if is_enough(&errors) {
            break;
        }
    }
    errors
}

/// Sweeps and E1 for some numbers of sweeps, of which the second half go backwards.
fn halves(step: &Step<'_>, recipe: Recipe, start: &Iterate) -> Vec<(usize, f64)> {
    let mut errors = Vec::new();
    let mut half = 1;
    while 2 * half <= MOST_SWEEPS && !is_enough(&errors) {
        let mut iterate = start.clone();
        for sweep in 0..2 * half {
            step.sweep(recipe.method, &mut iterate, recipe.relaxed, sweep >= half);
        }
        errors.push((2 * half, step.error(&iterate.x)));
        half += half.div_ceil(4);
    }
    errors
}

/// Whether the last error is far below what is asked for, or far beyond what converges.
fn is_enough(errors: &[(usize, f64)]) -> bool {
    errors.last().is_some_and(|(_, error)| !(0.1 * LEVELS[1]..DIVERGED).contains(error))
}

/// The plain sweeps here and those of the reference solver give the same positions.
fn same_as_solvers(
    case: &Case,
    yardstick: &Yardstick,
    step: &Step<'_>,
    substeps: u32,
) -> Result<Vec<Check>, Failure> {
    let mut checks = Vec::new();
    for (method, own) in [(XPBD, Method::Xpbd), (VBD, Method::Vbd)] {
        let config = Config { backend: Backend::Reference, method, substeps, iterations: 2, settles: false };
        let found = substep(case, &config, &yardstick.states[0])?;
        let mut iterate: Iterate = step.start(own);
        let passes: &[bool] = match own {
            Method::Xpbd => &[false, false],
            Method::Vbd => &[false, false, true, true],
        };
        for &back in passes {
            step.sweep(own, &mut iterate, 1.0, back);
        }
        let differ = yardstick.error(&iterate.x, &found, &step.implicit.start);
        checks.push(Check {
            what: format!(
                "{}: trials: two iterations of {} with {substeps} substeps as the reference solver's (off by {differ:.1e})",
                case.name, method.formulation
            ),
            holds: differ < 1e-9,
        });
        step.sweep(own, &mut iterate, 1.0, false);
        let differ = yardstick.error(&iterate.x, &found, &step.implicit.start);
        checks.push(Check {
            what: format!(
                "{}: trials: control: one more sweep is told apart (off by {differ:.1e})",
                case.name
            ),
            holds: differ > 1e-6,
        });
    }
    Ok(checks)
}
