//! `cutis tune`: which setting a scene needs on this machine, measured; and what of it can be left out.
//!
//! A calibration runs the scene to its end, again and again on one prepared body. First a reference in double precision
//! (`reference`), with an estimate of its own error; then candidate settings, cheapest first, on the scene's backend, each timed
//! and compared with the reference. A candidate is given up a quarter or half of the way when a cheaper one of the same formulation
//! is much nearer to the reference already, or when it is over the budget. What is promised of the chosen setting was measured on a
//! whole run of it, so that a run of the scene repeats it: its displacements bit for bit, its time as far as the machine
//! is as busy as it was.

mod bench;
mod choose;
mod copy;
mod document;
mod field;
mod leave_out;
mod reference;
mod sample;
mod scratch;
mod setting;
mod trials;

use std::ops::ControlFlow;
use std::path::PathBuf;

use crate::backend::Request;
use crate::clock::Clock;
use crate::dynamics::{self, Dynamics};
use crate::plan::{self, Prepared};
use crate::report::Machine;
use crate::scene::{FormulationChoice, LoadedScene};
use crate::system::needs_system;
use crate::{CostReport, Error, Progress};

use bench::Bench;
pub use choose::Demand;
use copy::Copy;
pub use document::{Candidate, SCHEMA, Tuning, WoundError};
pub use leave_out::Omission;
use leave_out::Whole;
use reference::Reference;
pub use reference::ReferenceReport;
pub use setting::Setting;
use trials::Trials;

/// Share of the time of a calibration that the reference may take.
const REFERENCE_SHARE: f64 = 0.6;
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

/// Measures which setting a scene needs on this machine, and writes a copy of the scene with it.
///
/// # Errors
/// [`Error::SceneKey`] and [`Error::Request`] for what cannot be tuned; others as a run of the scene would give them. That no
/// setting meets the demand is none: see [`Tuning::unmet`].
pub fn tune(loaded: &LoadedScene, options: &TuneOptions, progress: &dyn Progress) -> Result<Tuning, Error> {
    needs_system(loaded)?;
    check(loaded, options)?;
    let copy = Copy::to(&options.out, options.overwrite, loaded)?;
    let mut clock = Clock::new(progress);
    let Prepared { source, body, backend, plan, .. } =
        plan::prepare(loaded, Request::of(loaded)?, &mut clock)?;
    // With the colors of the vertices, which every formulation but one passes by.
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
    let picked = options.demand.choose(&candidates, place, &reference.told);
    let picked = picked.map(|place| candidates[place].clone());
    let mut tuning = Tuning {
        schema: SCHEMA.into(),
        cutis_version: env!("CARGO_PKG_VERSION").into(),
        machine: Machine::here(),
        backend: plan.backend,
        frames: bench.frames,
        demand: options.demand,
        warnings: warnings(&reference, picked.as_ref(), own),
        reference: reference.told,
        candidates,
        picked,
        scene_file: None,
        costs: CostReport { time: "no setting was picked".into(), ..CostReport::default() },
        omissions: Vec::new(),
        stages: Vec::new(),
    };
    if tuning.picked.is_some() {
        let needed = tuning.needed().map(|needed| format!("the picked setting is not that near: {needed}"));
        tuning.warnings.extend(needed);
    }
    if let Some(picked) = &tuning.picked {
        let times = clock.stage("parts of a frame", 0, |_| bench.profile(picked.setting))?;
        let how = "one frame of the picked setting, part by part";
        tuning.costs = bench.bytes(picked.setting)?.with_times(&times, 1.0, how);
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
            tuning.omissions = whole.omissions(limit_s, &mut clock);
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

fn warnings(reference: &Reference, picked: Option<&Candidate>, own: Setting) -> Vec<String> {
    let told = &reference.told;
    let mut lines = Vec::new();
    lines.extend(told.coarse(own));
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
