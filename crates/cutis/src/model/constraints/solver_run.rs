//! A simulation by a solver of constraints.

use cutis_rest::{Rest, Step};
use cutis_solver::{Change, Formulation, StepProfile, System};
use nalgebra::{Point3, Vector3};

use super::hooks::{self, Hooks};
use super::start::StartedSolver;
use super::threads::Threads;
use super::wound::GrowingWound;
use crate::Error;
use crate::backend::{DevicePositions, Gpu, RestDevice};
use crate::body::GrowingCuts;
use crate::model::{ModelInput, Simulation, SimulationEnd, first_frame};
use crate::output::report::KindResidual;
use crate::run::checkpoint::Checkpoint;

/// Relative error above which a degenerate constraint is reported.
const COLLAPSED: f64 = 0.01;

/// Relative force at which a body is at rest without an estimate of the error. Loads and parameters
/// have single precision: they leave about 3e-6 in a body that is at rest in the scan.
const BALANCED: f64 = 1e-5;

/// When a search for the state of rest of a scene ends, for its `run.error`.
pub(crate) fn rest_options(error: f64) -> cutis_rest::Options {
    cutis_rest::Options { error, force: BALANCED, ..Default::default() }
}

/// Name of the work of cuts that grow in a profile.
const CUT: &str = "cut";

/// Name of the work of sutures in a profile.
const SUTURE: &str = "suture";

/// Name of the work of hooks that grab tissue in a profile.
const HOOK: &str = "hook";

/// A solver with a body in it.
pub(crate) struct SolverRun<'a> {
    pub(crate) solver: StartedSolver,
    /// The cuts that grow; none if the scene has none.
    pub(crate) wound: Option<GrowingWound>,
    /// The threads of sutures; none if the scene has none.
    pub(crate) threads: Option<Threads>,
    /// The handles that grab tissue later; none if the scene has none.
    pub(crate) hooks: Option<Hooks>,
    /// The GPU of the run, if it has one, and its kernels for searches after the first one.
    pub(crate) gpu: Option<Gpu>,
    pub(crate) rest_device: Option<RestDevice>,
    pub(crate) input: ModelInput<'a>,
}

impl<'a> SolverRun<'a> {
    /// The cuts that grow, and their state.
    fn growing(&self) -> Option<(&'a GrowingCuts, &GrowingWound)> {
        self.input.body.growing.as_ref().zip(self.wound.as_ref())
    }

    /// Cuts as far as the cuts are at the present time.
    fn cut(&mut self) -> Result<(), Error> {
        self.cut_with(|_| ())
    }

    /// Does the same with a change that is edited before it is made.
    fn cut_with(&mut self, edit: impl FnOnce(&mut Change<f32>)) -> Result<(), Error> {
        let (Some(cuts), Some(wound)) = (&self.input.body.growing, &mut self.wound) else { return Ok(()) };
        let time_s = self.solver.reader().time_s();
        if let Some(mut change) = wound.change(&self.input, cuts, time_s)? {
            edit(&mut change);
            self.solver.solver().change(&change)?;
        }
        Ok(())
    }

    /// Lets the hooks grab tissue that hold it from the present frame on. A vertex that a cut has
    /// not reached begins where the vertex is that it follows.
    fn grab(&mut self) -> Result<(), Error> {
        let frame = self.solver.reader().simulation().clock().frame;
        let vertices = self.hooks.as_ref().map_or_else(Vec::new, |hooks| hooks.vertices(frame));
        if vertices.is_empty() {
            return Ok(());
        }
        let positions = self.positions_of(&vertices)?;
        let mut states = Vec::new();
        if let (Some(cuts), Some(wound)) = (&self.input.body.growing, &mut self.wound) {
            wound.hold(cuts, &vertices);
            let pairs = vertices.iter().map(|&vertex| [vertex, wound.leader(cuts, vertex)]);
            states.extend(pairs.filter(|[vertex, leader]| vertex != leader));
        }
        let handles = self.hooks.iter_mut().flat_map(|hooks| hooks.grab(frame, &positions)).collect();
        Ok(self.solver.solver().change(&Change { states, handles, ..Change::default() })?)
    }

    /// Lets the time pass until the first frame that begins at `time_s` or later, while nothing
    /// moves. Returns the frame.
    fn wait_until(&mut self, time_s: f64) -> Result<u64, Error> {
        let solver = self.solver.solver();
        let now = solver.simulation().clock().frame;
        let frame = first_frame(time_s, solver.settings().dt_s).max(now);
        if frame > now {
            let positions = solver.positions()?;
            solver.restore(&positions, &vec![Vector3::zeros(); positions.len()], frame)?;
        }
        Ok(frame)
    }

    /// Pulls the threads as far as they are tightened at the present time.
    fn tighten(&mut self) -> Result<(), Error> {
        let Some(threads) = &mut self.threads else { return Ok(()) };
        let time_s = self.solver.reader().time_s();
        let solver = self.solver.solver();
        let mut positions_of = |vertices: &[u32]| Ok(solver.positions_of(vertices)?);
        if threads.tighten(&self.input.scene.suture, time_s, &mut positions_of)? {
            let kinds = vec![(threads.kind, threads.constraints(&self.input)?)];
            solver.change(&Change { kinds, ..Change::default() })?;
        }
        Ok(())
    }

    /// Positions of all vertices. Those that a cut has not reached are where the vertices are that
    /// they follow.
    fn positions(&mut self) -> Result<Vec<Point3<f32>>, Error> {
        let mut positions = self.solver.solver().positions()?;
        if let Some((cuts, wound)) = self.growing() {
            wound.complete(cuts, &mut positions);
        }
        Ok(positions)
    }
}

impl Simulation for SolverRun<'_> {
    fn restore(&mut self, saved: &Checkpoint) -> Result<(), Error> {
        let (velocities, starts) = saved.words.split_at(3 * saved.positions.len());
        let threads = self.threads.as_ref().map_or(0, Threads::count);
        let (threads, hooks) = starts.split_at(threads.min(starts.len()));
        if let Some(own) = &mut self.threads {
            own.restore(threads);
        }
        let velocities: Vec<Vector3<f32>> =
            velocities.chunks_exact(3).map(|v| Vector3::from_fn(|axis, _| f32::from_bits(v[axis]))).collect();
        let frame = u64::from(saved.frame);
        let has_acts = self.wound.is_some() || self.threads.is_some() || self.hooks.is_some();
        if let Some(begun) = saved.last_begun().filter(|_| has_acts) {
            // Cuts, hooks and threads are as they were when the last frame began. All nodes have
            // their states.
            let mut positions = saved.positions.clone();
            if let Some(own) = &self.hooks {
                own.place(hooks, &mut positions);
            }
            self.solver.solver().restore(&positions, &velocities, begun.into())?;
            self.cut_with(|change| change.states.clear())?;
            self.grab()?;
            self.tighten()?;
        }
        Ok(self.solver.solver().restore(&saved.positions, &velocities, frame)?)
    }

    fn step(&mut self) -> Result<(), Error> {
        self.cut()?;
        self.grab()?;
        self.tighten()?;
        Ok(self.solver.solver().step(1)?)
    }

    fn step_timed(&mut self, profile: &mut StepProfile) -> Result<(), Error> {
        if self.wound.is_some() {
            profile.time(CUT, || self.cut())?;
        }
        if self.hooks.is_some() {
            profile.time(HOOK, || self.grab())?;
        }
        if self.threads.is_some() {
            profile.time(SUTURE, || self.tighten())?;
        }
        Ok(self.solver.solver().step_timed(1, profile)?)
    }

    fn parts_are_sequential(&self) -> bool {
        !self.solver.on_gpu()
    }

    fn time_s(&self) -> f64 {
        self.solver.reader().time_s()
    }

    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<f32>>, Error> {
        let Some((cuts, wound)) = self.growing() else {
            return Ok(self.solver.solver().positions_of(vertices)?);
        };
        let leaders: Vec<u32> = vertices.iter().map(|&vertex| wound.leader(cuts, vertex)).collect();
        Ok(self.solver.solver().positions_of(&leaders)?)
    }

    fn thread_forces(&mut self) -> Result<Vec<(usize, f64)>, Error> {
        let Some(threads) = &self.threads else { return Ok(Vec::new()) };
        let positions = self.solver.solver().positions_of(threads.vertices())?;
        Ok(threads.sutures().zip(threads.forces(&positions)).collect())
    }

    fn handle_forces(&mut self) -> Result<Vec<f64>, Error> {
        let ModelInput { scene, body, .. } = self.input;
        let pbd = scene.solver.formulation == Formulation::Pbd;
        if scene.handle.is_empty() || pbd || !scene.output.report {
            return Ok(Vec::new());
        }
        let vertices = body.grabbed.concat();
        // A GPU sends only the vertices that the forces depend on.
        let solver = self.solver.solver();
        let around = solver.simulation().system().vertices_around(&vertices)?;
        let positions = solver.positions_of(&around)?;
        let forces = solver.simulation().system().forces_on(&vertices, &around, &positions)?;
        let mut of_vertices = forces.iter();
        let force = |grabbed: &Vec<u32>| {
            let own = of_vertices.by_ref().take(grabbed.len());
            own.fold(Vector3::zeros(), |sum: Vector3<f64>, force| sum + force.cast()).norm()
        };
        let waits = |n: usize| self.hooks.as_ref().is_some_and(|hooks| hooks.waits(n));
        let forces = body.grabbed.iter().map(force).enumerate();
        Ok(forces.map(|(n, force)| if waits(n) { 0.0 } else { force }).collect())
    }

    fn settle(&mut self, time_s: f64, error: f64, progress: &mut dyn FnMut(&Step)) -> Result<Rest, Error> {
        let frame = self.wait_until(time_s)?;
        self.cut()?;
        self.grab()?;
        self.tighten()?;
        let solver = self.solver.solver();
        let gravity = solver.settings().gravity_m_s2;
        let before = solver.positions()?;
        let velocities = vec![Vector3::zeros(); before.len()];
        let mut placed = before.clone();
        let time_s = solver.time_s();
        hooks::place(solver.system()?, time_s, &mut placed);
        solver.restore(&placed, &velocities, frame)?;
        let mut body = cutis_rest::Body::of(solver.system()?, gravity)?;
        if let (None, Some(gpu)) = (&self.rest_device, &self.gpu) {
            self.rest_device = Some(RestDevice::new(gpu)?);
        }
        if let Some(device) = &self.rest_device {
            body = device.with(body);
        }
        let options = rest_options(error);
        let before: Vec<Point3<f64>> = before.iter().map(|x| x.cast()).collect();
        let rest = body.settle_after(&before, &options, progress)?;
        let positions: Vec<Point3<f32>> = rest.positions.iter().map(|x| x.cast()).collect();
        solver.restore(&positions, &velocities, frame)?;
        Ok(rest)
    }

    fn save(&mut self, frame: u32) -> Result<Checkpoint, Error> {
        let positions = self.positions()?;
        let mut velocities = self.solver.solver().velocities()?.to_vec();
        if let Some((cuts, wound)) = self.growing() {
            wound.complete(cuts, &mut velocities);
        }
        let words = velocities.iter().flat_map(|v| [v.x, v.y, v.z].map(f32::to_bits));
        let words = words.chain(self.threads.iter().flat_map(Threads::starts));
        let words = words.chain(self.hooks.iter().flat_map(Hooks::starts)).collect();
        Ok(Checkpoint::of(frame, positions, words))
    }

    /// Reads the whole body once. Residuals are measured on the host, so that they need no GPU
    /// memory, and a full GPU cannot make a finished run fail.
    fn end(&mut self) -> Result<SimulationEnd, Error> {
        let positions = self.positions()?;
        let system = self.solver.solver().system()?;
        let collapsed = system.check_collapsed(COLLAPSED).err().map(|error| error.to_string());
        Ok(SimulationEnd {
            positions,
            residuals: residuals(system),
            warnings: collapsed.into_iter().collect(),
            chainmail: None,
        })
    }

    fn positions_on_device(&self) -> Option<DevicePositions> {
        let complete = self.growing().is_none_or(|(cuts, wound)| wound.followers(cuts) == 0);
        if complete { self.solver.positions_on_device() } else { None }
    }
}

/// The residual of each type of constraint. A body with growing cuts has each type twice.
fn residuals(system: &System<f32>) -> Vec<KindResidual> {
    let mut all: Vec<(cutis_solver::Residual, usize)> = Vec::new();
    for (residual, kind) in system.residuals().into_iter().zip(system.kinds()) {
        match all.iter_mut().find(|(other, _)| other.name == residual.name) {
            None => all.push((residual, kind.len())),
            Some((other, count)) => {
                let sum = other.rms.powi(2) * *count as f64 + residual.rms.powi(2) * kind.len() as f64;
                *count += kind.len();
                other.rms = (sum / (*count).max(1) as f64).sqrt();
                other.max = other.max.max(residual.max);
            }
        }
    }
    all.iter().map(|(residual, _)| KindResidual::from(residual)).collect()
}
