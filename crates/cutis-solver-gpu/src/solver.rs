//! The solver of this backend. It encodes the schedule as GPU work.

use cutis_gpu::{Buffer, Gpu, GpuError};
use cutis_solver::{
    Change, Clock, MemoryPart, Method, Residual, Settings, Simulation, Solver, SolverError, StepProfile,
    System,
};
use nalgebra::{Point3, Vector3};

use crate::body::DeviceBody;
use crate::descent::DescentKernels;
use crate::gather::Gather;
use crate::handles::Handles;
use crate::kind::DeviceKind;
use crate::recorder::Recorder;
use crate::residual::Reduction;
use crate::{GpuSolverError, device_bytes};

/// Number of frames between two readbacks of the status.
const FRAMES_PER_CHECK: u64 = 64;
/// Number of dispatches after which a frame continues in another submission, which limits the
/// memory of a command buffer.
const DISPATCHES_PER_SUBMIT: usize = 1 << 16;
/// Number of threads after which a frame continues in another submission. A submission then takes
/// much less than the two seconds after which desktop systems reset a device.
const THREADS_PER_SUBMIT: usize = 1 << 28;

/// The solver on a GPU.
///
/// The host keeps a copy of the body from the last readback. If the device is lost, that copy
/// remains, and the clock of [`simulation`](Solver::simulation) returns to its time.
pub struct SolverGpu {
    gpu: Gpu,
    /// Contains the clock of the device and the host's copy of the body at the time `read_at`.
    simulation: Simulation<f32>,
    read_at: Clock,
    /// True if the host's copy is up to date.
    host_current: bool,
    /// True if the device's state is invalid, because a step failed on it. The run then continues
    /// from the host's copy.
    device_stale: bool,
    body: DeviceBody,
    constraints: Constraints,
    handles: Option<Handles>,
    gather: Option<Gather>,
    reductions: Vec<Reduction>,
    substep: Workload,
}

/// The constraints in the layout of the formulation.
enum Constraints {
    /// Ordered by color for each kind.
    Projected(Vec<DeviceKind>),
    /// Ordered by the vertices that they act on.
    Descent(DescentKernels),
}

impl Constraints {
    fn new(gpu: &Gpu, body: &DeviceBody, simulation: &Simulation<f32>) -> Result<Self, GpuError> {
        let kind = |set: &cutis_solver::Kind<f32>| DeviceKind::new(gpu, body, &**set, simulation.settings());
        Ok(match simulation.method() {
            // A body that only rests never comes here: it has a solver of its own.
            Method::Project(_) | Method::Rest => {
                Self::Projected(simulation.system().kinds().iter().map(kind).collect::<Result<_, _>>()?)
            }
            Method::Descend(descent) => Self::Descent(DescentKernels::new(gpu, body, simulation, descent)?),
        })
    }

    /// Returns the work of one iteration.
    fn workload(&self, simulation: &Simulation<f32>) -> Workload {
        match self {
            Self::Projected(kinds) => Workload {
                dispatches: kinds.iter().flat_map(|kind| &kind.colors).map(Vec::len).sum(),
                threads: simulation.system().kinds().iter().map(|kind| kind.len()).sum(),
            },
            Self::Descent(descent) => {
                let [dispatches, threads] = descent.workload(simulation.schedule().color_passes_of(0));
                Workload { dispatches, threads }
            }
        }
    }

    /// Encodes one iteration.
    fn encode(
        &self,
        recorder: &mut Recorder<'_>,
        simulation: &Simulation<f32>,
        iteration: u32,
    ) -> Result<(), GpuError> {
        let schedule = simulation.schedule();
        match self {
            Self::Projected(kinds) => {
                for sweep in &schedule.sweeps {
                    let name = simulation.system().kinds()[sweep.kind].name();
                    kinds[sweep.kind].project(recorder.pass_for(name)?, sweep, iteration);
                }
            }
            Self::Descent(descent) => {
                for pass in schedule.color_passes_of(iteration) {
                    descent.color_pass(recorder.pass_for(StepProfile::DESCENT)?, pass);
                }
            }
        }
        Ok(())
    }
}

/// Amount of work for the device.
#[derive(Clone, Copy, Default)]
struct Workload {
    dispatches: usize,
    threads: usize,
}

impl Workload {
    fn of_substep(body: &DeviceBody, constraints: &Constraints, simulation: &Simulation<f32>) -> Self {
        // Prediction, handles and the check for finite positions.
        let passes = 3;
        let iterations = simulation.settings().iterations as usize;
        let iteration = constraints.workload(simulation);
        Self {
            dispatches: passes * body.check.dispatches() + iteration.dispatches.saturating_mul(iterations),
            threads: passes * body.vertices.len() + iteration.threads.saturating_mul(iterations),
        }
    }
}

/// An error in a step.
enum StepError {
    Device(GpuError),
    NotFinite(usize),
}

impl From<GpuError> for StepError {
    fn from(error: GpuError) -> Self {
        Self::Device(error)
    }
}

impl SolverGpu {
    /// Builds a solver for `system` on `gpu`. It uploads the body and compiles one kernel per kind
    /// and one per pass over the vertices.
    ///
    /// # Errors
    /// Returns the errors of [`Simulation::new`], and [`GpuSolverError::Gpu`] for a body that
    /// exceeds the device's limits or a kind with invalid WGSL.
    pub fn new(gpu: &Gpu, system: System<f32>, settings: Settings) -> Result<Self, GpuSolverError> {
        let simulation = Simulation::new(system, settings)?;
        let body = DeviceBody::new(gpu, &simulation)?;
        let constraints = Constraints::new(gpu, &body, &simulation)?;
        let handles = Handles::new(gpu, &body, simulation.system(), &settings)?;
        let substep = Workload::of_substep(&body, &constraints, &simulation);
        Ok(Self {
            gpu: gpu.clone(),
            read_at: simulation.clock(),
            simulation,
            host_current: true,
            device_stale: false,
            body,
            constraints,
            handles,
            gather: None,
            reductions: Vec::new(),
            substep,
        })
    }

    /// Returns the device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Returns the buffer of positions relative to [`System::origin`] (m) and inverse masses
    /// (1/kg). Other kernels can use the body through it without a readback.
    pub fn vertices(&self) -> &Buffer<[f32; 4]> {
        &self.body.vertices
    }

    /// Returns the memory on the device by part.
    pub fn device_bytes(&self) -> Vec<MemoryPart> {
        device_bytes(self.simulation.system(), self.simulation.settings())
    }

    /// Runs whole frames, after the rest of an incomplete frame. With a profile, times each part.
    fn run(&mut self, frames: usize, mut profile: Option<&mut StepProfile>) -> Result<(), StepError> {
        let end = self.simulation.clock().frame.saturating_add(frames as u64);
        while self.simulation.clock().frame < end {
            let batch_end = end.min(self.simulation.clock().frame.saturating_add(FRAMES_PER_CHECK));
            self.run_batch(batch_end, profile.as_deref_mut())?;
        }
        Ok(())
    }

    /// Runs up to frame `end` and then reads the status.
    fn run_batch(&mut self, end: u64, mut profile: Option<&mut StepProfile>) -> Result<(), StepError> {
        let settings = *self.simulation.settings();
        let mut clock = self.simulation.clock();
        self.upload_if_stale()?;
        self.body.clear_status(&self.gpu)?;
        self.host_current = false;
        let mut started = false;
        let mut done = 0;
        while clock.frame < end {
            let frame = clock.frame;
            if let Some(handles) = &self.handles {
                let paths = self.simulation.system().handles();
                handles.write_paths(&self.gpu, paths, clock, &settings, done)?;
            }
            let mut recorder = Recorder::new(&self.gpu, profile.as_deref_mut());
            let mut encoded = Workload::default();
            while clock.frame == frame {
                if encoded.dispatches > DISPATCHES_PER_SUBMIT || encoded.threads > THREADS_PER_SUBMIT {
                    recorder.submit()?;
                    encoded = Workload::default();
                }
                encoded.dispatches += self.substep.dispatches;
                encoded.threads = encoded.threads.saturating_add(self.substep.threads);
                self.body.begin_substep(recorder.pass_for(StepProfile::VERTICES)?, started);
                started = true;
                if let Some(handles) = &self.handles {
                    handles.advance(recorder.pass_for(StepProfile::HANDLES)?);
                }
                for iteration in 0..self.simulation.schedule().iterations {
                    self.constraints.encode(&mut recorder, &self.simulation, iteration)?;
                }
                self.body.check.run(recorder.pass_for(StepProfile::CHECK)?);
                clock.tick(&settings);
                done += 1;
            }
            if clock.frame == end {
                self.body.finish.run(recorder.pass_for(StepProfile::VERTICES)?);
            }
            recorder.submit()?;
        }
        let status = self.body.status(&self.gpu)?;
        let Some(vertex) = status.vertex else {
            self.simulation.set_clock(clock);
            return Ok(());
        };
        let mut pass = self.gpu.pass("restore");
        self.body.restore.run(&mut pass);
        pass.submit()?;
        let mut clock = self.simulation.clock();
        for _ in 0..status.substeps {
            clock.tick(&settings);
        }
        self.simulation.set_clock(clock);
        Err(StepError::NotFinite(vertex))
    }

    fn solver_error(&mut self, error: StepError) -> SolverError {
        match error {
            StepError::Device(error) => self.step_error(&error),
            StepError::NotFinite(vertex) => {
                SolverError::not_finite(vertex, self.simulation.clock(), self.simulation.settings())
            }
        }
    }

    /// Returns the error of a step. The state on the device is then invalid, and the clock returns
    /// to the time of the host's copy.
    fn step_error(&mut self, error: &GpuError) -> SolverError {
        self.simulation.set_clock(self.read_at);
        (self.host_current, self.device_stale) = (true, true);
        self.device_error(error)
    }

    /// Returns the error of a readback, which leaves the state on the device valid unless the
    /// device is lost.
    fn read_error(&mut self, error: &GpuError) -> SolverError {
        match error {
            GpuError::Lost { .. } => self.step_error(error),
            _ => self.device_error(error),
        }
    }

    fn device_error(&self, error: &GpuError) -> SolverError {
        let time_s = self.read_at.time_s(self.simulation.settings());
        SolverError::Device { backend: self.name(), reason: error.to_string(), time_s }
    }

    /// Uploads the host's copy of the body if the state on the device is invalid.
    fn upload_if_stale(&mut self) -> Result<(), GpuError> {
        if self.device_stale {
            self.body.upload(&self.gpu, &self.simulation)?;
            self.device_stale = false;
        }
        Ok(())
    }

    /// Brings the device up to date after a change of the host's copy. Kinds that did not change
    /// stay on the device, unless they are stored by vertices.
    fn rebuild(&mut self, change: &Change<f32>) -> Result<(), GpuError> {
        let simulation = &self.simulation;
        if self.body.loads.is_some() == simulation.system().loads().is_empty() {
            // The kernels with and without loads differ.
            self.body = DeviceBody::new(&self.gpu, simulation)?;
            self.constraints = Constraints::new(&self.gpu, &self.body, simulation)?;
            let (system, settings) = (simulation.system(), simulation.settings());
            self.handles = Handles::new(&self.gpu, &self.body, system, settings)?;
        } else {
            self.body.upload(&self.gpu, simulation)?;
            match &mut self.constraints {
                Constraints::Projected(kinds) => {
                    for (number, kind) in &change.kinds {
                        kinds[*number] =
                            DeviceKind::new(&self.gpu, &self.body, &**kind, simulation.settings())?;
                    }
                }
                Constraints::Descent(_) => {
                    self.constraints = Constraints::new(&self.gpu, &self.body, simulation)?;
                }
            }
            if !change.handles.is_empty() {
                let (system, settings) = (simulation.system(), simulation.settings());
                self.handles = Handles::new(&self.gpu, &self.body, system, settings)?;
            }
        }
        self.gather = None;
        self.reductions.clear();
        self.substep = Workload::of_substep(&self.body, &self.constraints, simulation);
        self.device_stale = false;
        Ok(())
    }

    /// Reads vertices and velocities from the device.
    fn read_body(&self) -> Result<[Vec<[f32; 4]>; 2], GpuError> {
        let all = 0..self.body.vertices.len();
        let vertices = self.gpu.read(&self.body.vertices, all.clone())?;
        Ok([vertices, self.gpu.read(&self.body.velocities, all)?])
    }

    /// Computes residuals by reduction. Returns `None` if constraints are not stored by color.
    fn reduce(&mut self) -> Result<Option<Vec<Residual>>, GpuError> {
        self.upload_if_stale()?;
        let Constraints::Projected(kinds) = &self.constraints else { return Ok(None) };
        for n in self.reductions.len()..kinds.len() {
            let set = &*self.simulation.system().kinds()[n];
            self.reductions.push(Reduction::new(&self.gpu, &self.body, &kinds[n], set)?);
        }
        self.reductions.iter().map(|reduction| reduction.run(&self.gpu)).collect::<Result<_, _>>().map(Some)
    }
}

impl Solver<f32> for SolverGpu {
    fn name(&self) -> &'static str {
        "gpu"
    }

    fn step(&mut self, frames: usize) -> Result<(), SolverError> {
        let done = self.run(frames, None);
        done.map_err(|error| self.solver_error(error))
    }

    fn step_timed(&mut self, frames: usize, profile: &mut StepProfile) -> Result<(), SolverError> {
        let done = self.run(frames, Some(profile));
        done.map_err(|error| self.solver_error(error))
    }

    fn restore(&mut self, x: &[Point3<f32>], v: &[Vector3<f32>], frame: u64) -> Result<(), SolverError> {
        self.simulation.restore(x, v, frame)?;
        (self.host_current, self.device_stale, self.read_at) = (true, true, self.simulation.clock());
        self.upload_if_stale().map_err(|error| self.step_error(&error))
    }

    /// Reads the body, changes it on the host, and uploads what changed.
    fn change(&mut self, change: &Change<f32>) -> Result<(), SolverError> {
        self.refresh()?;
        self.simulation.change(change)?;
        self.rebuild(change).map_err(|error| self.step_error(&error))
    }

    fn simulation(&self) -> &Simulation<f32> {
        &self.simulation
    }

    fn refresh(&mut self) -> Result<(), SolverError> {
        if self.host_current {
            return Ok(());
        }
        let [vertices, velocities] = self.read_body().map_err(|error| self.read_error(&error))?;
        let velocities = velocities.iter().map(|&[x, y, z, _]| Vector3::new(x, y, z));
        self.simulation.set_state(bytemuck::cast_slice(&vertices), velocities)?;
        (self.host_current, self.read_at) = (true, self.simulation.clock());
        Ok(())
    }

    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<f32>>, SolverError> {
        self.simulation.system().check_vertices(vertices)?;
        if self.host_current {
            return self.simulation.system().positions_of(vertices);
        }
        let found = Gather::read(&mut self.gather, &self.gpu, &self.body, vertices);
        let found = found.map_err(|error| self.read_error(&error))?;
        let origin = self.simulation.system().origin().coords;
        Ok(found.iter().map(|&[x, y, z, _]| Point3::new(x, y, z) + origin).collect())
    }

    /// Computes residuals by reduction on the device. Sums of squares over 64 constraints are
    /// `f32`, so that the relative difference to the CPU's is about 1e-7. For vertex block descent,
    /// the host reads the body and computes the residuals.
    fn residuals(&mut self) -> Result<Vec<Residual>, SolverError> {
        match self.reduce().map_err(|error| self.read_error(&error))? {
            Some(residuals) => Ok(residuals),
            None => Ok(self.system()?.residuals()),
        }
    }
}
