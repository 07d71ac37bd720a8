//! Everything that the independent FEM needs, and what it is compared with, as one JSON file.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::PathBuf;

use clap::Parser;
use cutis::report::Machine;
use cutis_gpu::{Gpu, GpuError, GpuOptions};
use cutis_solver::{Formulation, Solver};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;
use serde::Serialize;

use super::settle::slowest_per_s;
use super::{Beam, Case, Failure, GRAVITY_M_S2, Material, Rest, Way, converged, real_time, settle};

/// Short substeps, in the time that a wave takes across a cell, and their iterations.
const SHORT: (f64, u32) = (0.5, 5);
/// The same on every day, and for the fine mesh.
const QUICK: (f64, u32) = (1.0, 5);
/// The same in single precision, which cannot resolve what gravity does in so short a time.
const SINGLE: (f64, u32) = (2.0, 30);
/// Share of its displacement by which a beam at rest may move in a frame, in double and in single precision.
const STILL: (f64, f64) = (1e-6, 1e-4);
/// Most work in real time (substeps × iterations), but for the coarse beam that sinks by a tenth.
const MOST_SWEEPS: u32 = 50;

/// What `cantilever` is asked for.
#[derive(Clone, Debug, Parser)]
#[command(name = "cantilever")]
pub struct Options {
    /// Only what every change must pass: the coarse beam, no settings of real time, no GPU.
    #[arg(long)]
    pub quick: bool,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// The file: see the fields.
#[derive(Serialize)]
pub struct Document {
    schema: &'static str,
    cutis_version: &'static str,
    machine: Machine,
    gpu: Option<String>,
    gravity_m_s2: [f64; 3],
    /// Each mesh once, by its refinement.
    beams: BTreeMap<usize, Beam>,
    cases: Vec<Answers>,
}

/// What is found for a case.
#[derive(Serialize)]
struct Answers {
    #[serde(flatten)]
    case: Case,
    /// At rest, in m, by Newton's method.
    positions: Vec<[f64; 3]>,
    newton: Newton,
    /// Runs of the solver with short substeps.
    converged: Vec<Run>,
    /// Runs of the solver in real time.
    real_time: Vec<Run>,
    /// Newton's method with something wrong on purpose, by what that is: displacement of the end.
    controls: BTreeMap<&'static str, [f64; 3]>,
}

#[derive(Serialize)]
struct Newton {
    /// Mean displacement of the end, in lengths of the beam.
    displacement: [f64; 3],
    gradient: f64,
    iterations: usize,
    energy_j: f64,
}

/// A run of the solver.
#[derive(Serialize)]
struct Run {
    backend: &'static str,
    precision: &'static str,
    way: Way,
    /// Where it ended, or none if its numbers exploded.
    rest: Option<Rest>,
    error: Option<String>,
}

impl Document {
    /// Solves every case in every way that is asked for.
    ///
    /// # Errors
    /// Newton's method does not converge; a device is there and fails.
    pub fn new(options: &Options) -> Result<Self, Failure> {
        let gpu = if options.quick { None } else { device()? };
        let (mut beams, mut cases) = (BTreeMap::new(), Vec::new());
        for case in Case::all(options.quick) {
            let beam = match beams.entry(case.refinement) {
                Entry::Occupied(made) => made.into_mut(),
                Entry::Vacant(place) => place.insert(Beam::new(case.cells(), case.refinement, 1.0)?),
            };
            eprintln!("{}", case.name);
            cases.push(Answers::of(case.clone(), beam, gpu.as_ref(), options.quick)?);
        }
        Ok(Self {
            schema: "cutis-cantilever/1",
            cutis_version: env!("CARGO_PKG_VERSION"),
            machine: Machine::here(),
            gpu: gpu.map(|gpu| format!("{} ({})", gpu.adapter().name, gpu.adapter().kind)),
            gravity_m_s2: GRAVITY_M_S2,
            beams,
            cases,
        })
    }
}

/// The first adapter, if there is one.
fn device() -> Result<Option<Gpu>, GpuError> {
    match Gpu::open(&GpuOptions::default()) {
        Ok(gpu) => Ok(Some(gpu)),
        Err(GpuError::NoAdapter) => Ok(None),
        Err(error) => Err(error),
    }
}

impl Answers {
    fn of(case: Case, beam: &Beam, gpu: Option<&Gpu>, quick: bool) -> Result<Self, Failure> {
        let minimum = beam.equilibrium(&case.material, GRAVITY_M_S2)?;
        let displacement = beam.end_displacement(&minimum.positions);
        let sag_m = -displacement.y * beam.length_m;
        let crossing_s = case.crossing_s(beam.length_m);
        let way = |(share, iterations)| converged(sag_m, share * crossing_s, iterations);
        let mut runs = Vec::new();
        if !quick || case.with_controls {
            runs.push(double(beam, &case.material, way(if quick { QUICK } else { SHORT }))?);
        }
        if !quick && case.refinement == 1 {
            runs.push(single_cpu(beam, &case.material, way(SINGLE))?);
        }
        if let Some(gpu) = gpu.filter(|_| case.with_controls) {
            runs.push(single_gpu(gpu, beam, &case.material, way(SINGLE))?);
        }
        let mut ways = if quick { Vec::new() } else { real_time(slowest_per_s(sag_m)) };
        ways.retain(|way| case.in_detail || way.substeps * way.iterations <= MOST_SWEEPS);
        let real_time = ways.into_iter().map(|way| single_cpu(beam, &case.material, way));
        Ok(Self {
            positions: minimum.positions.iter().map(|p| [p.x, p.y, p.z]).collect(),
            newton: Newton {
                displacement: displacement.into(),
                gradient: minimum.gradient,
                iterations: minimum.iterations,
                energy_j: minimum.energy_j,
            },
            converged: runs,
            real_time: real_time.collect::<Result<_, _>>()?,
            controls: if case.with_controls { controls(beam, &case.material)? } else { BTreeMap::new() },
            case,
        })
    }
}

/// The beam with something wrong: each must be told from the right one.
fn controls(beam: &Beam, right: &Material) -> Result<BTreeMap<&'static str, [f64; 3]>, Failure> {
    let softer = Material { bulk_pa: 0.5 * right.bulk_pa, ..*right };
    let lighter = GRAVITY_M_S2.map(|g| 0.98 * g);
    let end = |beam: &Beam, material: &Material, gravity| -> Result<[f64; 3], Failure> {
        let minimum = beam.equilibrium(material, gravity)?;
        Ok(beam.end_displacement(&minimum.positions).into())
    };
    Ok(BTreeMap::from([
        ("half of K", end(beam, &softer, GRAVITY_M_S2)?),
        ("98 % of gravity", end(beam, right, lighter)?),
        ("one tetrahedron without its volume", end(&beam.without_tet(0)?, right, GRAVITY_M_S2)?),
    ]))
}

/// A coarse beam's colors are too short to be shared.
fn threads(beam: &Beam) -> Option<usize> {
    if beam.positions.len() < 2000 { Some(1) } else { None }
}

fn double(beam: &Beam, material: &Material, way: Way) -> Result<Run, Failure> {
    let solver = SolverCpu::new(beam.system::<f64>(material, None)?, way.settings(), threads(beam))?;
    Ok(run("cpu", "f64", solver, beam, way, STILL.0))
}

fn single_cpu(beam: &Beam, material: &Material, way: Way) -> Result<Run, Failure> {
    let stiffness = (way.formulation == Formulation::Pbd).then_some(1.0);
    let solver = SolverCpu::new(beam.system::<f32>(material, stiffness)?, way.settings(), threads(beam))?;
    Ok(run("cpu", "f32", solver, beam, way, STILL.1))
}

fn single_gpu(gpu: &Gpu, beam: &Beam, material: &Material, way: Way) -> Result<Run, Failure> {
    let solver = SolverGpu::new(gpu, beam.system::<f32>(material, None)?, way.settings())?;
    Ok(run("gpu", "f32", solver, beam, way, STILL.1))
}

fn run<T: cutis_constraints::Scalar>(
    backend: &'static str,
    precision: &'static str,
    mut solver: impl Solver<T>,
    beam: &Beam,
    way: Way,
    still: f64,
) -> Run {
    let found = settle(&mut solver, beam, still, way.most_frames);
    let error = found.as_ref().err().map(ToString::to_string);
    Run { backend, precision, way, rest: found.ok(), error }
}
