//! Stability: stiff and extreme cases on every backend and at several length scales, each with a
//! requirement.
//!
//! A trial ends `settled` (back at the rest shape, or at rest), `bounded` (all numbers finite, no
//! energy created), `named` (a typed error names an element that cannot act), `refused` (a typed
//! error refuses the input), or `FAILED`.

pub mod body;
pub mod case;
pub mod cases;
pub mod energy;
pub mod input_validation;
pub mod membrane;
mod options;
pub mod run;
pub mod settle;
mod tables;
mod trial;

use std::io::Write;

use anyhow::ensure;
use cutis_gpu::{Adapter, Gpu, GpuError, GpuOptions, Select};
use cutis_solver::{Settings, Solver, SolverReference, System};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;

pub use options::{BackendName, Effort, Options};
pub use trial::{Outcome, Trial};

pub use crate::kit::Failure;
use crate::kit::{Page, Provenance, results, write_json};
use case::Case;

/// The length scales.
pub const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];
/// Tables of the page.
pub const TABLES: [&str; 9] = [
    "provenance",
    "backends",
    "formulations",
    "worst",
    "known",
    "refused",
    "rest-provenance",
    "rest",
    "rest-named",
];
/// Cases in the table of the worst ones.
const WORST: usize = 12;

/// Runs the cases and prints a line per trial to `out`. Returns whether every trial met its
/// requirement, except those of known failures.
///
/// # Errors
/// There is no adapter, unless the options allow that or do not ask for a GPU. A file cannot be
/// written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    if options.rest {
        return search(options, out);
    }
    let page =
        (options.write || options.out.is_some()).then(|| Page::open("stability", &TABLES)).transpose()?;
    let mut provenance = Provenance::start(&options.command());
    let wanted = |name: &str| options.case.as_ref().is_none_or(|part| name.contains(part.as_str()));
    let mut cases = cases::all(options.effort());
    cases.retain(|case| wanted(&case.name));
    let scales: Vec<f64> = options.scale.map_or(SCALES.to_vec(), |scale| vec![scale]);
    let mut trials = Vec::new();
    let mut add = |trial: Trial| {
        writeln!(out, "{}", tables::line(&trial))?;
        trials.push(trial);
        Ok(())
    };
    if options.case.is_none() {
        input_validation::all().into_iter().try_for_each(&mut add)?;
    }
    if options.wants(BackendName::Reference) {
        run_reference(&cases, &scales, &mut add)?;
    }
    if options.wants(BackendName::Cpu) {
        run_cpu(&cases, &scales, &mut add)?;
    }
    if options.wants(BackendName::Gpu) {
        for adapter in adapters(options)? {
            let select = Select::Index(adapter.index);
            let gpu = Gpu::open(&GpuOptions { select, ..GpuOptions::default() })?;
            provenance.adapter(&adapter.name);
            run_gpu(&gpu, &format!("gpu f32, {}", adapter.name), &cases, &scales, &mut add)?;
        }
    }
    let failed = tables::failures(&trials);
    let known = trials.iter().filter(|trial| !trial.outcome.is_good()).count() - failed;
    writeln!(out, "\n{} rows, {failed} failed, {known} failed as known", trials.len())?;
    ensure!(!trials.is_empty(), "no case was run");
    if let Some(path) = &options.json {
        let passed = failed == 0;
        write_json(path, &serde_json::json!({ "provenance": provenance, "rows": trials, "passed": passed }))?;
    }
    if let Some(mut page) = page {
        let backend = |trial: &Trial| trial.scale.map(|_| trial.backend.clone());
        page.set("provenance", &provenance.markdown())?;
        page.set("backends", &tables::summary(&trials, "backend", backend).markdown())?;
        page.set("formulations", &tables::summary(&trials, "formulation", tables::formulation).markdown())?;
        page.set("worst", &tables::worst(&trials, WORST).markdown())?;
        page.set("known", &tables::known_failures(&trials).markdown())?;
        page.set("refused", &tables::refused(&trials).markdown())?;
        page.save(&options.out.clone().unwrap_or_else(results))?;
    }
    Ok(failed == 0)
}

/// Searches for the states of rest. Returns whether every trial met its requirement.
fn search(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("stability", &TABLES)).transpose()?;
    let provenance = Provenance::start(&options.command());
    let mut cases = cases::all(options.effort());
    cases.retain(|case| options.case.as_ref().is_none_or(|part| case.name.contains(part.as_str())));
    let scales: Vec<f64> = options.scale.map_or(SCALES.to_vec(), |scale| vec![scale]);
    let mut trials = Vec::new();
    run_rest(&cases, &scales, &mut |trial: Trial| {
        writeln!(out, "{}", tables::line(&trial))?;
        trials.push(trial);
        Ok(())
    })?;
    ensure!(!trials.is_empty(), "no case was run");
    let failed = tables::failures(&trials);
    writeln!(out, "\n{} rows, {failed} failed", trials.len())?;
    if let Some(mut page) = page.filter(|_| failed == 0) {
        let scale = |trial: &Trial| trial.scale.map(|scale| format!("{scale:e}"));
        page.set("rest-provenance", &provenance.markdown())?;
        page.set("rest", &tables::ends(&trials, scale).markdown())?;
        page.set("rest-named", &tables::named(&trials).markdown())?;
        page.save(&results())?;
    }
    Ok(failed == 0)
}

/// Receives a finished trial.
pub type Sink<'a> = &'a mut dyn FnMut(Trial) -> Result<(), Failure>;

/// Runs the cases on the scalar reference in double precision.
///
/// # Errors
/// `sink` fails.
pub fn run_reference(cases: &[Case], scales: &[f64], sink: Sink<'_>) -> Result<(), Failure> {
    let make = |system: System<f64>, settings: Settings| -> Result<Box<dyn Solver<f64>>, Failure> {
        Ok(Box::new(SolverReference::new(system, settings)?))
    };
    each(cases, scales, sink, |case, scale| run::run(case, scale, "reference f64", &make))
}

/// Runs the cases on the CPU backend in single precision.
///
/// # Errors
/// `sink` fails.
pub fn run_cpu(cases: &[Case], scales: &[f64], sink: Sink<'_>) -> Result<(), Failure> {
    let make = |system: System<f32>, settings: Settings| -> Result<Box<dyn Solver<f32>>, Failure> {
        Ok(Box::new(SolverCpu::new(system, settings, Some(1))?))
    };
    each(cases, scales, sink, |case, scale| run::run(case, scale, "cpu f32", &make))
}

/// Searches for the states of rest of the bodies that vertex block descent moves in the cases.
///
/// # Errors
/// `sink` fails.
pub fn run_rest(cases: &[Case], scales: &[f64], sink: Sink<'_>) -> Result<(), Failure> {
    for case in cases {
        for &scale in scales {
            if let Some(trial) = settle::run(case, scale) {
                sink(trial)?;
            }
        }
    }
    Ok(())
}

/// Runs the cases on a GPU.
///
/// # Errors
/// `sink` fails.
pub fn run_gpu(gpu: &Gpu, name: &str, cases: &[Case], scales: &[f64], sink: Sink<'_>) -> Result<(), Failure> {
    let make = |system: System<f32>, settings: Settings| -> Result<Box<dyn Solver<f32>>, Failure> {
        Ok(Box::new(SolverGpu::new(gpu, system, settings)?))
    };
    each(cases, scales, sink, |case, scale| run::run(case, scale, name, &make))
}

fn each(
    cases: &[Case],
    scales: &[f64],
    sink: Sink<'_>,
    run: impl Fn(&Case, f64) -> Trial,
) -> Result<(), Failure> {
    for case in cases {
        for &scale in scales {
            sink(run(case, scale))?;
        }
    }
    Ok(())
}

fn adapters(options: &Options) -> Result<Vec<Adapter>, GpuError> {
    let all = cutis_gpu::adapters();
    match &options.adapter {
        Some(select) => Ok(vec![select.among(&all)?.clone()]),
        None if all.is_empty() && !options.allow_no_gpu => Err(GpuError::NoAdapter),
        None => Ok(all),
    }
}
