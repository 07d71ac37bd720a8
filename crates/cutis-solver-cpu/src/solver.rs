//! The solver of this backend: a simulation and, if more than one thread is asked for, its own pool.

use cutis_constraints::Scalar;
use cutis_solver::{Execute, Settings, Simulation, Solver, SolverError, StepProfile, System, Timed};
use nalgebra::{Point3, Vector3};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::CpuError;
use crate::parallel::Parallel;

/// More threads than this are a mistake in the input, not a machine.
const MOST_THREADS: usize = 1024;

/// The multi-threaded solver.
pub struct SolverCpu<T: Scalar> {
    simulation: Simulation<T>,
    threads: usize,
    pool: Option<ThreadPool>,
}

impl<T: Scalar> SolverCpu<T> {
    /// A solver for `system` on `threads` threads, by default as many as the machine runs at once. With one thread
    /// there is no pool: the caller's thread does the work.
    ///
    /// # Errors
    /// Settings that cannot be used, a kind with a stiffness of the other formulation, no thread or too many.
    pub fn new(system: System<T>, settings: Settings, threads: Option<usize>) -> Result<Self, CpuError> {
        let simulation = Simulation::new(system, settings)?;
        let available = || std::thread::available_parallelism().map_or(1, usize::from).min(MOST_THREADS);
        let threads = threads.unwrap_or_else(available);
        if !(1..=MOST_THREADS).contains(&threads) {
            return Err(CpuError::Threads { threads, highest: MOST_THREADS });
        }
        let pool = match threads {
            1 => None,
            _ => Some(pool(threads)?),
        };
        Ok(Self { simulation, threads, pool })
    }

    /// Threads that work on a step.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Runs frames on the threads of the pool, by what `wrap` makes of their execution.
    fn run<E: Execute<T>>(
        &mut self,
        frames: usize,
        wrap: impl FnOnce(Parallel) -> E + Send,
    ) -> Result<(), SolverError> {
        let (simulation, threads) = (&mut self.simulation, self.threads);
        let run = || simulation.run(frames, &wrap(Parallel { threads }));
        match &self.pool {
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

    fn step(&mut self, frames: usize) -> Result<(), SolverError> {
        self.run(frames, |parallel| parallel)
    }

    fn step_timed(&mut self, frames: usize, profile: &mut StepProfile) -> Result<(), SolverError> {
        self.run(frames, |parallel| Timed::new(parallel, profile))
    }

    fn restore(
        &mut self,
        positions: &[Point3<T>],
        velocities: &[Vector3<T>],
        frame: u64,
    ) -> Result<(), SolverError> {
        self.simulation.restore(positions, velocities, frame)
    }

    fn simulation(&self) -> &Simulation<T> {
        &self.simulation
    }
}
