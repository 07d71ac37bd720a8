//! Input validation: each wrong input is refused by a typed error that names the element, vertex or
//! key.

use std::fmt::Display;

use cutis_coloring::greedy;
use cutis_constraints::{Distance, MaterialError, SkinStripLaw, SkinStripMaterial, SkinTension, Volume};
use cutis_solver::{
    Formulation, Handle, Settings, Solver, SolverError, SolverReference, Stiffness, System, SystemBuilder,
};
use nalgebra::{Point3, Vector3};

use super::trial::{Outcome, Trial};

/// A wrong input: its name, the attempt to use it, and the test of the error.
type WrongInput<E> = (&'static str, fn() -> Option<E>, fn(&E) -> bool);

const WRONG_INPUTS: &[WrongInput<SolverError>] = &[
    ("a coordinate that is NaN", || coordinate(f64::NAN), names_vertex),
    ("a coordinate that is infinite", || coordinate(f64::INFINITY), names_vertex),
    ("a coordinate beyond f32", || coordinate(1e39), names_vertex),
    ("an inverse mass that is NaN", || mass(f64::NAN), names_vertex),
    ("an inverse mass that is infinite", || mass(f64::INFINITY), names_vertex),
    ("an inverse mass below zero", || mass(-1.0), names_vertex),
    ("a velocity that is NaN", || velocity(f32::NAN), names_vertex),
    ("a velocity that is infinite", || velocity(f32::INFINITY), names_vertex),
    ("a rest length that is NaN", || length(f32::NAN), names_element),
    ("a rest length that is infinite", || length(f32::INFINITY), names_element),
    ("a compliance that is NaN", || compliance(f32::NAN), names_element),
    ("a compliance below zero", || compliance(-1.0), names_element),
    ("a compliance of zero for VBD", || descent(0.0), names_element),
    ("a compliance for VBD whose inverse is beyond f32", || descent(1e-39), names_element),
    (
        "a relaxation of 2 for VBD",
        || settings(|s| (s.formulation, s.relaxation) = (Formulation::Vbd, 2.0)),
        names_key,
    ),
    (
        "a rest edge without length",
        || from_rest([[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        names_element,
    ),
    (
        "a rest triangle without area",
        || from_rest([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        names_element,
    ),
    (
        "a rest tetrahedron without volume",
        || from_rest([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]),
        names_element,
    ),
    ("a restored coordinate that is NaN", || restored(f64::NAN, 0.0), names_vertex),
    ("a restored velocity that is infinite", || restored(0.0, f64::INFINITY), names_vertex),
    ("a handle to infinity", || handle(f64::INFINITY, 1.0), names_key),
    ("a handle over a time that is NaN", || handle(1.0, f64::NAN), names_key),
    ("a handle beyond f32", || handle(1e39, 1.0), names_key),
    ("a time step of zero", || settings(|s| s.dt_s = 0.0), names_key),
    ("a time step that is NaN", || settings(|s| s.dt_s = f64::NAN), names_key),
    ("gravity that is infinite", || settings(|s| s.gravity_m_s2[1] = f64::INFINITY), names_key),
    ("damping that is NaN", || settings(|s| s.damping_per_s = f64::NAN), names_key),
];

const WRONG_STRIPS: &[WrongInput<MaterialError>] = &[
    (
        "a strip whose tension is its modulus",
        || strip(UP, ALONG, SkinStripLaw { tension_n_per_m: 60.0, ..LAW }),
        |error| matches!(error, MaterialError::TensionTooLarge { .. }),
    ),
    (
        "a strip with a tension below zero",
        || strip(UP, ALONG, SkinStripLaw { tension_n_per_m: -1.0, ..LAW }),
        |error| matches!(error, MaterialError::Negative { .. }),
    ),
    (
        "a strip with a modulus that is NaN",
        || strip(UP, ALONG, SkinStripLaw { modulus_n_per_m: f64::NAN, ..LAW }),
        |error| matches!(error, MaterialError::NotPositive { .. }),
    ),
    (
        "a strip with a stiffening that is infinite",
        || strip(UP, ALONG, SkinStripLaw { stiffening: f64::INFINITY, ..LAW }),
        |error| matches!(error, MaterialError::Negative { .. }),
    ),
    (
        "a strip with a compression above 1",
        || strip(UP, ALONG, SkinStripLaw { compression: 1.5, ..LAW }),
        |error| matches!(error, MaterialError::CompressionOutOfRange { .. }),
    ),
    (
        "a strip along the normal of the skin",
        || strip(UP, UP, LAW),
        |error| matches!(error, MaterialError::AlongNormal { .. }),
    ),
    (
        "a strip with a normal of zero",
        || strip([0.0; 3], ALONG, LAW),
        |error| matches!(error, MaterialError::NotADirection { .. }),
    ),
    (
        "a strip along the edge of a triangle that is seen from it",
        || strip(SIDEWAYS, ALONG, LAW),
        |error| matches!(error, MaterialError::NoWidth { .. }),
    ),
];

/// One trial for each wrong input.
pub fn all() -> Vec<Trial> {
    let inputs = WRONG_INPUTS.iter().map(attempt);
    inputs.chain(WRONG_STRIPS.iter().map(attempt)).collect()
}

fn attempt<E: Display>(&(name, attempt, names): &WrongInput<E>) -> Trial {
    let mut trial = Trial::new(name, "builder", None);
    trial.outcome = match attempt() {
        None => Outcome::Failed("the input was accepted".into()),
        Some(error) if !names(&error) => Outcome::Failed(format!("refused by another error: {error}")),
        Some(error) => Outcome::Refused(error.to_string()),
    };
    trial
}

fn names_vertex(error: &SolverError) -> bool {
    matches!(error, SolverError::Vertex { vertex: 1, .. })
}

fn names_element(error: &SolverError) -> bool {
    match error {
        SolverError::Parameter { constraint, .. } | SolverError::RestShape { constraint, .. } => {
            *constraint == 0
        }
        SolverError::Stiffness { constraint, .. } => constraint.is_none_or(|constraint| constraint == 0),
        _ => false,
    }
}

fn names_key(error: &SolverError) -> bool {
    matches!(error, SolverError::Setting { .. })
}

const EDGE: [[u32; 2]; 1] = [[0, 1]];

fn builder() -> Result<SystemBuilder<f32>, SolverError> {
    SystemBuilder::new(&[Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0)], &[1.0, 1.0])
}

fn coordinate(value: f64) -> Option<SolverError> {
    SystemBuilder::<f32>::new(&[Point3::origin(), Point3::new(0.0, value, 0.0)], &[1.0, 1.0]).err()
}

fn mass(value: f64) -> Option<SolverError> {
    SystemBuilder::<f32>::new(&[Point3::<f64>::origin(); 2], &[1.0, value]).err()
}

fn velocity(value: f32) -> Option<SolverError> {
    builder().and_then(|b| b.velocities(&[Vector3::zeros(), Vector3::new(0.0, 0.0, value)])).err()
}

fn spring(length: f32, stiffness: Stiffness<f32>) -> Result<System<f32>, SolverError> {
    let groups = greedy(&EDGE, 2).map_err(|error| groups_refused(&error))?;
    Ok(builder()?.add::<Distance, 2>(&EDGE, &[[length]], stiffness, &groups)?.build())
}

fn length(value: f32) -> Option<SolverError> {
    spring(value, Stiffness::compliance(0.1)).err()
}

fn compliance(value: f32) -> Option<SolverError> {
    spring(1.0, Stiffness::compliance(value)).err()
}

fn descent(value: f32) -> Option<SolverError> {
    let settings = Settings { formulation: Formulation::Vbd, ..Settings::default() };
    spring(1.0, Stiffness::compliance(value)).and_then(|system| SolverReference::new(system, settings)).err()
}

/// The first edge, the first triangle and the tetrahedron of four points, in this order.
fn from_rest(points: [[f64; 3]; 4]) -> Option<SolverError> {
    let add = || {
        let builder = SystemBuilder::<f32>::new(&points.map(Point3::from), &[1.0; 4])?;
        let soft = || Stiffness::compliance(0.1);
        let groups =
            |tuples: Result<_, cutis_coloring::ColoringError>| tuples.map_err(|error| groups_refused(&error));
        let edges = groups(greedy(&[[0, 1]], 4))?;
        let builder = builder.add_from_rest::<Distance, 2>(&[[0, 1]], &Default::default(), soft(), &edges)?;
        let triangles = groups(greedy(&[[0, 1, 2]], 4))?;
        let builder =
            builder.add_from_rest::<SkinTension, 3>(&[[0, 1, 2]], &Default::default(), soft(), &triangles)?;
        let tets = groups(greedy(&[[0, 1, 2, 3]], 4))?;
        builder.add_from_rest::<Volume, 4>(&[[0, 1, 2, 3]], &Default::default(), soft(), &tets)
    };
    add().err()
}

const UP: [f64; 3] = [0.0, 0.0, 1.0];
const SIDEWAYS: [f64; 3] = [0.0, 1.0, 0.0];
const ALONG: [f64; 3] = [1.0, 0.0, 0.0];
const LAW: SkinStripLaw =
    SkinStripLaw { tension_n_per_m: 15.0, modulus_n_per_m: 60.0, stiffening: 0.0, compression: 0.0 };

/// A strip on a triangle that faces up.
fn strip(normal: [f64; 3], direction: [f64; 3], law: SkinStripLaw) -> Option<MaterialError> {
    let triangle = [[0.0; 3], ALONG, [0.0, 1.0, 0.0]].map(Point3::from);
    SkinStripMaterial::new(normal, direction, law).and_then(|material| material.compliance(&triangle)).err()
}

fn groups_refused(error: &impl ToString) -> SolverError {
    SolverError::Groups { kind: "distance", reason: error.to_string() }
}

fn restored(coordinate: f64, velocity: f64) -> Option<SolverError> {
    let solver =
        spring(1.0, Stiffness::compliance(0.1)).and_then(|s| SolverReference::new(s, Settings::default()));
    let restore = |mut solver: SolverReference<f32>| {
        let positions = [Point3::origin(), Point3::new(coordinate as f32, 0.0, 0.0)];
        solver.restore(&positions, &[Vector3::zeros(), Vector3::new(0.0, velocity as f32, 0.0)], 0)
    };
    solver.and_then(restore).err()
}

fn handle(move_m: f64, over_s: f64) -> Option<SolverError> {
    builder()
        .and_then(|b| b.handle(Handle { vertices: vec![1], move_m: [0.0, move_m, 0.0], at_s: 0.0, over_s }))
        .err()
}

fn settings(change: fn(&mut Settings)) -> Option<SolverError> {
    let mut settings = Settings::default();
    change(&mut settings);
    spring(1.0, Stiffness::compliance(0.1)).and_then(|system| SolverReference::new(system, settings)).err()
}
