//! The input of the independent FEM and the results of Cutis, as one JSON file.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use cutis::report::Machine;
use cutis_gpu::{Gpu, GpuError, GpuOptions};
use cutis_solver::{Formulation, Solver};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;
use serde::Serialize;

use super::settle::slowest_per_s;
use super::{Beam, BeamCase, Failure, GRAVITY_M_S2, Material, Rest, Stepping, converged, real_time, settle};

/// Length of a short substep over the time of a wave across a cell, and its iterations.
const SHORT: (f64, u32) = (0.5, 5);
/// The same for the quick cases.
const QUICK: (f64, u32) = (1.0, 5);
/// The same in single precision, which does not resolve the effect of gravity in a shorter time.
const SINGLE: (f64, u32) = (2.0, 30);
/// Largest motion of a beam at rest in a frame over its displacement, in double and in single
/// precision.
const STILL: (f64, f64) = (1e-6, 1e-4);
/// Largest number of sweeps (substeps × iterations) of a real-time setting, except for the coarse
/// beam that sags by 10 %.
const MOST_SWEEPS: u32 = 50;

/// The file.
#[derive(Serialize)]
pub struct Document {
    schema: &'static str,
    cutis_version: &'static str,
    machine: Machine,
    gpu: Option<String>,
    gravity_m_s2: [f64; 3],
    /// Each mesh once, by its refinement.
    beams: BTreeMap<usize, Beam>,
    cases: Vec<CaseResults>,
}

/// Results of a case.
#[derive(Serialize)]
struct CaseResults {
    #[serde(flatten)]
    case: BeamCase,
    /// Positions at rest in m, by Newton's method.
    positions: Vec<[f64; 3]>,
    newton: Newton,
    /// Runs of the solver with short substeps.
    converged: Vec<Run>,
    /// Runs of the solver with real-time settings.
    real_time: Vec<Run>,
    /// Displacement of the end by Newton's method with a deliberate fault, by the name of the
    /// fault.
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
    stepping: Stepping,
    /// The state at rest. `None` if the run diverged.
    rest: Option<Rest>,
    error: Option<String>,
}

impl Document {
    /// Solves every case. `quick` uses the cases of the tests.
    ///
    /// # Errors
    /// Newton's method does not converge, or a device fails.
    pub fn new(quick: bool) -> Result<Self, Failure> {
        let gpu = if quick { None } else { device()? };
        let (mut beams, mut cases) = (BTreeMap::new(), Vec::new());
        for case in BeamCase::all(quick) {
            let beam = match beams.entry(case.refinement) {
                Entry::Occupied(beam) => beam.into_mut(),
                Entry::Vacant(entry) => entry.insert(Beam::new(case.cells(), case.refinement, 1.0)?),
            };
            eprintln!("{}", case.name);
            cases.push(CaseResults::of(case.clone(), beam, gpu.as_ref(), quick)?);
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

/// The first adapter. `None` if there is no adapter.
fn device() -> Result<Option<Gpu>, GpuError> {
    match Gpu::open(&GpuOptions::default()) {
        Ok(gpu) => Ok(Some(gpu)),
        Err(GpuError::NoAdapter) => Ok(None),
        Err(error) => Err(error),
    }
}

impl CaseResults {
    fn of(case: BeamCase, beam: &Beam, gpu: Option<&Gpu>, quick: bool) -> Result<Self, Failure> {
        let minimum = beam.equilibrium(&case.material, GRAVITY_M_S2)?;
        let displacement = beam.end_displacement(&minimum.positions);
        let sag_m = -displacement.y * beam.length_m;
        let crossing_s = case.crossing_s(beam.length_m);
        let stepping = |(share, iterations)| converged(sag_m, share * crossing_s, iterations);
        let mut runs = Vec::new();
        if !quick || case.with_controls {
            runs.push(double(beam, &case.material, stepping(if quick { QUICK } else { SHORT }))?);
        }
        if !quick && case.refinement == 1 {
            runs.push(single_cpu(beam, &case.material, stepping(SINGLE))?);
        }
        if let Some(gpu) = gpu.filter(|_| case.with_controls) {
            runs.push(single_gpu(gpu, beam, &case.material, stepping(SINGLE))?);
        }
        let mut steppings = if quick { Vec::new() } else { real_time(slowest_per_s(sag_m)) };
        steppings.retain(|stepping| case.in_detail || stepping.substeps * stepping.iterations <= MOST_SWEEPS);
        let real_time = steppings.into_iter().map(|stepping| single_cpu(beam, &case.material, stepping));
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

/// The beam with a deliberate fault. The comparison must notice each of them.
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

/// One thread for the coarse beam, since its colors are too small to share.
fn threads(beam: &Beam) -> Option<usize> {
    if beam.positions.len() < 2000 { Some(1) } else { None }
}

fn double(beam: &Beam, material: &Material, stepping: Stepping) -> Result<Run, Failure> {
    let solver = SolverCpu::new(beam.system::<f64>(material, None)?, stepping.settings(), threads(beam))?;
    Ok(run("cpu", "f64", solver, beam, stepping, STILL.0))
}

fn single_cpu(beam: &Beam, material: &Material, stepping: Stepping) -> Result<Run, Failure> {
    let stiffness = (stepping.formulation == Formulation::Pbd).then_some(1.0);
    let solver =
        SolverCpu::new(beam.system::<f32>(material, stiffness)?, stepping.settings(), threads(beam))?;
    Ok(run("cpu", "f32", solver, beam, stepping, STILL.1))
}

fn single_gpu(gpu: &Gpu, beam: &Beam, material: &Material, stepping: Stepping) -> Result<Run, Failure> {
    let solver = SolverGpu::new(gpu, beam.system::<f32>(material, None)?, stepping.settings())?;
    Ok(run("gpu", "f32", solver, beam, stepping, STILL.1))
}

fn run<T: cutis_constraints::Scalar>(
    backend: &'static str,
    precision: &'static str,
    mut solver: impl Solver<T>,
    beam: &Beam,
    stepping: Stepping,
    still: f64,
) -> Run {
    let found = settle(&mut solver, beam, still, stepping.most_frames);
    let error = found.as_ref().err().map(ToString::to_string);
    Run { backend, precision, stepping, rest: found.ok(), error }
}
