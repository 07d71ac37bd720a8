//! The choice of the backend that runs a scene, and why it was chosen.
//!
//! A backend or adapter that the scene names is looked up before any other work ([`Request::of`]).
//! If it does not exist, the scene is refused. `auto` is decided when the amount of work is known
//! ([`Request::settle`]), so that a small scene never looks for a GPU. No device is opened before
//! [`Chosen::open`].

#[cfg(feature = "gpu")]
mod auto;
mod devices;
#[cfg_attr(not(feature = "gpu"), path = "absent.rs")]
mod gpu;
mod stages;

use crate::Error;
use crate::output::report::{Backend, DeviceWork};
use crate::scene::{BackendChoice, LoadedScene, SceneFile, SolverSection};

pub use devices::{Device, DeviceLimits, Devices, devices};
pub(crate) use gpu::{ABSENT, DevicePositions, Gpu, RestDevice};
pub(crate) use stages::Stages;

/// The backend that a scene requests, as far as it is known before the body is built.
pub(crate) enum Request {
    Settled(Chosen),
    /// The best backend for the size of the work.
    Auto,
}

/// The amount of work, from which `auto` decides.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "only a build with GPUs has a choice"))]
pub(crate) struct Work {
    pub(crate) vertices: u64,
    /// Name of the elements that threads process: constraints, or vertices in vertex block descent.
    pub(crate) element: &'static str,
    /// Number of elements in an iteration.
    pub(crate) elements: u64,
    /// Number of colors that an iteration executes one after the other.
    pub(crate) sweeps: u64,
    /// Number of projections in the whole run, or of vertex steps in vertex block descent.
    pub(crate) projections: u64,
    /// Number of constraint evaluations in the whole run: one per projection, or one for each
    /// constraint of a vertex in each step of that vertex.
    pub(crate) evaluations: u64,
}

/// The backend that will run.
pub(crate) struct Chosen {
    pub(crate) report: Backend,
    place: Place,
    /// A note for the user about this backend.
    pub(crate) note: Option<String>,
}

enum Place {
    Cpu,
    Reference,
    #[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "a build without GPUs never makes one"))]
    Gpu(gpu::Device),
}

/// An open GPU, and the work that it had done before this run.
pub(crate) struct DeviceMeter {
    gpu: Gpu,
    before: DeviceWork,
}

impl Request {
    /// Looks up the backend that the scene names.
    ///
    /// # Errors
    /// [`Error::Backend`] if this build or this machine does not have it.
    pub(crate) fn of(loaded: &LoadedScene) -> Result<Self, Error> {
        let (solver, reason) = (&loaded.scene.solver, "the scene asks for it");
        Ok(match solver.backend {
            BackendChoice::Auto => Self::Auto,
            BackendChoice::Cpu => Self::Settled(Chosen::cpu(solver, reason)),
            BackendChoice::Reference => {
                let report = Backend::on_host("reference", 1, reason);
                Self::Settled(Chosen { report, place: Place::Reference, note: None })
            }
            BackendChoice::Gpu => Self::Settled(gpu::named_by_scene(loaded.file(), solver, reason)?),
        })
    }

    /// Opens the GPU that the scene names. None for any other backend, and for `auto`, which
    /// decides by the size of a simulation.
    ///
    /// # Errors
    /// The errors of the GPU.
    pub(crate) fn open(&self) -> Result<Option<Gpu>, Error> {
        match self {
            Self::Settled(chosen) => chosen.device(),
            Self::Auto => Ok(None),
        }
    }

    /// A GPU that the caller opened.
    #[cfg(feature = "gpu")]
    pub(crate) fn opened(gpu: &Gpu) -> Self {
        Self::Settled(gpu::opened(gpu))
    }

    /// Decides `auto` by the amount of work.
    ///
    /// # Errors
    /// [`Error::Backend`] if the scene names an adapter that does not exist.
    pub(crate) fn settle(
        self,
        file: SceneFile<'_>,
        solver: &SolverSection,
        work: &Work,
    ) -> Result<Chosen, Error> {
        match self {
            Self::Settled(chosen) => Ok(chosen),
            Self::Auto => gpu::auto(file, solver, work),
        }
    }

    /// Decides `auto` for the CPU, with this reason.
    pub(crate) fn settle_on_cpu(self, solver: &SolverSection, reason: &str) -> Chosen {
        match self {
            Self::Settled(chosen) => chosen,
            Self::Auto => Chosen::cpu(solver, reason),
        }
    }
}

impl Chosen {
    /// The CPU backend.
    fn cpu(solver: &SolverSection, reason: &str) -> Self {
        let threads = Some(solver.threads).filter(|&n| n > 0).unwrap_or_else(cores);
        Self { report: Backend::on_host("cpu", threads, reason), place: Place::Cpu, note: None }
    }

    /// Whether it is a GPU.
    pub(crate) fn on_gpu(&self) -> bool {
        matches!(self.place, Place::Gpu(_))
    }

    /// Whether it is the reference solver on one thread.
    pub(crate) fn is_reference(&self) -> bool {
        matches!(self.place, Place::Reference)
    }

    /// `gpu` or `cpu`, the place of work that a report shows for each stage.
    pub(crate) fn place(&self) -> &'static str {
        if self.on_gpu() { "gpu" } else { "cpu" }
    }

    /// The same backend with its GPU open, if it is one, so that every start uses the same GPU.
    ///
    /// # Errors
    /// The errors of the GPU.
    pub(crate) fn kept_open(self) -> Result<Self, Error> {
        Ok(match self.place {
            Place::Gpu(device) => Self { place: Place::Gpu(gpu::kept_open(device)?), ..self },
            Place::Cpu | Place::Reference => self,
        })
    }

    /// Opens the GPU, if it is one.
    ///
    /// # Errors
    /// The errors of the GPU.
    pub(crate) fn device(&self) -> Result<Option<Gpu>, Error> {
        match &self.place {
            Place::Gpu(device) => gpu::open(device).map(Some),
            Place::Cpu | Place::Reference => Ok(None),
        }
    }

    /// Opens the GPU, if it is one, and counts its work from now on.
    ///
    /// # Errors
    /// The errors of the GPU.
    pub(crate) fn open(&self) -> Result<Option<DeviceMeter>, Error> {
        let meter = |gpu| DeviceMeter { before: gpu::work(&gpu), gpu };
        Ok(self.device()?.map(meter))
    }

    /// Threads of the host for work next to the backend.
    pub(crate) fn host_threads(&self) -> usize {
        match self.place {
            Place::Cpu => self.report.threads,
            Place::Reference | Place::Gpu(_) => cores(),
        }
    }
}

impl DeviceMeter {
    pub(crate) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Whether the last pass of the GPU has timestamps.
    pub(crate) fn has_timestamps(&self) -> bool {
        gpu::has_timestamps(&self.gpu)
    }

    /// The work that the GPU has done for this run so far.
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

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}
