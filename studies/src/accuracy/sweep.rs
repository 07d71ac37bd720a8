//! All configurations of one problem, timed in turns and compared with the reference in the same
//! run.

use cutis_solver::Settings;
use nalgebra::Point3;

use super::Failure;
use super::config::Config;
use super::measurement::Measurement;
use super::problems::Problem;
use super::reference::Reference;
use super::running::{Running, State};
use crate::kit::larger;

/// Frames of a configuration before the next one runs, so that the load of the machine affects all
/// alike.
const ROUND: u32 = 5;
/// A body is at rest and needs no more frames if its motion in a round, divided by its
/// displacement, is below this.
const STILL: f64 = 1e-6;

/// A running configuration.
struct Entry<'a> {
    config: &'a Config,
    running: Running,
    row: Measurement,
    times: Vec<f64>,
    frame: u32,
    last_frame: u32,
    before: Vec<Point3<f64>>,
    halfway: Vec<Point3<f64>>,
    moved: f64,
}

impl<'a> Entry<'a> {
    fn new(problem: &Problem, config: &'a Config) -> Result<Self, Failure> {
        Ok(Self {
            running: config.backend.start(config.system(problem)?, config.settings(&problem.settings))?,
            row: Measurement::of(problem.name, config),
            config,
            times: Vec::new(),
            frame: 0,
            last_frame: if config.settles { problem.most_frames } else { problem.compared_at },
            before: Vec::new(),
            halfway: Vec::new(),
            moved: f64::INFINITY,
        })
    }

    fn is_done(&self, problem: &Problem) -> bool {
        let settled = self.moved <= STILL && self.frame > 2 * problem.compared_at;
        self.row.failure.is_some() || self.frame >= self.last_frame || settled
    }

    /// Runs a few frames. Compares the positions at the frame of E2, and stores the final
    /// positions.
    fn round(&mut self, problem: &Problem, reference: &Reference) -> Result<(), Failure> {
        for _ in 0..ROUND.min(self.last_frame - self.frame) {
            match self.running.frame_ms() {
                Ok(ms) => self.times.push(ms),
                Err(error) => {
                    self.row.failure = Some(error.to_string());
                    return Ok(());
                }
            }
            self.frame += 1;
            if self.frame == problem.compared_at && self.config.has_material() {
                self.row.e2 = Some(reference.e2(&self.running.positions()?));
            }
        }
        let now = self.running.positions()?;
        if !self.before.is_empty() {
            self.moved = reference.moved(&now, &self.before);
        }
        if self.halfway.is_empty() && 2 * self.frame >= self.last_frame {
            self.halfway.clone_from(&now);
        }
        self.before = now;
        Ok(())
    }

    /// The measurement, with the errors at rest.
    fn finish(mut self, problem: &Problem, reference: &Reference) -> Measurement {
        self.times.sort_by(f64::total_cmp);
        self.row.frames = self.times.len();
        self.row.ms_min = self.times.first().copied().unwrap_or(f64::NAN);
        self.row.ms_median = self.times.get(self.times.len() / 2).copied().unwrap_or(f64::NAN);
        if self.row.failure.is_none() && self.config.settles {
            let x = &self.before;
            self.row.e3 = Some(reference.e3(x));
            self.row.residual_motion = Some(match self.halfway.is_empty() {
                true => self.moved,
                false => reference.moved(x, &self.halfway),
            });
            self.row.stiffness = Some(reference.stiffness(x));
            self.row.opening = problem.opening.as_ref().map(|(opening, _)| {
                let open = |x: &[Point3<f64>]| opening(x) - opening(reference.rest());
                open(x) / open(reference.equilibrium())
            });
            self.row.residuals = reference.e4(x);
            self.row.e4 = self.row.residuals.iter().map(|kind| kind.error).reduce(f64::max);
        }
        self.row
    }
}

/// E1 of a configuration: the largest over the instants. `None` for PBD, which minimizes nothing.
fn e1(problem: &Problem, config: &Config, reference: &Reference) -> Result<Option<f64>, Failure> {
    if !config.has_material() {
        return Ok(None);
    }
    let mut worst = 0.0f64;
    for (instant, state) in reference.states.iter().enumerate() {
        let found = substep(problem, config, state)?;
        worst = larger(worst, reference.e1(&found, instant, config.substeps));
    }
    Ok(Some(worst))
}

/// Positions after one substep of `config` from `state`.
pub fn substep(problem: &Problem, config: &Config, state: &State) -> Result<Vec<Point3<f64>>, Failure> {
    let settings = config.settings(&problem.settings);
    let alone = Settings { dt_s: settings.substep_s(), substeps: 1, ..settings };
    let mut running = config.backend.start(config.system(problem)?, alone)?;
    running.restore(state, u64::from(state.frame) * u64::from(config.substeps))?;
    running.frame_ms()?;
    Ok(running.positions()?)
}

/// Times and compares all configurations. Calls `progress` before each part.
///
/// # Errors
/// A configuration cannot start. The measurement of one that fails later holds the reason.
pub fn run(
    problem: &Problem,
    configs: &[Config],
    reference: &Reference,
    progress: &dyn Fn(&str),
) -> Result<Vec<Measurement>, Failure> {
    progress(&format!("frames, at most {}", problem.most_frames));
    let mut entries =
        configs.iter().map(|config| Entry::new(problem, config)).collect::<Result<Vec<_>, _>>()?;
    for round in 0..=problem.most_frames.div_ceil(ROUND) {
        let run_round = |entry: &mut Entry<'_>| match entry.is_done(problem) {
            true => Ok(()),
            false => entry.round(problem, reference),
        };
        // In alternating order, so that no configuration always follows the same one.
        match round % 2 {
            0 => entries.iter_mut().try_for_each(run_round)?,
            _ => entries.iter_mut().rev().try_for_each(run_round)?,
        }
    }
    progress("single substeps");
    let mut rows = Vec::with_capacity(entries.len());
    for entry in entries {
        let config = entry.config;
        let mut row = entry.finish(problem, reference);
        match e1(problem, config, reference) {
            Ok(error) => row.e1 = error,
            Err(error) => row.failure = Some(error.to_string()),
        }
        rows.push(row);
    }
    Ok(rows)
}
