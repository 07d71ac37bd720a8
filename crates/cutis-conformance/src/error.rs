//! The errors of this crate.

use cutis_gpu::GpuError;
use cutis_solver::SolverError;
use cutis_solver_cpu::CpuError;
use cutis_solver_gpu::GpuSolverError;

/// A check could not be run. Faults that a check found are in its [`Report`](crate::Report).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConformanceError {
    /// An environment variable requires a GPU, and there is none.
    #[error("{variable} is set, so checks on a GPU may not be skipped: {source}")]
    DeviceRequired {
        /// The environment variable.
        variable: &'static str,
        /// The error of the GPU crate.
        source: GpuError,
    },
    /// The GPU failed or refused the shader.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The test body was refused, or a step failed.
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
