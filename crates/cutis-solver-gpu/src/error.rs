//! What can go wrong when the backend starts.

use cutis_gpu::GpuError;
use cutis_solver::SolverError;

/// Why a [`SolverGpu`](crate::SolverGpu) could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuSolverError {
    /// The settings do not fit the system.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// The device refused something.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}
