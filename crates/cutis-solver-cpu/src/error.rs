//! What can go wrong when the backend starts.

use cutis_solver::SolverError;

/// Why a [`SolverCpu`](crate::SolverCpu) could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CpuError {
    /// The settings do not fit the system.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// A number of threads that makes no sense.
    #[error("threads is {threads}; expected 1 to {highest}")]
    Threads {
        /// What was asked for.
        threads: usize,
        /// The most that is allowed.
        highest: usize,
    },
    /// The operating system refused the threads.
    #[error("{threads} threads could not be started: {reason}")]
    ThreadPool {
        /// How many were asked for.
        threads: usize,
        /// What the thread pool said.
        reason: String,
    },
}
