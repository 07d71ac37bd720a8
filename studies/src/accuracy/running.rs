//! A solver of either precision behind one interface in `f64`.

use std::time::Instant;

use cutis_solver::{Solver, SolverError};
use nalgebra::{Point3, Vector3};

/// State of a body at one instant.
#[derive(Clone)]
pub struct State {
    /// Frames since the start.
    pub frame: u32,
    /// Positions in m, in `f32` so that every backend starts from the same numbers.
    pub positions: Vec<Point3<f32>>,
    /// Velocities in m/s.
    pub velocities: Vec<Vector3<f32>>,
}

/// A running solver.
pub enum Running {
    /// A solver in `f32`.
    Single(Box<dyn Solver<f32>>),
    /// A solver in `f64`.
    Double(Box<dyn Solver<f64>>),
}

impl Running {
    /// Runs one frame and returns its time in ms. Waits for a GPU.
    ///
    /// # Errors
    /// The solver fails.
    pub fn frame_ms(&mut self) -> Result<f64, SolverError> {
        let start = Instant::now();
        match self {
            Self::Single(solver) => solver.step(1)?,
            Self::Double(solver) => solver.step(1)?,
        }
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    /// Positions in m.
    ///
    /// # Errors
    /// The device fails.
    pub fn positions(&mut self) -> Result<Vec<Point3<f64>>, SolverError> {
        Ok(match self {
            Self::Single(solver) => solver.positions()?.iter().map(|x| x.cast()).collect(),
            Self::Double(solver) => solver.positions()?,
        })
    }

    /// The state, rounded to `f32`.
    ///
    /// # Errors
    /// The device fails.
    pub fn state(&mut self, frame: u32) -> Result<State, SolverError> {
        let positions = self.positions()?.iter().map(|x| x.cast()).collect();
        let velocities = match self {
            Self::Single(solver) => solver.velocities()?.to_vec(),
            Self::Double(solver) => solver.velocities()?.iter().map(|v| v.cast()).collect(),
        };
        Ok(State { frame, positions, velocities })
    }

    /// Restores `state` and sets the number of frames of this solver to `frame`.
    ///
    /// # Errors
    /// The solver refuses the state.
    pub fn restore(&mut self, state: &State, frame: u64) -> Result<(), SolverError> {
        match self {
            Self::Single(solver) => solver.restore(&state.positions, &state.velocities, frame),
            Self::Double(solver) => {
                let positions: Vec<_> = state.positions.iter().map(|x| x.cast()).collect();
                let velocities: Vec<_> = state.velocities.iter().map(|v| v.cast()).collect();
                solver.restore(&positions, &velocities, frame)
            }
        }
    }
}
