//! `cutis tune`: which setting a scene needs on this machine, measured; and what of it can be left out.
//!
//! A calibration runs the scene to its end, again and again on one prepared body. First a reference in double precision
//! ([`reference`]), with an estimate of its own error; then candidate settings, cheapest first, on the scene's backend, each timed
//! and compared with the reference. A candidate is given up a quarter or half of the way when a cheaper one is much
//! nearer to the reference already, or when it is over the budget. What is promised of the chosen setting was measured on a
//! whole run of it, so that a run of the scene repeats it: its displacements bit for bit, its time as far as the machine
//! is as busy as it was.

mod bench;
mod choose;
mod copy;
mod field;
mod leave_out;
mod reference;
mod sample;
mod setting;

use std::ops::ControlFlow;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::backend::Request;
use crate::clock::Clock;
use crate::dynamics::{self, Dynamics};
use crate::plan::{self, Prepared};
use crate::report::{Backend, Machine, Stage};
use crate::scene::{FormulationChoice, LoadedScene};
use crate::{CostLedger, Error, Progress};

use bench::{Bench, Run};
pub use choose::Demand;
use copy::Copy;
pub use leave_out::Omission;
use leave_out::Whole;
use reference::Reference;
pub use reference::ReferenceReport;
pub use setting::Setting;

/// Version of the layout of a calibration; the number grows when a key changes its meaning or goes.
pub const SCHEMA: &str = "cutis-tune/1";

/// Share of the time of a calibration that the reference may take.
const REFERENCE_SHARE: f64 = 0.6;
/// A candidate is given up when a cheaper one's error is smaller by this factor at the same moment.
const MUCH_NEARER: f64 = 0.7;
/// A candidate is given up when it is over the budget by this factor.
const OVER_BUDGET: f64 = 1.2;
/// Settings that are expected to cost so many times as much as one that does are not tried.
const DEARER: f64 = 1.5;
/// An error is told apart from the reference's own if it is larger by this factor.
const TOLD_APART: f64 = 4.0;
/// Times of the same setting differ by less than this on a machine that is equally busy.
const STEADY: f64 = 0.2;

/// How to tune a scene.
#[derive(Clone, Debug)]
pub struct TuneOptions {
    /// What is asked of the setting.
    pub demand: Demand,
    /// Where the tuned copy of the scene goes.
    pub out: PathBuf,
    /// Whether a file that is there may be replaced.
    pub overwrite: bool,
    /// Time that the choice of a setting may take, and again what follows it, minutes; a guide, since what was begun is finished.
    pub minutes: f64,
    /// Whether to measure what can be left out.
    pub omissions: bool,
}

/// A calibration.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Tuning {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of this program.
    pub cutis_version: String,
    /// Machine that it ran on.
    pub machine: Machine,
    /// What the candidates ran on.
    pub backend: Backend,
    /// Frames of a run.
    pub frames: u32,
    /// What was asked for.
    pub demand: Demand,
    /// What the candidates were measured against.
    pub reference: ReferenceReport,
    /// All settings that were thought of, by the cost that was expected.
    pub candidates: Vec<Candidate>,
    /// The one to take; none if none meets the demand.
    pub picked: Option<Candidate>,
    /// The tuned copy of the scene; none if no setting meets the demand.
    pub scene_file: Option<PathBuf>,
    /// Bytes and time of the picked setting by part.
    pub ledger: CostLedger,
    /// What can be left out, and what that saves and changes; empty if it was not measured.
    pub omissions: Vec<Omission>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Time that it took, by stage.
    pub stages: Vec<Stage>,
}

/// A setting and what was found of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Candidate {
    /// The setting.
    pub setting: Setting,
    /// Wall time of a frame that was expected before, ms.
    pub expected_ms: f64,
    /// Mean wall time of the frames that were run, ms; none if it was not run.
    pub ms_per_frame: Option<f64>,
    /// RMS distance of the positions from the reference at the end over the RMS displacement of the reference, over the vertices that
    /// can move; none if it did not get there.
    pub error: Option<f64>,
    /// Opening of each wound: what it opens by and how that differs from the reference; empty if it did not get there.
    pub wounds: Vec<WoundError>,
    /// Whether no other measured setting is as cheap and as near.
    pub pareto: bool,
    /// Whether it is the scene's own.
    pub own: bool,
    /// Why it was not run, or not to the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub abandoned: Option<String>,
}

/// How a wound opened, against the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WoundError {
    /// What it opened by, mm: mean distance of its lips, at the end less at the start.
    pub growth_mm: f64,
    /// That, less what it opens by in the reference, mm.
    pub difference_mm: f64,
    /// The same in percent of what it opens by in the reference.
    pub difference_percent: f64,
}

/// Measures which setting a scene needs on this machine, and writes a copy of the scene with it.
///
/// # Errors
/// [`Error::SceneKey`] and [`Error::Request`] for what cannot be tuned; others as a run of the scene would give them. That no
/// setting meets the demand is none: see [`Tuning::unmet`].
pub fn tune(loaded: &LoadedScene, options: &TuneOptions, progress: &dyn Progress) -> Result<Tuning, Error> {
    check(loaded, options)?;
    let copy = Copy::to(&options.out, options.overwrite, loaded)?;
    let mut clock = Clock::new(progress);
    let Prepared { source, body, backend, plan, .. } =
        plan::prepare(loaded, Request::of(loaded)?, &mut clock)?;
    // With the colours of the vertices, which every formulation but one passes by.
    let Dynamics { system, settings, .. } = clock.stage("constraints of all formulations", 0, |_| {
        let mut all = loaded.clone();
        all.scene.solver.formulation = FormulationChoice::Vbd;
        dynamics::build(&all, &body)
    })?;
    let backend = backend.kept_open()?;
    plan.warnings.iter().for_each(|warning| progress.note(warning));
    let bench = Bench::new(&system, settings, &body.cut.gapes, &backend, loaded.scene.run.frames);
    let own = Setting::of(&loaded.scene.solver);
    let limit_s = 60.0 * options.minutes;
    let reference =
        reference::run(&bench, own, options.demand.reference_error(), REFERENCE_SHARE * limit_s, &mut clock)
            .map_err(loaded.blame("run"))?;
    let mut trials =
        Trials { bench: &bench, reference: &reference, demand: options.demand, done: Vec::new() };
    trials.run(own, limit_s - reference.told.seconds, &mut clock)?;
    let mut candidates = trials.done;
    choose::mark_front(&mut candidates);
    let place = candidates.iter().position(|candidate| candidate.own).unwrap_or(0);
    let picked = options.demand.choose(&candidates, place, reference.told.error);
    let picked = picked.map(|place| candidates[place].clone());
    let mut tuning = Tuning {
        schema: SCHEMA.into(),
        cutis_version: env!("CARGO_PKG_VERSION").into(),
        machine: Machine::here(),
        backend: plan.backend,
        frames: bench.frames,
        demand: options.demand,
        warnings: warnings(&reference, picked.as_ref()),
        reference: reference.told,
        candidates,
        picked,
        scene_file: None,
        ledger: plan.ledger,
        omissions: Vec::new(),
        stages: Vec::new(),
    };
    if let Some(picked) = &tuning.picked {
        let times = clock.stage("parts of a frame", 0, |_| bench.ledger(picked.setting))?;
        let how = "one frame of the picked setting, part by part";
        tuning.ledger = tuning.ledger.with_times(&times, 1.0, how);
        let mut scene = loaded.scene.clone();
        scene.solver = picked.setting.applied_to(&scene.solver);
        clock.stage("write the scene", 0, |_| copy.write(&scene, &tuning.promise(picked)))?;
        tuning.scene_file = Some(options.out.clone());
        if options.omissions {
            let run =
                clock.stage(&format!("{} once more", picked.setting), bench.frames.into(), |progress| {
                    bench.run(picked.setting, progress, |_| ControlFlow::Continue(()))
                })?;
            tuning.warnings.extend(unsteady(picked, run.ms_per_frame));
            let setting = picked.setting;
            let whole = Whole { loaded, source: &source, body: &body, bench: &bench, setting, run };
            tuning.omissions = whole.omissions(limit_s, &mut clock)?;
        }
    }
    tuning.stages = clock.stages;
    Ok(tuning)
}

/// Refuses what cannot be tuned.
fn check(loaded: &LoadedScene, options: &TuneOptions) -> Result<(), Error> {
    let key = |key: &str, value: &str, why: &str| {
        Err(Error::SceneKey {
            file: loaded.file.clone(),
            key: key.into(),
            value: value.into(),
            why: why.into(),
        })
    };
    let scene = &loaded.scene;
    if scene.solver.formulation == FormulationChoice::Pbd {
        let why = "cannot be tuned: with \"pbd\" stiffness depends on substeps and iterations, so that there is nothing that \
                   finer ones come closer to; use \"xpbd\" or \"vbd\"";
        return key("solver.formulation", "\"pbd\"", why);
    }
    if scene.run.frames == 0 {
        return key("run.frames", "0", "must be 1 or more to be tuned: the error is that of the last frame");
    }
    let refuse = |what: String, why: &str| Err(Error::Request { what, why: why.into() });
    let positive = |value: f64| value.is_finite() && value > 0.0;
    match options.demand {
        Demand::BudgetMs(ms) if !positive(ms) => {
            refuse(format!("a budget of {ms} ms"), "must be a number above 0")
        }
        Demand::Error(error) if !positive(error) || error >= 1.0 => {
            refuse(format!("an error of {} %", 100.0 * error), "must be above 0 % and below 100 %")
        }
        _ if !positive(options.minutes) => {
            refuse(format!("a calibration of {} minutes", options.minutes), "must be a number above 0")
        }
        _ => Ok(()),
    }
}

/// The candidates as far as they were tried.
struct Trials<'a> {
    bench: &'a Bench<'a>,
    reference: &'a Reference,
    demand: Demand,
    done: Vec<Candidate>,
}

impl Trials<'_> {
    /// Tries candidates, cheapest first, for about `limit_s` seconds; the scene's own whatever it takes.
    fn run(&mut self, own: Setting, limit_s: f64, clock: &mut Clock<'_>) -> Result<(), Error> {
        let model = clock.stage("cost of a substep", 0, |_| self.bench.model())?;
        let finest = self.reference.told.substeps.last().copied().unwrap_or(1) / 2;
        let most_ms = match self.demand {
            Demand::BudgetMs(ms) => OVER_BUDGET * ms,
            Demand::Default | Demand::Error(_) => f64::INFINITY,
        };
        let frames = f64::from(self.bench.frames);
        let (mut left_s, mut errors) = (limit_s, Vec::new());
        for setting in setting::candidates(own, finest, most_ms, &model) {
            let expected_ms = model.frame_ms(setting);
            let mut candidate = Candidate { own: setting == own, ..Candidate::planned(setting, expected_ms) };
            let expected_s = 1e-3 * expected_ms * frames;
            let why_not = self.not_needed(&candidate).or_else(|| {
                let late = expected_s > left_s && !candidate.own;
                late.then(|| "not run, no time left (--minutes)".to_owned())
            });
            if let Some(why) = why_not {
                candidate.abandoned = Some(why);
                self.done.push(candidate);
                continue;
            }
            let run = clock.stage(&format!("try {setting}"), self.bench.frames.into(), |progress| {
                self.bench.run(setting, progress, |run| self.verdict(&mut candidate, run, &errors))
            });
            // What explodes is a finding about the setting, unless it is the scene's own.
            match run {
                Ok(run) => {
                    left_s -= 1e-3 * run.ms_per_frame * frames * run.fields.len() as f64
                        / self.bench.moments().len() as f64;
                    errors.push((run.ms_per_frame, self.errors(&run)));
                    self.enter(&mut candidate, &run);
                }
                Err(Error::Solver(error @ cutis_solver::SolverError::NotFinite { .. })) => {
                    candidate.abandoned = Some(format!("failed: {error}"));
                }
                Err(error) => return Err(error),
            }
            self.done.push(candidate);
        }
        Ok(())
    }

    /// Error at each moment that a run reached.
    fn errors(&self, run: &Run) -> Vec<f64> {
        let error =
            |(found, reference): (&field::Field, &field::Field)| found.rms_to(reference) / reference.rms();
        run.fields.iter().zip(&self.reference.fields).map(error).collect()
    }

    /// Why a candidate need not be run, if one that is much cheaper meets the demand.
    fn not_needed(&self, candidate: &Candidate) -> Option<String> {
        let demanded = self.demand.error().filter(|_| !candidate.own)?;
        let meets = |done: &&Candidate| done.error.is_some_and(|e| e + self.reference.told.error <= demanded);
        let cheapest =
            self.done.iter().filter(meets).min_by(|a, b| a.expected_ms.total_cmp(&b.expected_ms))?;
        (candidate.expected_ms > DEARER * cheapest.expected_ms)
            .then(|| format!("not run, {} meets the demand for less", cheapest.setting))
    }

    /// Whether a candidate that is under way goes on.
    fn verdict(&self, candidate: &mut Candidate, run: &Run, others: &[(f64, Vec<f64>)]) -> ControlFlow<()> {
        if candidate.own {
            return ControlFlow::Continue(());
        }
        let errors = self.errors(run);
        let moment = errors.len() - 1;
        let share = format!("{} of {} frames", self.bench.moments()[moment], self.bench.frames);
        let over = match self.demand {
            Demand::BudgetMs(ms) => run.ms_per_frame > OVER_BUDGET * ms,
            Demand::Default | Demand::Error(_) => false,
        };
        let nearer = others.iter().any(|(ms, other)| {
            *ms <= run.ms_per_frame && other.get(moment).is_some_and(|e| *e < MUCH_NEARER * errors[moment])
        });
        if over {
            candidate.abandoned = Some(format!("given up after {share}: over the budget"));
        } else if nearer {
            candidate.abandoned = Some(format!(
                "given up after {share}: {:.1} % off by then, and a cheaper one much less",
                100.0 * errors[moment]
            ));
        }
        if over || nearer { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Enters what a run found.
    fn enter(&self, candidate: &mut Candidate, run: &Run) {
        candidate.ms_per_frame = Some(run.ms_per_frame);
        if !run.finished() {
            return;
        }
        candidate.error = self.errors(run).last().copied();
        candidate.wounds = run
            .growths_mm
            .iter()
            .zip(&self.reference.told.growths_mm)
            .map(|(&growth_mm, &expected_mm)| WoundError::of(growth_mm, expected_mm))
            .collect();
    }
}

impl Candidate {
    /// A candidate that was not run yet.
    fn planned(setting: Setting, expected_ms: f64) -> Self {
        Self {
            setting,
            expected_ms,
            ms_per_frame: None,
            error: None,
            wounds: Vec::new(),
            pareto: false,
            own: false,
            abandoned: None,
        }
    }
}

fn warnings(reference: &Reference, picked: Option<&Candidate>) -> Vec<String> {
    let told = &reference.told;
    let mut lines = Vec::new();
    if told.order.is_none() {
        lines.push(format!(
            "the reference shows no limit yet: its last two runs differ by {:.1} %; --minutes allows finer ones",
            100.0 * told.error
        ));
    }
    let error = picked.and_then(|picked| picked.error);
    if let Some(error) = error.filter(|error| *error < TOLD_APART * told.error) {
        lines.push(format!(
            "the error of the picked setting, {:.2} %, is not much larger than what the reference may be off by, {:.2} %; \
             --minutes allows a finer one",
            100.0 * error,
            100.0 * told.error
        ));
    }
    lines
}

/// Says so if the machine was not as busy when a setting was run again.
fn unsteady(picked: &Candidate, again_ms: f64) -> Option<String> {
    let first_ms = picked.ms_per_frame?;
    ((again_ms / first_ms - 1.0).abs() > STEADY).then(|| {
        format!(
            "the machine was not equally busy all the time: a frame of the picked setting took {first_ms:.1} ms, and \
             {again_ms:.1} ms when it was run again; the times are no better than that"
        )
    })
}

impl WoundError {
    fn of(growth_mm: f64, expected_mm: f64) -> Self {
        let difference_mm = growth_mm - expected_mm;
        Self { growth_mm, difference_mm, difference_percent: 100.0 * difference_mm / expected_mm.abs() }
    }
}

impl Tuning {
    /// What is promised of a setting, in a line.
    fn promise(&self, picked: &Candidate) -> String {
        let percent = |share: Option<f64>| 100.0 * share.unwrap_or(f64::NAN);
        let processor = match &self.backend.adapter {
            Some(adapter) => adapter.clone(),
            None => format!("{}, {} threads", self.machine.cpu, self.backend.threads),
        };
        format!(
            "Tuned by cutis {}: error {:.2} % (reference within {:.2} %), {:.1} ms per frame on {} ({processor}).",
            self.cutis_version,
            percent(picked.error),
            100.0 * self.reference.error,
            picked.ms_per_frame.unwrap_or(f64::NAN),
            self.backend.name,
        )
    }

    /// The error of a calibration in which no setting meets the demand.
    pub fn unmet(&self) -> Option<Error> {
        let measured = |candidate: &&Candidate| candidate.error.is_some();
        let best = self
            .candidates
            .iter()
            .filter(measured)
            .min_by(|a, b| a.error.unwrap_or(f64::INFINITY).total_cmp(&b.error.unwrap_or(f64::INFINITY)));
        let nearest = best.map_or("none was measured to the end".into(), |best| {
            format!(
                "the nearest of those measured, {}, has an error of {:.2} % and takes {:.1} ms per frame",
                best.setting,
                100.0 * best.error.unwrap_or(f64::NAN),
                best.ms_per_frame.unwrap_or(f64::NAN)
            )
        });
        self.picked.is_none().then(|| Error::NoSetting { demand: self.demand.to_string(), nearest })
    }

    /// JSON schema of a calibration.
    pub fn json_schema() -> serde_json::Value {
        schemars::schema_for!(Tuning).to_value()
    }
}
