//! Cutis in the comparison.

use std::time::Instant;

use anyhow::Context;
use cutis_solver::Solver;
use cutis_solver_cpu::SolverCpu;

use super::beam::Beam;
use super::job::{Job, Order};
use super::turns::{About, Program, Turn};
use crate::kit::Failure;

/// The solver of Cutis with the beam of a job.
pub struct Ours {
    beam: Beam,
    solver: SolverCpu<f32>,
    about: About,
    frames: usize,
}

impl Ours {
    /// Builds the beam and the solver, and runs a first frame.
    ///
    /// # Errors
    /// The solver refuses the beam, or the first frame diverges.
    pub fn new(job: &Job, order: Order, threads: usize) -> Result<Self, Failure> {
        let beam = Beam::new(job.size, order)?;
        let mut solver = SolverCpu::new(beam.system(job)?, job.settings(), Some(threads))?;
        solver.step(1)?;
        let [vertices, edges, tets] = beam.sizes();
        let about = About {
            version: env!("CARGO_PKG_VERSION").into(),
            threads,
            precision: "f32".into(),
            iterations: job.iterations,
            vertices,
            edges,
            tets,
        };
        Ok(Self { beam, solver, about, frames: job.frames })
    }

    /// Runs `turns` turns without a pause. Returns the sag at the end in m.
    ///
    /// # Errors
    /// The beam diverges.
    pub fn sag_after(mut self, turns: usize) -> Result<f64, Failure> {
        (0..turns).map(|_| self.turn()).last().context("no turns")?.map(|turn| turn.sag_m)
    }
}

impl Program for Ours {
    fn about(&mut self) -> Result<About, Failure> {
        Ok(self.about.clone())
    }

    fn turn(&mut self) -> Result<Turn, Failure> {
        let mut ms = f64::INFINITY;
        for _ in 0..self.frames {
            let start = Instant::now();
            self.solver.step(1)?;
            ms = ms.min(1e3 * start.elapsed().as_secs_f64());
        }
        let end = self.solver.positions_of(self.beam.end())?;
        Ok(Turn { ms, sag_m: self.beam.sag_m(&end) })
    }
}
