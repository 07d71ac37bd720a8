//! The solver of this backend: a simulation and, for more than one thread, a thread pool.

use cutis_constraints::{Scalar, SimdLevel};
use cutis_solver::{Change, Execute, Settings, Simulation, Solver, SolverError, StepProfile, System, Timed};
use nalgebra::{Point3, Vector3};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::CpuError;
use crate::parallel::{Parallel, is_shared};

/// Largest accepted number of threads. A larger number is most likely a mistake in the input.
const MAX_THREADS: usize = 1024;

/// The multi-threaded solver. Its results do not depend on the number of threads.
pub struct SolverCpu<T: Scalar> {
    simulation: Simulation<T>,
    threads: usize,
    level: SimdLevel,
    pool: Option<ThreadPool>,
}

impl<T: Scalar> SolverCpu<T> {
    /// Builds a solver for `system` with `threads` threads. `None` uses as many threads as the
    /// machine runs in parallel. With one thread there is no pool, and the calling thread does the
    /// work.
    ///
    /// # Errors
    /// Returns the errors of [`Simulation::new`], [`CpuError::Threads`] for no thread or too many,
    /// and [`CpuError::ThreadPool`] if the operating system cannot start the threads.
    pub fn new(system: System<T>, settings: Settings, threads: Option<usize>) -> Result<Self, CpuError> {
        let simulation = Simulation::new(system, settings)?.with_teams().with_columns();
        let available = || std::thread::available_parallelism().map_or(1, usize::from).min(MAX_THREADS);
        let threads = threads.unwrap_or_else(available);
        if !(1..=MAX_THREADS).contains(&threads) {
            return Err(CpuError::Threads { threads, highest: MAX_THREADS });
        }
        let pool = match threads {
            1 => None,
            _ => Some(pool(threads)?),
        };
        Ok(Self { simulation, threads, level: SimdLevel::best(), pool })
    }

    /// Uses the SIMD lanes of `level` in place of the widest ones. The results are the same.
    pub fn with_level(mut self, level: SimdLevel) -> Self {
        self.level = level;
        self
    }

    /// Returns the number of threads.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Runs frames on the threads of the pool, or on this one if the body is small. `wrap` may add
    /// timing to the executor.
    fn run<E: Execute<T>>(
        &mut self,
        frames: usize,
        wrap: impl FnOnce(Parallel) -> E + Send,
    ) -> Result<(), SolverError> {
        let (simulation, level) = (&mut self.simulation, self.level);
        let pool = self.pool.as_ref().filter(|_| is_shared(simulation));
        let threads = if pool.is_some() { self.threads } else { 1 };
        let run = || simulation.run(frames, &wrap(Parallel { threads, level }));
        match pool {
            Some(pool) => pool.install(run),
            None => run(),
        }
    }
}

fn pool(threads: usize) -> Result<ThreadPool, CpuError> {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|k| format!("cutis-solver-{k}"))
        .build()
        .map_err(|error| CpuError::ThreadPool { threads, reason: error.to_string() })
}

impl<T: Scalar> Solver<T> for SolverCpu<T> {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn simulation(&self) -> &Simulation<T> {
        &self.simulation
    }

    fn step(&mut self, frames: usize) -> Result<(), SolverError> {
        self.run(frames, |parallel| parallel)
    }

    fn step_timed(&mut self, frames: usize, profile: &mut StepProfile) -> Result<(), SolverError> {
        self.run(frames, |parallel| Timed::new(parallel, profile))
    }

    fn restore(&mut self, x: &[Point3<T>], v: &[Vector3<T>], frame: u64) -> Result<(), SolverError> {
        self.simulation.restore(x, v, frame)
    }

    fn change(&mut self, change: &Change<T>) -> Result<(), SolverError> {
        self.simulation.change(change)
    }
}
