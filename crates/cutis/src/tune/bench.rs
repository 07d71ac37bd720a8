//! Runs one prepared body with different settings, and measures time and displacements.

use std::ops::ControlFlow;
use std::time::Instant;

use cutis_constraints::Scalar;
use cutis_mesh::Gape;
use cutis_solver::{Formulation, Residual, Settings, Solver, StepProfile, System};
use cutis_solver_cpu::SolverCpu;
use nalgebra::Point3;

use super::field::{Field, Movable};
use super::setting::{CostModel, LinearCost, Setting};
use crate::backend::Chosen;
use crate::model::constraints::{self, CostEstimate};
use crate::{CostReport, Error, Progress};

/// Time limit for measuring a substep, s.
const LONG_ENOUGH_S: f64 = 0.1;

/// The body, its scene's settings, and the backend that all runs use.
pub(super) struct Bench<'a> {
    pub(super) system: &'a System<f32>,
    pub(super) settings: Settings,
    pub(super) gapes: &'a [Gape],
    pub(super) backend: &'a Chosen,
    pub(super) frames: u32,
    pub(super) movable: Movable,
}

/// A run, complete or stopped early.
#[derive(Default)]
pub(super) struct Run {
    /// Mean wall time of a frame, ms.
    pub(super) ms_per_frame: f64,
    /// Displacements at each of [`Bench::moments`] that the run reached.
    pub(super) fields: Vec<Field>,
    /// Growth of each wound, mm: mean distance of its lips at the last frame minus that at rest.
    pub(super) growths_mm: Vec<f64>,
    /// Final positions in local meters, one per vertex; empty if the run was stopped early.
    pub(super) positions: Vec<Point3<f32>>,
    pub(super) residuals: Vec<Residual>,
    /// Memory of the solver on host and device, bytes.
    pub(super) bytes: usize,
}

impl Run {
    /// True if the run reached its last frame.
    pub(super) fn finished(&self) -> bool {
        !self.positions.is_empty()
    }

    /// Displacements at the last sampled frame.
    pub(super) fn at_end(&self) -> &Field {
        static NONE: Field = Field(Vec::new());
        self.fields.last().unwrap_or(&NONE)
    }
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        system: &'a System<f32>,
        settings: Settings,
        gapes: &'a [Gape],
        backend: &'a Chosen,
        frames: u32,
    ) -> Self {
        Self { system, settings, gapes, backend, frames, movable: Movable::of(system) }
    }

    /// Frames at which displacements are sampled: a quarter, half and all of the frames.
    pub(super) fn moments(&self) -> Vec<u32> {
        let mut moments = vec![self.frames.div_ceil(4), self.frames.div_ceil(2), self.frames];
        moments.dedup();
        moments
    }

    /// Runs a setting on the scene's backend. `go_on` decides at each sampled frame, except the
    /// last one, whether the run continues.
    pub(super) fn run(
        &self,
        setting: Setting,
        progress: &dyn Progress,
        go_on: impl FnMut(&Run) -> ControlFlow<()>,
    ) -> Result<Run, Error> {
        let settings = setting.settings(&self.settings);
        let device = constraints::device_memory(self.backend, self.system, &settings);
        let on_device: usize = device.iter().map(|part| part.bytes).sum();
        let (mut started, _device) = constraints::start(self.backend, self.system.clone(), settings)?;
        let mut run = self.follow(started.solver(), progress, go_on)?;
        run.bytes = on_device + started.solver().bytes().iter().map(|part| part.bytes).sum::<usize>();
        Ok(run)
    }

    /// Runs a setting in double precision on the CPU.
    pub(super) fn run_f64(
        &self,
        system: &System<f64>,
        setting: Setting,
        progress: &dyn Progress,
    ) -> Result<Run, Error> {
        let threads = self.backend.host_threads();
        let mut solver = SolverCpu::new(system.clone(), setting.settings(&self.settings), Some(threads))?;
        self.follow(&mut solver, progress, |_| ControlFlow::Continue(()))
    }

    fn follow<T: Scalar>(
        &self,
        solver: &mut dyn Solver<T>,
        progress: &dyn Progress,
        mut go_on: impl FnMut(&Run) -> ControlFlow<()>,
    ) -> Result<Run, Error> {
        let moments = self.moments();
        let mut seconds = 0.0;
        let mut run = Run::default();
        for frame in 1..=self.frames {
            let start = Instant::now();
            solver.step(1)?;
            seconds += start.elapsed().as_secs_f64();
            progress.advance(frame.into());
            if !moments.contains(&frame) {
                continue;
            }
            run.ms_per_frame = 1e3 * seconds / f64::from(frame);
            let positions = solver.positions()?;
            run.fields.push(self.movable.field(&positions));
            run.growths_mm = self.growths_mm(&positions);
            if frame == self.frames {
                run.positions = positions.iter().map(|p| p.map(|x| x.to_f64() as f32)).collect();
                run.residuals = solver.system()?.residuals();
            } else if go_on(&run).is_break() {
                break;
            }
        }
        Ok(run)
    }

    /// Growth of each wound at `positions`, mm.
    pub(super) fn growths_mm<T: Scalar>(&self, positions: &[Point3<T>]) -> Vec<f64> {
        let now = |v: u32| positions[v as usize].map(T::to_f64);
        let rest = |v: u32| {
            let vertex = self.system.vertices()[v as usize].position() + self.system.origin().coords;
            vertex.map(f64::from)
        };
        let growth = |gape: &Gape| gape.measure_by(&now).mean_mm - gape.measure_by(&rest).mean_mm;
        self.gapes.iter().map(growth).collect()
    }

    /// Measures the cost model: substeps with one iteration and with two, on the scene's backend.
    pub(super) fn model(&self) -> Result<CostModel, Error> {
        Ok(CostModel { xpbd: self.line(Formulation::Xpbd)?, vbd: self.line(Formulation::Vbd)? })
    }

    fn line(&self, formulation: Formulation) -> Result<LinearCost, Error> {
        let mut ms = [0.0; 2];
        for (iterations, ms) in [1, 2].into_iter().zip(&mut ms) {
            let settings = self.one_substep(formulation, iterations);
            let (mut started, _device) = constraints::start(self.backend, self.system.clone(), settings)?;
            *ms = substep_ms(started.solver())?;
        }
        let iteration_ms = f64::max(ms[1] - ms[0], 0.1 * ms[0]);
        Ok(LinearCost { substep_ms: f64::max(ms[0] - iteration_ms, 0.0), iteration_ms })
    }

    /// Time of a substep in double precision, ms.
    pub(super) fn substep_f64_ms(&self, system: &System<f64>) -> Result<f64, Error> {
        let threads = self.backend.host_threads();
        let settings = self.one_substep(Formulation::Xpbd, 1);
        substep_ms(&mut SolverCpu::new(system.clone(), settings, Some(threads))?)
    }

    /// Profile of one frame, after one frame that touches all memory.
    pub(super) fn profile(&self, setting: Setting) -> Result<StepProfile, Error> {
        let settings = setting.settings(&self.settings);
        let (mut started, _device) = constraints::start(self.backend, self.system.clone(), settings)?;
        let mut profile = StepProfile::default();
        started.solver().step(1)?;
        started.solver().step_timed(1, &mut profile)?;
        Ok(profile)
    }

    /// Memory of a setting by part.
    pub(super) fn bytes(&self, setting: Setting) -> Result<CostReport, Error> {
        let settings = setting.settings(&self.settings);
        let mut estimate = CostEstimate::of(self.system, &settings)?;
        estimate.add_threaded(self.backend, self.system);
        let on_device = constraints::device_memory(self.backend, self.system, &settings);
        Ok(CostReport::of_memory(&estimate.memory, &on_device, "not measured"))
    }

    fn one_substep(&self, formulation: Formulation, iterations: u32) -> Settings {
        let dt_s = self.settings.substep_s();
        Settings { formulation, dt_s, substeps: 1, iterations, relaxation: 1.0, ..self.settings }
    }
}

/// Shortest time of several substeps, ms, after one substep that touches all memory.
fn substep_ms<T: Scalar>(solver: &mut dyn Solver<T>) -> Result<f64, Error> {
    solver.step(1)?;
    let (begin, mut shortest) = (Instant::now(), f64::INFINITY);
    while shortest.is_infinite() || begin.elapsed().as_secs_f64() < LONG_ENOUGH_S {
        let start = Instant::now();
        solver.step(1)?;
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    Ok(1e3 * shortest)
}
