//! `cutis tune`: finds the solver settings that a scene needs on this machine, and measures what
//! each part of the scene costs.
//!
//! Tuning builds the body once and runs the scene to its end many times:
//!
//! 1. a reference in double precision, with an estimate of its own error (`reference`);
//! 2. candidate settings on the scene's backend, cheapest first. Each run is timed and compared
//!    with the reference (`trials`). A candidate is abandoned after a quarter or half of its frames
//!    if a cheaper one of the same formulation is much more accurate at that point, or if it is
//!    over budget;
//! 3. the state of rest, which a search finds without frames (`at_rest`);
//! 4. regions of interest around the action, with the picked setting, until one has the opening of
//!    the whole body (`region`);
//! 5. the scene without each of its parts, with the picked setting (`ablation`).
//!
//! The error and the time of the picked setting and region come from complete runs. A run of the
//! tuned scene has the same displacements bit for bit. Its time differs if the machine is busier.

mod ablation;
mod at_rest;
mod baseline;
mod bench;
mod choose;
mod copy;
mod document;
mod field;
mod reference;
mod region;
mod sample;
mod scratch;
mod setting;
mod trials;

use std::ops::ControlFlow;
use std::path::PathBuf;

use cutis_solver::Formulation;

use crate::backend::Request;
use crate::model::ModelInput;
use crate::model::constraints::ConstraintModel;
use crate::model::needs_system;
use crate::report::Machine;
use crate::run::clock::Clock;
use crate::run::prepare::{Prepared, prepare};
use crate::scene::{LoadedScene, RegionSection, WholeBody};
use crate::{CostReport, Error, Progress};

pub use ablation::Omission;
pub use at_rest::RestTrial;
use baseline::Baseline;
use bench::Bench;
pub use choose::Demand;
use copy::SceneCopy;
pub use document::{Candidate, SCHEMA, Tuning, WoundError};
use reference::Reference;
pub use reference::ReferenceReport;
pub use region::RegionTrial;
pub use setting::Setting;
use trials::Trials;

/// Largest share of the tuning time for the reference.
const REFERENCE_SHARE: f64 = 0.6;
/// An error is reliable if it exceeds the uncertainty of the reference by this factor.
const RELIABLE: f64 = 4.0;
/// Relative difference between two times of one setting above which the machine was unevenly busy.
const STEADY: f64 = 0.2;

/// How to tune a scene.
#[derive(Clone, Debug)]
pub struct TuneOptions {
    /// Target for the setting.
    pub demand: Demand,
    /// Path of the tuned copy of the scene.
    pub out: PathBuf,
    /// Overwrite an existing file.
    pub overwrite: bool,
    /// Time limit for picking a setting, again for the regions, and again for the ablation,
    /// minutes. A run that has started is finished, so the total can be longer.
    pub minutes: f64,
    /// Pick a region of interest.
    pub region: bool,
    /// Measure the scene without each of its parts.
    pub omissions: bool,
}

/// Finds the solver settings that a scene needs on this machine, and writes a copy of the scene
/// with them.
///
/// # Errors
/// [`Error::SceneKey`] and [`Error::Request`] for scenes and options that cannot be tuned, and the
/// errors of a run. It is not an error if no setting meets the target: see [`Tuning::unmet`].
pub fn tune(loaded: &LoadedScene, options: &TuneOptions, progress: &dyn Progress) -> Result<Tuning, Error> {
    needs_system(loaded)?;
    check(loaded, options)?;
    let loaded = &on_whole_body(loaded);
    let copy = SceneCopy::to(&options.out, options.overwrite, loaded)?;
    let mut clock = Clock::new(progress);
    let Prepared { source, body, backend, plan, .. } = prepare(loaded, Request::of(loaded)?, &mut clock)?;
    // Vertex block descent also needs vertex colors; the other formulations ignore them.
    let ConstraintModel { system, settings, .. } =
        clock.stage("constraints of all formulations", 0, |_| {
            let mut all = loaded.clone();
            all.scene.solver.formulation = Formulation::Vbd;
            let input = ModelInput { file: all.file(), scene: &all.scene, body: &body };
            Ok(ConstraintModel::build(&input)?.unchanging()?)
        })?;
    let backend = backend.kept_open()?;
    plan.warnings.iter().for_each(|warning| progress.note(warning));
    let bench = Bench::new(&system, settings, &body.cut.gapes, &backend, loaded.scene.run.frames);
    let own = Setting::of(&loaded.scene.solver);
    let limit_s = 60.0 * options.minutes;
    let reference =
        reference::run(&bench, own, options.demand.reference_error(), REFERENCE_SHARE * limit_s, &mut clock)
            .map_err(loaded.file().blame("run"))?;
    let mut trials =
        Trials { bench: &bench, reference: &reference, demand: options.demand, done: Vec::new() };
    trials.run(own, limit_s - reference.report.seconds, &mut clock)?;
    let rest =
        clock.stage("search for rest", 0, |_| Ok(RestTrial::run(&bench, &loaded.scene, &reference)))?;
    let mut candidates = trials.done;
    choose::mark_front(&mut candidates);
    let place = candidates.iter().position(|candidate| candidate.own).unwrap_or(0);
    let picked = options.demand.choose(&candidates, place, &reference.report);
    let picked = picked.map(|place| candidates[place].clone());
    let mut tuning = Tuning {
        schema: SCHEMA.into(),
        cutis_version: env!("CARGO_PKG_VERSION").into(),
        machine: Machine::here(),
        backend: plan.backend,
        frames: bench.frames,
        demand: options.demand,
        warnings: warnings(&reference, picked.as_ref(), own),
        reference: reference.report,
        candidates,
        picked,
        rest,
        scene_file: None,
        costs: CostReport { time: "no setting was picked".into(), ..CostReport::default() },
        regions: Vec::new(),
        omissions: Vec::new(),
        stages: Vec::new(),
    };
    if tuning.picked.is_some() {
        let needed = tuning.needed().map(|needed| format!("the picked setting misses the target: {needed}"));
        tuning.warnings.extend(needed);
    }
    let frames_ms = tuning.picked.as_ref().and_then(|picked| picked.ms_per_frame);
    let frames_ms = frames_ms.map_or(0.0, |ms| ms * f64::from(tuning.frames));
    tuning.warnings.extend(tuning.rest.advice(options.demand.region_error(), frames_ms));
    if let Some(picked) = &tuning.picked {
        let times = clock.stage("parts of a frame", 0, |_| bench.profile(picked.setting))?;
        let how = "one frame of the picked setting, each part timed separately";
        tuning.costs = bench.bytes(picked.setting)?.with_times(&times, 1.0, how);
        let setting = picked.setting;
        let baseline = if options.region || options.omissions {
            let run = clock.stage(&format!("{setting} again"), bench.frames.into(), |progress| {
                bench.run(setting, progress, |_| ControlFlow::Continue(()))
            })?;
            tuning.warnings.extend(unsteady(picked, run.ms_per_frame));
            Some(Baseline { loaded, source: &source, body: &body, bench: &bench, setting, run })
        } else {
            None
        };
        let most = options.demand.region_error();
        if let Some(baseline) = baseline.as_ref().filter(|_| options.region) {
            tuning.regions = baseline.regions(most, limit_s, &mut clock);
        }
        let mut scene = loaded.scene.clone();
        scene.solver = setting.applied_to(&scene.solver);
        let mut promises = vec![tuning.promise(picked)];
        if let Some(region) = tuning.region() {
            scene.lattice = region.applied_to(&scene.lattice);
            promises.push(region.promise());
        } else if !tuning.regions.is_empty() {
            let note = format!("no region has an opening within {} % of the whole body", 100.0 * most);
            tuning.warnings.push(note);
        }
        clock.stage("write the scene", 0, |_| copy.write(&scene, &promises))?;
        tuning.scene_file = Some(options.out.clone());
        if let Some(baseline) = baseline.filter(|_| options.omissions) {
            tuning.omissions = baseline.omissions(limit_s, &mut clock);
        }
    }
    tuning.stages = clock.stages;
    Ok(tuning)
}

/// The scene on the whole body if the program picked its region, so that regions are compared with
/// that.
fn on_whole_body(loaded: &LoadedScene) -> LoadedScene {
    let mut loaded = loaded.clone();
    let region = &mut loaded.scene.lattice.region;
    if region.as_ref().is_some_and(|region| region.picked().is_some()) {
        *region = Some(RegionSection::Whole(WholeBody::Whole));
    }
    loaded
}

/// Refuses scenes and options that cannot be tuned.
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
    if scene.solver.formulation == Formulation::Pbd {
        let why = "cannot be tuned: with \"pbd\" the stiffness depends on substeps and iterations, so finer settings do \
                   not converge to one solution; use \"xpbd\" or \"vbd\"";
        return key("solver.formulation", "\"pbd\"", why);
    }
    if scene.run.frames == 0 {
        return key(
            "run.frames",
            "0",
            "must be 1 or more to be tuned: the error is measured at the last frame",
        );
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
            refuse(format!("a time limit of {} minutes", options.minutes), "must be a number above 0")
        }
        _ => Ok(()),
    }
}

fn warnings(reference: &Reference, picked: Option<&Candidate>, own: Setting) -> Vec<String> {
    let report = &reference.report;
    let mut lines = Vec::new();
    lines.extend(report.coarse(own));
    if report.order.is_none() {
        lines.push(format!(
            "the reference has not converged: its last two runs differ by {:.1} %; a larger --minutes allows finer runs",
            100.0 * report.error
        ));
    }
    let error = picked.and_then(|picked| picked.error);
    if let Some(error) = error.filter(|error| *error < RELIABLE * report.error) {
        lines.push(format!(
            "the error of the picked setting, {:.2} %, is close to the uncertainty of the reference, {:.2} %; \
             a larger --minutes allows a finer reference",
            100.0 * error,
            100.0 * report.error
        ));
    }
    lines
}

/// A warning if a second run of the picked setting took a different time.
fn unsteady(picked: &Candidate, again_ms: f64) -> Option<String> {
    let first_ms = picked.ms_per_frame?;
    ((again_ms / first_ms - 1.0).abs() > STEADY).then(|| {
        format!(
            "the load of the machine changed: a frame of the picked setting took {first_ms:.1} ms, and {again_ms:.1} ms \
             in a second run; take all times with that uncertainty"
        )
    })
}
