//! One problem: every configuration timed, in turns, and compared in the same run.

use cutis_solver::Settings;
use nalgebra::Point3;

use super::Failure;
use super::cases::Case;
use super::config::Config;
use super::row::Row;
use super::running::{Running, State};
use super::yardstick::Yardstick;
use crate::worst::larger;

/// Frames that a configuration runs before it is the next one's turn: load of the machine then falls on all alike.
const ROUND: u32 = 5;
/// A body that moves less in a round, relative to its displacement, needs no more frames.
const STILL: f64 = 1e-6;

/// A configuration at work.
struct Entry<'a> {
    config: &'a Config,
    running: Running,
    row: Row,
    times: Vec<f64>,
    frame: u32,
    last_frame: u32,
    before: Vec<Point3<f64>>,
    halfway: Vec<Point3<f64>>,
    moved: f64,
}

impl<'a> Entry<'a> {
    fn new(case: &Case, config: &'a Config) -> Result<Self, Failure> {
        Ok(Self {
            running: config.backend.start(config.system(case)?, config.settings(&case.settings))?,
            row: Row::of(case.name, config),
            config,
            times: Vec::new(),
            frame: 0,
            last_frame: if config.settles { case.most_frames } else { case.compared_at },
            before: Vec::new(),
            halfway: Vec::new(),
            moved: f64::INFINITY,
        })
    }

    fn is_done(&self, case: &Case) -> bool {
        let settled = self.moved <= STILL && self.frame > 2 * case.compared_at;
        self.row.failure.is_some() || self.frame >= self.last_frame || settled
    }

    /// Runs a few frames, and looks where the body is at their end and at the frame of comparison.
    fn round(&mut self, case: &Case, yardstick: &Yardstick) -> Result<(), Failure> {
        for _ in 0..ROUND.min(self.last_frame - self.frame) {
            match self.running.frame_ms() {
                Ok(ms) => self.times.push(ms),
                Err(error) => {
                    self.row.failure = Some(error.to_string());
                    return Ok(());
                }
            }
            self.frame += 1;
            if self.frame == case.compared_at && self.config.has_material() {
                self.row.e2 = Some(yardstick.e2(&self.running.positions()?));
            }
        }
        let now = self.running.positions()?;
        if !self.before.is_empty() {
            self.moved = yardstick.moved(&now, &self.before);
        }
        if self.halfway.is_empty() && 2 * self.frame >= self.last_frame {
            self.halfway.clone_from(&now);
        }
        self.before = now;
        Ok(())
    }

    /// The row with what is measured at rest.
    fn finish(mut self, case: &Case, yardstick: &Yardstick) -> Row {
        self.times.sort_by(f64::total_cmp);
        self.row.frames = self.times.len();
        self.row.ms_min = self.times.first().copied().unwrap_or(f64::NAN);
        self.row.ms_median = self.times.get(self.times.len() / 2).copied().unwrap_or(f64::NAN);
        if self.row.failure.is_none() && self.config.settles {
            let x = &self.before;
            self.row.e3 = Some(yardstick.e3(x));
            self.row.unrest = Some(match self.halfway.is_empty() {
                true => self.moved,
                false => yardstick.moved(x, &self.halfway),
            });
            self.row.stiffness = Some(yardstick.stiffness(x));
            self.row.opening = case.opening.as_ref().map(|(opening, _)| {
                let open = |x: &[Point3<f64>]| opening(x) - opening(yardstick.rest());
                open(x) / open(yardstick.equilibrium())
            });
            self.row.residuals = yardstick.e4(x);
            self.row.e4 = self.row.residuals.iter().map(|kind| kind.error).reduce(f64::max);
        }
        self.row
    }
}

/// E1 of a configuration: the largest over the instants; none for PBD, which minimizes nothing.
fn e1(case: &Case, config: &Config, yardstick: &Yardstick) -> Result<Option<f64>, Failure> {
    if !config.has_material() {
        return Ok(None);
    }
    let mut worst = 0.0f64;
    for (instant, state) in yardstick.states.iter().enumerate() {
        let found = substep(case, config, state)?;
        worst = larger(worst, yardstick.e1(&found, instant, config.substeps));
    }
    Ok(Some(worst))
}

/// Positions after one substep of `config` from `state`.
pub fn substep(case: &Case, config: &Config, state: &State) -> Result<Vec<Point3<f64>>, Failure> {
    let settings = config.settings(&case.settings);
    let alone = Settings { dt_s: settings.substep_s(), substeps: 1, ..settings };
    let mut running = config.backend.start(config.system(case)?, alone)?;
    running.restore(state, u64::from(state.frame) * u64::from(config.substeps))?;
    running.frame_ms()?;
    Ok(running.positions()?)
}

/// Times and compares all configurations. `tell` is told what is being done.
///
/// # Errors
/// What keeps a configuration from starting; one that fails on its way has its reason in its row.
pub fn run(
    case: &Case,
    configs: &[Config],
    yardstick: &Yardstick,
    tell: &dyn Fn(&str),
) -> Result<Vec<Row>, Failure> {
    tell(&format!("frames, at most {}", case.most_frames));
    let mut entries = configs.iter().map(|config| Entry::new(case, config)).collect::<Result<Vec<_>, _>>()?;
    for round in 0..=case.most_frames.div_ceil(ROUND) {
        let turn = |entry: &mut Entry<'_>| match entry.is_done(case) {
            true => Ok(()),
            false => entry.round(case, yardstick),
        };
        // There and back: no configuration always follows the same one.
        match round % 2 {
            0 => entries.iter_mut().try_for_each(turn)?,
            _ => entries.iter_mut().rev().try_for_each(turn)?,
        }
    }
    tell("single substeps");
    let mut rows = Vec::with_capacity(entries.len());
    for entry in entries {
        let config = entry.config;
        let mut row = entry.finish(case, yardstick);
        match e1(case, config, yardstick) {
            Ok(error) => row.e1 = error,
            Err(error) => row.failure = Some(error.to_string()),
        }
        rows.push(row);
    }
    Ok(rows)
}
