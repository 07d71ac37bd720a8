//! Errors when the backend starts.

use cutis_gpu::GpuError;
use cutis_solver::SolverError;

/// An error in the construction of a [`SolverGpu`](crate::SolverGpu).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuSolverError {
    /// The settings or the system are invalid.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// The device failed, or its limits are too small.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}
