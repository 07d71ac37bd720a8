//! Running a solver until the beam hangs still.

use cutis_constraints::Scalar;
use cutis_solver::{Formulation, Settings, Solver, SolverError};
use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::{Beam, GRAVITY_M_S2};

/// Frames in a row in which the end of the beam has to stand still.
const STILL_FRAMES: usize = 4;

/// How a solver steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Way {
    /// PBD is with stiffness 1.
    #[serde(serialize_with = "name")]
    pub formulation: Formulation,
    /// Time of a frame in s.
    pub dt_s: f64,
    /// Substeps of a frame.
    pub substeps: u32,
    /// Iterations of a substep.
    pub iterations: u32,
    /// Damping, 1/s. It acts on velocities only and so has no part in where the beam rests.
    pub damping_per_s: f64,
    /// Frames after which the beam should long hang still.
    pub most_frames: usize,
}

impl Way {
    /// As a solver takes it.
    pub fn settings(&self) -> Settings {
        Settings {
            formulation: self.formulation,
            dt_s: self.dt_s,
            substeps: self.substeps,
            iterations: self.iterations,
            gravity_m_s2: GRAVITY_M_S2,
            damping_per_s: self.damping_per_s,
            ..Settings::default()
        }
    }
}

/// Where a beam came to rest.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Rest {
    /// Mean displacement of the end, in lengths of the beam.
    pub displacement: [f64; 3],
    /// Whether the beam stood still when the looking ended.
    pub at_rest: bool,
    /// Simulated time, s.
    pub time_s: f64,
}

/// The slowest swing of a slender beam whose end sinks by `sag_m`, in 1/s: `3.516·√(g/8)/√sag` (Euler and Bernoulli).
pub fn slowest_per_s(sag_m: f64) -> f64 {
    3.516 * (-GRAVITY_M_S2[1] / (8.0 * sag_m)).sqrt()
}

/// A way that comes close to the limit for a beam whose end sinks by `sag_m`: substeps that are short beside the fastest swing of a
/// cell, with so many iterations.
pub fn converged(sag_m: f64, substep_s: f64, iterations: u32) -> Way {
    let slowest = slowest_per_s(sag_m);
    let substeps = (1.0 / (slowest * substep_s)).ceil();
    Way {
        formulation: Formulation::Xpbd,
        dt_s: substeps * substep_s,
        substeps: substeps as u32,
        iterations,
        damping_per_s: 2.0 * slowest,
        most_frames: 60,
    }
}

/// Runs until the end of the beam stands still, or for `most_frames`. Still is what moves in a frame by no more than
/// `tolerance` times its whole displacement.
///
/// # Errors
/// Of the solver: numbers that explode, a device that fails.
pub fn settle<T: Scalar>(
    solver: &mut dyn Solver<T>,
    beam: &Beam,
    tolerance: f64,
    most_frames: usize,
) -> Result<Rest, SolverError> {
    let (mut displacement, mut still) = (Vector3::zeros(), 0);
    for _ in 0..most_frames {
        if still >= STILL_FRAMES {
            break;
        }
        solver.step(1)?;
        let before = displacement;
        displacement = end_displacement(solver, beam)?;
        let moved = (displacement - before).norm();
        still = if moved <= tolerance * displacement.norm() { still + 1 } else { 0 };
    }
    Ok(Rest { displacement: displacement.into(), at_rest: still >= STILL_FRAMES, time_s: solver.time_s() })
}

fn end_displacement<T: Scalar>(solver: &mut dyn Solver<T>, beam: &Beam) -> Result<Vector3<f64>, SolverError> {
    let found = solver.positions_of(&beam.end)?;
    let displacement = |(&v, x): (&u32, &Point3<T>)| x.map(|x| x.to_f64()) - beam.positions[v as usize];
    let sum: Vector3<f64> = beam.end.iter().zip(&found).map(displacement).sum();
    Ok(sum / (beam.end.len() as f64 * beam.length_m))
}

fn name<S: serde::Serializer>(formulation: &Formulation, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(match formulation {
        Formulation::Pbd => "pbd",
        Formulation::Xpbd => "xpbd",
        Formulation::Vbd => "vbd",
    })
}
