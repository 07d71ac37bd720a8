//! Stability: stiff and extreme cases on every backend and at several length scales, each with what must hold at its end.
//!
//! A case ends `settled` (back at its rest shape, or at rest), `bounded` (finite, and no energy out of nothing), `named` (an
//! element that cannot act is named by a typed error), `refused` (at the door, by a typed error), or `FAILED`.

pub mod body;
pub mod case;
pub mod cases;
pub mod doors;
pub mod energy;
mod options;
mod outcome;
mod page;
mod table;
pub mod trial;

use std::io::Write;

use cutis_gpu::{Adapter, Gpu, GpuError, GpuOptions, Select};
use cutis_solver::{Settings, Solver, SolverReference, System};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;

pub use options::{BackendName, Effort, Options};
pub use outcome::{Outcome, Row};

use case::Case;

/// What keeps the suite from being run.
pub type Failure = Box<dyn std::error::Error>;

/// The length scales.
pub const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];

/// Runs what is asked for, prints a line per case to `out`; whether every row ended as it must.
///
/// # Errors
/// No adapter, unless that is allowed or the GPU is not asked for; the terminal's and the files'.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let wanted = |name: &str| options.case.as_ref().is_none_or(|part| name.contains(part.as_str()));
    let mut cases = cases::all(options.effort());
    cases.retain(|case| wanted(&case.name));
    let scales: Vec<f64> = options.scale.map_or(SCALES.to_vec(), |scale| vec![scale]);
    let mut table = table::Table::new(out);
    if options.case.is_none() {
        doors::all().into_iter().try_for_each(|row| table.add(row))?;
    }
    if options.wants(BackendName::Reference) {
        run_reference(&cases, &scales, &mut |row| table.add(row))?;
    }
    if options.wants(BackendName::Cpu) {
        run_cpu(&cases, &scales, &mut |row| table.add(row))?;
    }
    if options.wants(BackendName::Gpu) {
        for adapter in adapters(options)? {
            let select = Select::Index(adapter.index);
            let gpu = Gpu::open(&GpuOptions { select, ..GpuOptions::default() })?;
            let name = format!("gpu f32, {}", adapter.name);
            run_gpu(&gpu, &name, &cases, &scales, &mut |row| table.add(row))?;
        }
    }
    table.finish(options)
}

/// Where a finished row goes.
pub type Sink<'a> = &'a mut dyn FnMut(Row) -> Result<(), Failure>;

/// On the scalar reference in double precision.
///
/// # Errors
/// Of `sink`.
pub fn run_reference(cases: &[Case], scales: &[f64], sink: Sink<'_>) -> Result<(), Failure> {
    let make = |system: System<f64>, settings: Settings| -> Result<Box<dyn Solver<f64>>, Failure> {
        Ok(Box::new(SolverReference::new(system, settings)?))
    };
    each(cases, scales, sink, |case, scale| trial::run(case, scale, "reference f64", &make))
}

/// On the CPU backend in single precision.
///
/// # Errors
/// Of `sink`.
pub fn run_cpu(cases: &[Case], scales: &[f64], sink: Sink<'_>) -> Result<(), Failure> {
    let make = |system: System<f32>, settings: Settings| -> Result<Box<dyn Solver<f32>>, Failure> {
        Ok(Box::new(SolverCpu::new(system, settings, Some(1))?))
    };
    each(cases, scales, sink, |case, scale| trial::run(case, scale, "cpu f32", &make))
}

/// On a GPU.
///
/// # Errors
/// Of `sink`.
pub fn run_gpu(gpu: &Gpu, name: &str, cases: &[Case], scales: &[f64], sink: Sink<'_>) -> Result<(), Failure> {
    let make = |system: System<f32>, settings: Settings| -> Result<Box<dyn Solver<f32>>, Failure> {
        Ok(Box::new(SolverGpu::new(gpu, system, settings)?))
    };
    each(cases, scales, sink, |case, scale| trial::run(case, scale, name, &make))
}

fn each(
    cases: &[Case],
    scales: &[f64],
    sink: Sink<'_>,
    run: impl Fn(&Case, f64) -> Row,
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
