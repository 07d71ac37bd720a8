//! A solver of either precision, with the state told in `f64`.

use std::time::Instant;

use cutis_solver::{Solver, SolverError};
use nalgebra::{Point3, Vector3};

/// A body at a moment.
#[derive(Clone)]
pub struct State {
    /// Frames since rest.
    pub frame: u32,
    /// Positions (m), which `f32` holds exactly: every backend starts from the same.
    pub positions: Vec<Point3<f32>>,
    /// Velocities (m/s), likewise.
    pub velocities: Vec<Vector3<f32>>,
}

/// A solver at work.
pub enum Running {
    /// In `f32`.
    Single(Box<dyn Solver<f32>>),
    /// In `f64`.
    Double(Box<dyn Solver<f64>>),
}

impl Running {
    /// Runs one frame; how long that took, in ms. On a GPU until the device is done.
    ///
    /// # Errors
    /// The solver's.
    pub fn frame_ms(&mut self) -> Result<f64, SolverError> {
        let start = Instant::now();
        match self {
            Self::Single(solver) => solver.step(1)?,
            Self::Double(solver) => solver.step(1)?,
        }
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    /// Present positions in m.
    ///
    /// # Errors
    /// A device's.
    pub fn positions(&mut self) -> Result<Vec<Point3<f64>>, SolverError> {
        Ok(match self {
            Self::Single(solver) => solver.positions()?.iter().map(|x| x.cast()).collect(),
            Self::Double(solver) => solver.positions()?,
        })
    }

    /// The present state, rounded.
    ///
    /// # Errors
    /// A device's.
    pub fn state(&mut self, frame: u32) -> Result<State, SolverError> {
        let positions = self.positions()?.iter().map(|x| x.cast()).collect();
        let velocities = match self {
            Self::Single(solver) => solver.velocities()?.to_vec(),
            Self::Double(solver) => solver.velocities()?.iter().map(|v| v.cast()).collect(),
        };
        Ok(State { frame, positions, velocities })
    }

    /// Goes on from `state`, as after `frame` frames of this solver's own length.
    ///
    /// # Errors
    /// The solver's.
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
