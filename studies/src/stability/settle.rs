//! The search for the state of rest on the bodies of the suite.
//!
//! From its first placement, each body must come to rest or a typed error must say why not. The
//! forces at the end are those of `cutis-newton`, which shares no code with the search.

use std::time::Instant;

use anyhow::bail;
use cutis::rest::{Body, Options};
use cutis_newton::Problem;
use cutis_solver::{Solver, SolverReference, Vertex};
use nalgebra::{Point3, Vector3};

use super::Failure;
use super::case::{Case, End};
use super::energy::Meter;
use super::run::VIOLATED;
use super::trial::{Outcome, Trial};

/// Name of the search in the tables.
pub const NAME: &str = "search for rest";
/// Largest norm of the forces at the end over that at the start.
const BALANCED: f64 = 1e-3;
/// Stated error at which a search ends.
const ERROR: f64 = 1e-6;

/// Searches for the state of rest of a case. `None` for a formulation without energies of its own.
pub fn run(case: &Case, scale: f64) -> Option<Trial> {
    if !case.body.law.is_implicit() {
        return None;
    }
    let start = Instant::now();
    let mut trial = Trial::new(&case.name, NAME, Some(scale));
    trial.outcome = match settle(case, scale, &mut trial) {
        Ok(outcome) => outcome,
        Err(error) => Outcome::Failed(error.to_string()),
    };
    trial.wall_s = start.elapsed().as_secs_f64();
    Some(trial)
}

fn settle(case: &Case, scale: f64, trial: &mut Trial) -> Result<Outcome, Failure> {
    let settings = case.settings(scale);
    let system = case.body.system::<f64>(scale)?;
    let gravity = settings.gravity_m_s2;
    let first: Vec<Point3<f64>> = system.positions();
    let found = Body::of(&system, gravity)
        .and_then(|body| body.settle(&Options { error: ERROR, ..Options::default() }, &mut |_| ()));
    let found = match found {
        Ok(found) => found,
        Err(error) => return Ok(Outcome::Named(error.to_string())),
    };
    if case.end == End::Unmoved && found.positions != first {
        bail!("a vertex has moved");
    }
    if found.energy_change_j.is_nan() || found.energy_change_j > 0.0 {
        bail!("the energy rises by {:e} J", found.energy_change_j);
    }
    let problem = Problem::of(&system, gravity)?;
    // Weight and load of each vertex that can move.
    let weight = |(v, vertex): (usize, &Vertex<f64>)| {
        let load = system.loads().get(v).copied().unwrap_or_default();
        (vertex.inverse_mass() > 0.0).then(|| Vector3::from(gravity) / vertex.inverse_mass() + load)
    };
    let weights: Vec<_> = system.vertices().iter().enumerate().map(weight).collect();
    let norm = |x: &[Point3<f64>]| {
        let forces = problem.forces(x).into_iter().zip(&weights);
        forces.filter_map(|(force, weight)| Some((force + (*weight)?).norm_squared())).sum::<f64>().sqrt()
    };
    let (before, after) = (norm(&first), norm(&found.positions));
    // Forces that cancel to rounding have no norm that could fall.
    if after.is_nan() || (after > BALANCED * before && found.force > 1e-12) {
        bail!("forces of {after:e} N are left of {before:e} N, after {} steps", found.steps.len());
    }
    let rest: Vec<Point3<f64>> = case.body.rest.iter().map(|x| x * scale).collect();
    let mut solver = SolverReference::new(system, settings)?;
    solver.restore(&found.positions, &vec![Vector3::zeros(); rest.len()], 0)?;
    let system = solver.system()?;
    trial.error = Some(Meter::new(system, &rest, &settings).error(system));
    Ok(match system.check_collapsed(VIOLATED) {
        Ok(()) => Outcome::Settled,
        Err(error) => Outcome::Named(error.to_string()),
    })
}
