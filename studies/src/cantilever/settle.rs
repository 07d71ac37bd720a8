//! Runs a solver until the beam is at rest.

use cutis_constraints::Scalar;
use cutis_solver::{Formulation, Settings, Solver, SolverError};
use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::{Beam, GRAVITY_M_S2};

/// Frames in a row in which the end of a beam at rest does not move.
const STILL_FRAMES: usize = 4;

/// Formulation and time stepping of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stepping {
    /// PBD has stiffness 1.
    #[serde(serialize_with = "name")]
    pub formulation: Formulation,
    /// Time of a frame in s.
    pub dt_s: f64,
    /// Substeps of a frame.
    pub substeps: u32,
    /// Iterations of a substep.
    pub iterations: u32,
    /// Damping, 1/s. It acts on velocities only, so that it does not change the state of rest.
    pub damping_per_s: f64,
    /// Largest number of frames.
    pub most_frames: usize,
}

impl Stepping {
    /// Settings for a solver.
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

/// State of a beam at the end of a run.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Rest {
    /// Mean displacement of the end, in lengths of the beam.
    pub displacement: [f64; 3],
    /// True if the beam came to rest.
    pub at_rest: bool,
    /// Simulated time, s.
    pub time_s: f64,
}

/// Angular frequency of the slowest vibration of a slender beam with the sag `sag_m`, 1/s:
/// `3.516·√(g/8)/√sag` (Euler and Bernoulli).
pub fn slowest_per_s(sag_m: f64) -> f64 {
    3.516 * (-GRAVITY_M_S2[1] / (8.0 * sag_m)).sqrt()
}

/// XPBD with substeps that are short compared with the fastest vibration of a cell, for a beam with
/// the sag `sag_m`.
pub fn converged(sag_m: f64, substep_s: f64, iterations: u32) -> Stepping {
    let slowest = slowest_per_s(sag_m);
    let substeps = (1.0 / (slowest * substep_s)).ceil();
    Stepping {
        formulation: Formulation::Xpbd,
        dt_s: substeps * substep_s,
        substeps: substeps as u32,
        iterations,
        damping_per_s: 2.0 * slowest,
        most_frames: 60,
    }
}

/// Runs until the beam is at rest, or for `most_frames`. A beam at rest moves by at most
/// `tolerance` times its displacement in a frame.
///
/// # Errors
/// The run diverges, or a device fails.
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
