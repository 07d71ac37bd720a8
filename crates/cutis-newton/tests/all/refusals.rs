//! Invalid problems are refused, and the error names the fault.

use cutis_coloring::greedy;
use cutis_constraints::Distance;
use cutis_newton::{NewtonError, Options, Problem};
use cutis_solver::{Stiffness, System, SystemBuilder, Values};
use nalgebra::Point3;

use crate::blocks::hanging;
use crate::closed_forms::chain;

const LINE: [Point3<f64>; 3] =
    [Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0)];

fn springs(stiffness: Stiffness<f64>) -> System<f64> {
    let springs = [[0, 1], [1, 2]];
    let groups = greedy(&springs, 3).unwrap();
    let builder = SystemBuilder::<f64>::new(&LINE, &[0.0, 1.0, 1.0]).unwrap();
    builder.add::<Distance, 2>(&springs, &[[1.0]; 2], stiffness, &groups).unwrap().build()
}

fn error(system: &System<f64>) -> NewtonError {
    Problem::of(system, [0.0; 3]).err().expect("the system must be refused")
}

#[test]
fn kinds_without_a_finite_energy_are_refused() {
    assert_eq!(error(&springs(Stiffness::pbd(1.0))), NewtonError::PbdStiffness { kind: "distance" });
    let rigid = error(&springs(Stiffness::Compliance(Values::Each(vec![1.0, 0.0]))));
    assert_eq!(rigid, NewtonError::Rigid { kind: "distance", vertices: vec![1, 2], compliance: 0.0 });
    let tiny = error(&springs(Stiffness::compliance(1e-320)));
    assert!(matches!(tiny, NewtonError::Rigid { .. }), "{tiny}");
}

#[test]
fn a_body_that_cannot_move_is_refused() {
    assert_eq!(error(&chain(&LINE, &[0.0; 3], 1.0, 1.0)), NewtonError::NothingMoves { vertices: 3 });
}

#[test]
fn a_loose_vertex_is_named() {
    let system = SystemBuilder::<f64>::new(&LINE, &[0.0, 1.0, 1.0]).unwrap();
    let springs = [[0, 1]];
    let groups = greedy(&springs, 3).unwrap();
    let system =
        system.add::<Distance, 2>(&springs, &[[1.0]], Stiffness::compliance(1.0), &groups).unwrap().build();
    let problem = Problem::of(&system, [0.0; 3]).unwrap();
    let found = problem.equilibrium(&LINE, &Options::default()).unwrap_err();
    assert_eq!(found, NewtonError::Floating { vertex: 2, vertices: 1 });
    problem.step(&LINE, &LINE, 0.1, &Options::default()).expect("inertia holds the vertex in a step");
}

#[test]
fn invalid_numbers_are_named() {
    let problem = Problem::of(&springs(Stiffness::compliance(1.0)), [0.0; 3]).unwrap();
    let options = Options::default();
    for h in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-200] {
        let found = problem.step(&LINE, &LINE, h, &options).unwrap_err();
        assert!(matches!(found, NewtonError::Value { what: "h", .. }), "{found}");
    }
    for tolerance in [-1.0, 1.0, f64::NAN] {
        let found = problem.equilibrium(&LINE, &Options { tolerance, ..options }).unwrap_err();
        assert!(matches!(found, NewtonError::Value { what: "tolerance", .. }), "{found}");
    }
    let found = problem.equilibrium(&LINE[..2], &options).unwrap_err();
    assert_eq!(found, NewtonError::Length { what: "start", found: 2, expected: 3 });
    let mut broken = LINE;
    broken[2].y = f64::NAN;
    let found = problem.step(&LINE, &broken, 0.1, &options).unwrap_err();
    assert_eq!(found, NewtonError::NotFinite { vertex: 2, what: "predicted" });
    broken[2].y = 1e300;
    let found = problem.equilibrium(&broken, &options).unwrap_err();
    assert!(matches!(found, NewtonError::NotFinite { vertex: 1 | 2, .. }), "{found}");
    let found = Problem::of(&springs(Stiffness::compliance(1.0)), [0.0, f64::NAN, 0.0]).err().unwrap();
    assert!(matches!(found, NewtonError::Value { what: "gravity_m_s2", .. }), "{found}");
}

#[test]
fn too_few_iterations_are_reported_with_numbers() {
    let problem = Problem::of(&hanging(3, 1.0), [0.0, 0.0, -0.1]).unwrap();
    let found =
        problem.equilibrium(problem.positions(), &Options { max_iterations: 1, ..Options::default() });
    let NewtonError::NotConverged { iterations: 1, gradient, tolerance } = found.unwrap_err() else {
        panic!("one iteration cannot suffice")
    };
    assert!(gradient > tolerance && tolerance == 1e-10);
}
