//! Errors when the backend starts.

use cutis_solver::SolverError;

/// An error in the construction of a [`SolverCpu`](crate::SolverCpu).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CpuError {
    /// The settings or the system are invalid.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// The number of threads is out of range.
    #[error("threads is {threads}; expected 1 to {highest}")]
    Threads {
        /// The requested number.
        threads: usize,
        /// The largest allowed number.
        highest: usize,
    },
    /// The operating system could not start the threads.
    #[error("{threads} threads could not be started: {reason}")]
    ThreadPool {
        /// The requested number.
        threads: usize,
        /// The error of the thread pool.
        reason: String,
    },
}
