//! Puts a system into a backend: the reference solver, the CPU or a GPU, or none for a search
//! for its state of rest.

use cutis_solver::{Resting, Settings, Solver, SolverError, SolverReference, System};
use cutis_solver_cpu::SolverCpu;
#[cfg(feature = "gpu")]
use cutis_solver_gpu::{GpuSolverError, SolverGpu};

use crate::Error;
use crate::backend::{Chosen, DeviceMeter, DevicePositions, Gpu};
use crate::output::report::MemoryPart;

/// A solver with a system in it.
pub(crate) enum StartedSolver {
    Host(Box<dyn Solver<f32>>),
    #[cfg(feature = "gpu")]
    Gpu(Box<SolverGpu>),
}

impl StartedSolver {
    /// A solver that only holds the body, for a search for its state of rest. It runs on the host.
    pub(crate) fn resting(system: System<f32>, settings: Settings) -> Result<Self, SolverError> {
        Ok(Self::Host(Box::new(Resting::new(system, settings)?)))
    }

    pub(crate) fn solver(&mut self) -> &mut dyn Solver<f32> {
        match self {
            Self::Host(solver) => &mut **solver,
            #[cfg(feature = "gpu")]
            Self::Gpu(solver) => &mut **solver,
        }
    }

    /// The solver, for reading only.
    pub(crate) fn reader(&self) -> &dyn Solver<f32> {
        match self {
            Self::Host(solver) => &**solver,
            #[cfg(feature = "gpu")]
            Self::Gpu(solver) => &**solver,
        }
    }

    /// Whether it runs on a GPU.
    pub(crate) fn on_gpu(&self) -> bool {
        !matches!(self, Self::Host(_))
    }

    /// A copy of the present positions that stays on the GPU. `None` on the host, or if the GPU has
    /// too little memory.
    pub(crate) fn positions_on_device(&self) -> Option<DevicePositions> {
        match self {
            Self::Host(_) => None,
            // Positions are relative to the system's origin, which is the frame's origin here.
            #[cfg(feature = "gpu")]
            Self::Gpu(solver) => DevicePositions::copy(solver.gpu(), solver.vertices(), &[]).ok(),
        }
    }
}

/// Opens the device, if the backend is a GPU, and puts the system into the backend.
///
/// # Errors
/// The errors of the backend.
pub(crate) fn start(
    backend: &Chosen,
    system: System<f32>,
    settings: Settings,
) -> Result<(StartedSolver, Option<DeviceMeter>), Error> {
    if let Some(device) = backend.open()? {
        let solver = start_on(device.gpu(), system, settings)?;
        return Ok((solver, Some(device)));
    }
    let solver: Box<dyn Solver<f32>> = if backend.is_reference() {
        Box::new(SolverReference::new(system, settings)?)
    } else {
        Box::new(SolverCpu::new(system, settings, Some(backend.report.threads))?)
    };
    Ok((StartedSolver::Host(solver), None))
}

/// Memory that a system takes on the GPU, by part; none on a CPU backend.
pub(crate) fn device_memory(backend: &Chosen, system: &System<f32>, settings: &Settings) -> Vec<MemoryPart> {
    if backend.on_gpu() { memory_on_gpu(system, settings) } else { Vec::new() }
}

#[cfg(feature = "gpu")]
fn start_on(gpu: &Gpu, system: System<f32>, settings: Settings) -> Result<StartedSolver, Error> {
    let solver = SolverGpu::new(gpu, system, settings).map_err(|error| match error {
        GpuSolverError::Solver(error) => Error::Solver(error),
        GpuSolverError::Gpu(error) => Error::Gpu(error),
        other => Error::Backend { backend: "gpu".into(), why: other.to_string() },
    })?;
    Ok(StartedSolver::Gpu(Box::new(solver)))
}

#[cfg(not(feature = "gpu"))]
fn start_on(gpu: &Gpu, _: System<f32>, _: Settings) -> Result<StartedSolver, Error> {
    match *gpu {}
}

#[cfg(feature = "gpu")]
fn memory_on_gpu(system: &System<f32>, settings: &Settings) -> Vec<MemoryPart> {
    cutis_solver_gpu::device_bytes(system, settings).iter().map(MemoryPart::from).collect()
}

#[cfg(not(feature = "gpu"))]
fn memory_on_gpu(_: &System<f32>, _: &Settings) -> Vec<MemoryPart> {
    Vec::new()
}
