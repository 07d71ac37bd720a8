//! The solver of this backend: the schedule, encoded.

use cutis_gpu::{Buffer, Gpu, GpuError};
use cutis_solver::{
    Clock, MemoryPart, Method, Residual, Settings, Simulation, Solver, SolverError, StepProfile, System,
};
use nalgebra::{Point3, Vector3};

use crate::body::Body;
use crate::descent::DescentOnDevice;
use crate::gather::Gather;
use crate::handles::Handles;
use crate::kind::Kind;
use crate::recorder::Recorder;
use crate::residual::Reduction;
use crate::{GpuSolverError, device_bytes};

/// Frames that are submitted before the host looks whether the body is still finite.
const FRAMES_PER_LOOK: u64 = 64;
/// Dispatches after which a frame goes on in another submit, so that a command buffer stays within memory.
const DISPATCHES_PER_SUBMIT: usize = 1 << 16;
/// Threads after which it does, so that a submit stays well within the two seconds after which desktops reset a device.
const THREADS_PER_SUBMIT: usize = 1 << 28;

/// The solver on a GPU.
///
/// The host keeps the body as it was when it was last read. If the device is lost, that state stays, and
/// [`simulation`](Solver::simulation) says which time it belongs to.
pub struct SolverGpu {
    gpu: Gpu,
    /// The clock is that of the device; the body is that of `read_at`.
    simulation: Simulation<f32>,
    read_at: Clock,
    /// Whether the host's body is the present one.
    fresh: bool,
    /// Whether the device's is not: a step failed on it half-way, and the host's is the one to go on from.
    stale_device: bool,
    body: Body,
    constraints: Constraints,
    handles: Option<Handles>,
    gather: Option<Gather>,
    reductions: Vec<Reduction>,
    substep: Load,
}

/// The constraints, stored as the formulation takes them.
enum Constraints {
    /// Color by color of each kind.
    Projected(Vec<Kind>),
    /// By the vertices that they act on.
    Descent(DescentOnDevice),
}

impl Constraints {
    fn new(gpu: &Gpu, body: &Body, simulation: &Simulation<f32>) -> Result<Self, GpuError> {
        let kind = |set: &cutis_solver::Kind<f32>| Kind::new(gpu, body, &**set, simulation.settings());
        Ok(match simulation.method() {
            Method::Project(_) => {
                Self::Projected(simulation.system().kinds().iter().map(kind).collect::<Result<_, _>>()?)
            }
            Method::Descend(descent) => Self::Descent(DescentOnDevice::new(gpu, body, simulation, descent)?),
        })
    }

    /// What one iteration asks of the device.
    fn load(&self, simulation: &Simulation<f32>) -> Load {
        match self {
            Self::Projected(kinds) => Load {
                dispatches: kinds.iter().flat_map(|kind| &kind.colors).map(Vec::len).sum(),
                threads: simulation.system().kinds().iter().map(|kind| kind.len()).sum(),
            },
            Self::Descent(descent) => {
                let [dispatches, threads] = descent.load(simulation.schedule().color_passes_of(0));
                Load { dispatches, threads }
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
                    kinds[sweep.kind].project(recorder.part(name)?, sweep, iteration);
                }
            }
            Self::Descent(descent) => {
                for pass in schedule.color_passes_of(iteration) {
                    descent.color_pass(recorder.part(StepProfile::DESCENT)?, pass);
                }
            }
        }
        Ok(())
    }
}

/// What a substep asks of the device.
#[derive(Clone, Copy, Default)]
struct Load {
    dispatches: usize,
    threads: usize,
}

/// Why a step ended early.
enum Stop {
    Device(GpuError),
    NotFinite(usize),
}

impl From<GpuError> for Stop {
    fn from(error: GpuError) -> Self {
        Self::Device(error)
    }
}

impl SolverGpu {
    /// A solver for `system` on `gpu`: uploads the body and compiles one kernel per kind, and one for each pass over the
    /// vertices.
    ///
    /// # Errors
    /// Settings that cannot be used, a kind with a stiffness of the other formulation, a body that does not fit the
    /// device's limits, a kind whose WGSL is wrong.
    pub fn new(gpu: &Gpu, system: System<f32>, settings: Settings) -> Result<Self, GpuSolverError> {
        let simulation = Simulation::new(system, settings)?;
        let body = Body::new(gpu, &simulation)?;
        let constraints = Constraints::new(gpu, &body, &simulation)?;
        let handles = Handles::new(gpu, &body, simulation.system(), &settings)?;
        // Prediction, handles and the look at finiteness; then the colors.
        let passes = 3;
        let iterations = settings.iterations as usize;
        let iteration = constraints.load(&simulation);
        let substep = Load {
            dispatches: passes * body.check.dispatches() + iteration.dispatches.saturating_mul(iterations),
            threads: passes * body.vertices.len() + iteration.threads.saturating_mul(iterations),
        };
        Ok(Self {
            gpu: gpu.clone(),
            read_at: simulation.clock(),
            simulation,
            fresh: true,
            stale_device: false,
            body,
            constraints,
            handles,
            gather: None,
            reductions: Vec::new(),
            substep,
        })
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Positions relative to [`System::origin`] (m) and inverse masses (1/kg), on the device: for other kernels that
    /// work on the body without a trip to the host.
    pub fn vertices(&self) -> &Buffer<[f32; 4]> {
        &self.body.vertices
    }

    /// Bytes on the device, part by part.
    pub fn device_bytes(&self) -> Vec<MemoryPart> {
        device_bytes(self.simulation.system(), self.simulation.settings())
    }

    /// Runs whole frames and the rest of one that was begun; with a profile, part by part.
    fn run(&mut self, frames: usize, mut profile: Option<&mut StepProfile>) -> Result<(), Stop> {
        let end = self.simulation.clock().frame.saturating_add(frames as u64);
        while self.simulation.clock().frame < end {
            let look = end.min(self.simulation.clock().frame.saturating_add(FRAMES_PER_LOOK));
            self.run_unseen(look, profile.as_deref_mut())?;
        }
        Ok(())
    }

    /// Runs up to frame `end` and then looks whether the body is finite.
    fn run_unseen(&mut self, end: u64, mut profile: Option<&mut StepProfile>) -> Result<(), Stop> {
        let settings = *self.simulation.settings();
        let mut clock = self.simulation.clock();
        self.bring_device_up_to_date()?;
        self.body.clear_status(&self.gpu)?;
        self.fresh = false;
        let mut begun = false;
        let mut done = 0;
        while clock.frame < end {
            let frame = clock.frame;
            if let Some(handles) = &self.handles {
                let paths = self.simulation.system().handles();
                handles.write_paths(&self.gpu, paths, clock, &settings, done)?;
            }
            let mut recorder = Recorder::new(&self.gpu, profile.as_deref_mut());
            let mut encoded = Load::default();
            while clock.frame == frame {
                if encoded.dispatches > DISPATCHES_PER_SUBMIT || encoded.threads > THREADS_PER_SUBMIT {
                    recorder.submit()?;
                    encoded = Load::default();
                }
                encoded.dispatches += self.substep.dispatches;
                encoded.threads = encoded.threads.saturating_add(self.substep.threads);
                self.body.begin_substep(recorder.part(StepProfile::VERTICES)?, begun);
                begun = true;
                if let Some(handles) = &self.handles {
                    handles.advance(recorder.part(StepProfile::HANDLES)?);
                }
                for iteration in 0..self.simulation.schedule().iterations {
                    self.constraints.encode(&mut recorder, &self.simulation, iteration)?;
                }
                self.body.check.run(recorder.part(StepProfile::CHECK)?);
                clock.tick(&settings);
                done += 1;
            }
            if clock.frame == end {
                self.body.finish.run(recorder.part(StepProfile::VERTICES)?);
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
        Err(Stop::NotFinite(vertex))
    }

    fn error(&mut self, stop: Stop) -> SolverError {
        match stop {
            Stop::Device(error) => self.stopped(&error),
            Stop::NotFinite(vertex) => {
                SolverError::not_finite(vertex, self.simulation.clock(), self.simulation.settings())
            }
        }
    }

    /// The error of a step: what the device holds is not to be relied on, and the host's body is the one that counts, at the
    /// time that it was read at.
    fn stopped(&mut self, error: &GpuError) -> SolverError {
        self.simulation.set_clock(self.read_at);
        (self.fresh, self.stale_device) = (true, true);
        self.unread(error)
    }

    /// The error of a look at the body, which changes nothing, unless the device is gone.
    fn unseen(&mut self, error: &GpuError) -> SolverError {
        match error {
            GpuError::Lost { .. } => self.stopped(error),
            _ => self.unread(error),
        }
    }

    fn unread(&self, error: &GpuError) -> SolverError {
        let time_s = self.read_at.time_s(self.simulation.settings());
        SolverError::Device { backend: self.name(), reason: error.to_string(), time_s }
    }

    /// Uploads the host's body where the device's is not to be relied on.
    fn bring_device_up_to_date(&mut self) -> Result<(), GpuError> {
        if self.stale_device {
            self.body.upload(&self.gpu, &self.simulation)?;
            self.stale_device = false;
        }
        Ok(())
    }

    /// Vertices and velocities as they are on the device.
    fn read_body(&self) -> Result<[Vec<[f32; 4]>; 2], GpuError> {
        let all = 0..self.body.vertices.len();
        let vertices = self.gpu.read(&self.body.vertices, all.clone())?;
        Ok([vertices, self.gpu.read(&self.body.velocities, all)?])
    }

    /// Residuals by reduction; none where constraints are not stored by color.
    fn reduce(&mut self) -> Result<Option<Vec<Residual>>, GpuError> {
        self.bring_device_up_to_date()?;
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
        done.map_err(|stop| self.error(stop))
    }

    fn step_timed(&mut self, frames: usize, profile: &mut StepProfile) -> Result<(), SolverError> {
        let done = self.run(frames, Some(profile));
        done.map_err(|stop| self.error(stop))
    }

    fn restore(
        &mut self,
        positions: &[Point3<f32>],
        velocities: &[Vector3<f32>],
        frame: u64,
    ) -> Result<(), SolverError> {
        self.simulation.restore(positions, velocities, frame)?;
        (self.fresh, self.stale_device, self.read_at) = (true, true, self.simulation.clock());
        self.bring_device_up_to_date().map_err(|error| self.stopped(&error))
    }

    fn simulation(&self) -> &Simulation<f32> {
        &self.simulation
    }

    fn refresh(&mut self) -> Result<(), SolverError> {
        if self.fresh {
            return Ok(());
        }
        let [vertices, velocities] = self.read_body().map_err(|error| self.unseen(&error))?;
        let velocities = velocities.iter().map(|&[x, y, z, _]| Vector3::new(x, y, z));
        self.simulation.set_state(bytemuck::cast_slice(&vertices), velocities)?;
        (self.fresh, self.read_at) = (true, self.simulation.clock());
        Ok(())
    }

    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<f32>>, SolverError> {
        self.simulation.system().check_vertices(vertices)?;
        if self.fresh {
            return self.simulation.system().positions_of(vertices);
        }
        let found = Gather::read(&mut self.gather, &self.gpu, &self.body, vertices);
        let found = found.map_err(|error| self.unseen(&error))?;
        let origin = self.simulation.system().origin().coords;
        Ok(found.iter().map(|&[x, y, z, _]| Point3::new(x, y, z) + origin).collect())
    }

    /// By reduction on the device. Sums of squares over 64 constraints are `f32`, so that it differs from the CPU's by some
    /// 1e-7, relative. In vertex block descent the body is read and measured on the host.
    fn residuals(&mut self) -> Result<Vec<Residual>, SolverError> {
        match self.reduce().map_err(|error| self.unseen(&error))? {
            Some(residuals) => Ok(residuals),
            None => Ok(self.system()?.residuals()),
        }
    }
}
