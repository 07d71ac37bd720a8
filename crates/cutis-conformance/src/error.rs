//! Why a check could not be made.

use cutis_gpu::GpuError;
use cutis_solver::SolverError;
use cutis_solver_cpu::CpuError;
use cutis_solver_gpu::GpuSolverError;

/// Why a check could not be made; what a check found wrong is in its [`Report`](crate::Report).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConformanceError {
    /// The environment asks for a GPU and there is none.
    #[error("{variable} is set, so that checks on a GPU may not be skipped: {source}")]
    DeviceRequired {
        /// The variable of the environment.
        variable: &'static str,
        /// What the GPU said.
        source: GpuError,
    },
    /// The GPU failed, or refused the shader.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The body of the check was refused, or a step of it failed.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// The CPU backend did not start.
    #[error(transparent)]
    SolverCpu(#[from] CpuError),
    /// The GPU backend did not start.
    #[error(transparent)]
    SolverGpu(#[from] GpuSolverError),
    /// The constraints could not be grouped.
    #[error(transparent)]
    Coloring(#[from] cutis_coloring::ColoringError),
}
