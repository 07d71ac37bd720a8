//! Where a scene runs, and why: the one place that chooses between the backends.
//!
//! What a scene asks for by name is settled before any work is done ([`Request::of`]): a backend or an adapter that is not
//! there is refused, never replaced. `auto` waits until the size of the work is known ([`Request::settle`]), so that nobody
//! looks for a GPU for a scene that is too small for one. No device is opened before [`Chosen::start`].

#[cfg(feature = "gpu")]
mod auto;
pub(crate) mod devices;
#[cfg_attr(not(feature = "gpu"), path = "absent.rs")]
mod gpu;
mod stages;

use cutis_chainmail::Chain;
use cutis_solver::{Settings, Solver, SolverReference, System};
use cutis_solver_cpu::SolverCpu;

use crate::Error;
use crate::report::{Backend, DeviceWork, MemoryPart};
use crate::scene::{BackendChoice, LoadedScene};
use gpu::Gpu;

pub use devices::{Device, DeviceLimits, Devices, devices};
pub(crate) use gpu::{ABSENT, Relaxer};
pub(crate) use stages::Stages;

/// What a scene asks for, as far as it can be settled without a body.
pub(crate) enum Request {
    Settled(Chosen),
    /// The best one for the size of the work.
    Auto,
}

/// How much there is to do, as far as it matters to the choice.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "only a build with GPUs has a choice"))]
pub(crate) struct Work {
    pub(crate) vertices: u64,
    /// What is done at once: constraints, or vertices in vertex block descent.
    pub(crate) element: &'static str,
    /// Of these, all that an iteration goes through.
    pub(crate) elements: u64,
    /// Colors that an iteration executes one after the other.
    pub(crate) sweeps: u64,
    /// Projections of the whole run, or steps of a vertex.
    pub(crate) projections: u64,
    /// Constraints that are evaluated in the whole run: once in a projection, and in the step of a vertex as many as it is in.
    pub(crate) evaluations: u64,
}

/// The backend that will run.
pub(crate) struct Chosen {
    pub(crate) report: Backend,
    place: Place,
    /// What the user should know about it.
    pub(crate) note: Option<String>,
}

enum Place {
    Cpu,
    Reference,
    #[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "there is none to be had"))]
    Gpu(gpu::Device),
}

/// A backend with a body in it.
pub(crate) struct Running {
    pub(crate) solver: Box<dyn Solver<f32>>,
    /// The device that it runs on; the stages after the simulation use it too.
    device: Option<Metered>,
}

/// A device, and what it had done before this run.
pub(crate) struct Metered {
    gpu: Gpu,
    before: DeviceWork,
}

impl Request {
    /// Settles what the scene names.
    ///
    /// # Errors
    /// [`Error::Backend`] if this build or this machine does not have it.
    pub(crate) fn of(loaded: &LoadedScene) -> Result<Self, Error> {
        let reason = "the scene asks for it";
        Ok(match loaded.scene.solver.backend {
            BackendChoice::Auto => Self::Auto,
            BackendChoice::Cpu => Self::Settled(Chosen::cpu(loaded, reason)),
            BackendChoice::Reference => {
                let report = Backend::on_host("reference", 1, reason);
                Self::Settled(Chosen { report, place: Place::Reference, note: None })
            }
            BackendChoice::Gpu => Self::Settled(gpu::asked_for(loaded, reason)?),
        })
    }

    /// Opens the GPU that is asked for by name; none for any other backend, and for `auto`, which weighs the size of a
    /// simulation.
    ///
    /// # Errors
    /// As the device gives them.
    pub(crate) fn open(&self) -> Result<Option<Gpu>, Error> {
        match self {
            Self::Settled(chosen) => chosen.device(),
            Self::Auto => Ok(None),
        }
    }

    /// A device that the caller opened.
    #[cfg(feature = "gpu")]
    pub(crate) fn opened(gpu: &Gpu) -> Self {
        Self::Settled(gpu::opened(gpu))
    }

    /// Settles `auto`.
    ///
    /// # Errors
    /// [`Error::Backend`] if the scene names an adapter that is not there.
    pub(crate) fn settle(self, loaded: &LoadedScene, work: &Work) -> Result<Chosen, Error> {
        match self {
            Self::Settled(chosen) => Ok(chosen),
            Self::Auto => gpu::auto(loaded, work),
        }
    }
}

impl Request {
    /// Settles what ChainMail relaxes on; it propagates on the CPU.
    pub(crate) fn settle_chain(self, loaded: &LoadedScene) -> Chosen {
        match self {
            Self::Settled(chosen) => chosen,
            Self::Auto => {
                let why = "auto: ChainMail propagates on the CPU, and on no GPU was it measured that relaxation there pays";
                Chosen::cpu(loaded, why)
            }
        }
    }
}

impl Chosen {
    /// Threads of ChainMail on the host; none for one queue on one thread.
    pub(crate) fn chain_threads(&self) -> Option<usize> {
        (!matches!(self.place, Place::Reference)).then(|| self.host_threads())
    }

    /// Opens the device that a chain relaxes on, if there is one.
    ///
    /// # Errors
    /// As the device gives them.
    pub(crate) fn start_chain(&self, chain: &Chain) -> Result<Option<(Relaxer, Metered)>, Error> {
        match &self.place {
            Place::Gpu(device) => gpu::start_chain(device, chain).map(Some),
            Place::Cpu | Place::Reference => Ok(None),
        }
    }

    /// Memory that a chain takes on the device, by part; nothing on the host's backends.
    pub(crate) fn chain_memory(&self, chain: &Chain) -> Vec<MemoryPart> {
        match &self.place {
            Place::Gpu(device) => gpu::chain_memory(device, chain),
            Place::Cpu | Place::Reference => Vec::new(),
        }
    }

    /// The CPU backend.
    fn cpu(loaded: &LoadedScene, reason: &str) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
        let threads = Some(loaded.scene.solver.threads).filter(|&n| n > 0).unwrap_or(cores);
        Self { report: Backend::on_host("cpu", threads, reason), place: Place::Cpu, note: None }
    }

    /// True if it will open a device.
    pub(crate) fn on_gpu(&self) -> bool {
        matches!(self.place, Place::Gpu(_))
    }

    /// The same with the device open, if there is one, so that every start uses it.
    ///
    /// # Errors
    /// As the device gives them.
    pub(crate) fn kept_open(self) -> Result<Self, Error> {
        Ok(match self.place {
            Place::Gpu(device) => Self { place: Place::Gpu(gpu::kept_open(device)?), ..self },
            Place::Cpu | Place::Reference => self,
        })
    }

    /// The device, if there is one.
    ///
    /// # Errors
    /// As the device gives them.
    pub(crate) fn device(&self) -> Result<Option<Gpu>, Error> {
        match &self.place {
            Place::Gpu(device) => gpu::open(device).map(Some),
            Place::Cpu | Place::Reference => Ok(None),
        }
    }

    /// Threads of the host for work that runs beside the backend.
    pub(crate) fn host_threads(&self) -> usize {
        match self.place {
            Place::Cpu => self.report.threads,
            Place::Reference | Place::Gpu(_) => std::thread::available_parallelism().map_or(1, |n| n.get()),
        }
    }

    /// Memory that it takes on a device, by part; nothing on the host's backends.
    pub(crate) fn device_memory(&self, system: &System<f32>, settings: &Settings) -> Vec<MemoryPart> {
        match &self.place {
            Place::Gpu(device) => gpu::memory(device, system, settings),
            Place::Cpu | Place::Reference => Vec::new(),
        }
    }

    /// Opens the device, if there is one to open, and puts the body into the backend.
    ///
    /// # Errors
    /// As the backend gives them.
    pub(crate) fn start(&self, system: System<f32>, settings: Settings) -> Result<Running, Error> {
        Ok(match &self.place {
            Place::Reference => {
                Running { solver: Box::new(SolverReference::new(system, settings)?), device: None }
            }
            Place::Cpu => {
                let solver = SolverCpu::new(system, settings, Some(self.report.threads))?;
                Running { solver: Box::new(solver), device: None }
            }
            Place::Gpu(device) => gpu::start(device, system, settings)?,
        })
    }
}

impl Running {
    /// Body and device.
    pub(crate) fn into_parts(self) -> (Box<dyn Solver<f32>>, Option<Metered>) {
        (self.solver, self.device)
    }
}

impl Metered {
    pub(crate) fn gpu(&self) -> Gpu {
        self.gpu.clone()
    }

    /// What the device did for this run so far.
    pub(crate) fn work(&self) -> DeviceWork {
        let now = gpu::work(&self.gpu);
        DeviceWork {
            kernels: now.kernels - self.before.kernels,
            submits: now.submits - self.before.submits,
            dispatches: now.dispatches - self.before.dispatches,
            readbacks: now.readbacks - self.before.readbacks,
            readback_bytes: now.readback_bytes - self.before.readback_bytes,
        }
    }
}

impl Backend {
    fn on_host(name: &str, threads: usize, reason: &str) -> Self {
        Self {
            name: name.into(),
            adapter: None,
            adapter_kind: None,
            driver: None,
            threads,
            reason: reason.into(),
        }
    }
}
