//! Input validation and its error messages, the state after numbers that overflow, and
//! measurements.

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{Distance, Scalar, Volume};
use cutis_solver::{
    Formulation, Handle, Settings, Solver, SolverError, SolverReference, Stiffness, SystemBuilder, Values,
};
use nalgebra::{Point3, Vector3};

const EDGES: [[u32; 2]; 2] = [[0, 1], [1, 2]];

fn points() -> [Point3<f64>; 3] {
    [Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0)]
}

fn builder() -> SystemBuilder<f64> {
    SystemBuilder::new(&points(), &[0.0, 1.0, 1.0]).unwrap()
}

fn add(
    edges: &[[u32; 2]],
    lengths: &[[f64; 1]],
    stiffness: Stiffness<f64>,
    groups: &Groups,
) -> Option<SolverError> {
    builder().add::<Distance, 2>(edges, lengths, stiffness, groups).err()
}

fn groups() -> Groups {
    greedy(&EDGES, 3).unwrap()
}

fn soft() -> Stiffness<f64> {
    Stiffness::compliance(0.1)
}

#[test]
fn errors_name_invalid_vertices() {
    let mut points = points();
    points[2].y = f64::NAN;
    let error = SystemBuilder::<f64>::new(&points, &[1.0; 3]).err().unwrap();
    assert!(matches!(error, SolverError::Vertex { vertex: 2, what: "coordinate", .. }), "{error}");
    // This is finite in double precision but not in single precision.
    points[2].y = 1e300;
    let error = SystemBuilder::<f32>::new(&points, &[1.0; 3]).err().unwrap();
    assert!(matches!(error, SolverError::Vertex { vertex: 2, what: "coordinate", .. }), "{error}");
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        let error = SystemBuilder::<f64>::new(&self::points(), &[1.0, bad, 1.0]).err().unwrap();
        assert!(matches!(error, SolverError::Vertex { vertex: 1, what: "inverse mass", .. }), "{error}");
    }
    let error = SystemBuilder::<f64>::new(&self::points(), &[1.0; 2]).err().unwrap();
    assert_eq!(error.to_string(), "inverse_masses has 2 entries; expected 3, one per vertex");
    let error = builder().velocities(&[Vector3::zeros(); 4]).err().unwrap();
    assert!(matches!(error, SolverError::VertexLength { what: "velocities", found: 4, expected: 3 }));
    let error = builder().velocities(&[Vector3::repeat(f64::NAN); 3]).err().unwrap();
    assert!(matches!(error, SolverError::Vertex { vertex: 0, what: "velocity", .. }));
}

#[test]
fn errors_name_invalid_constraints() {
    let error = add(&[[0, 1], [1, 3]], &[[1.0]; 2], soft(), &groups()).unwrap();
    assert_eq!(error.to_string(), "distance constraint 1 refers to vertex 3, but there are 3 vertices");
    let error = add(&[[0, 1], [2, 2]], &[[1.0]; 2], soft(), &groups()).unwrap();
    assert!(matches!(error, SolverError::RepeatedVertex { constraint: 1, vertex: 2, .. }), "{error}");
    let error = add(&EDGES, &[[1.0]], soft(), &groups()).unwrap();
    assert!(matches!(error, SolverError::KindLength { found: 1, expected: 2, .. }), "{error}");
    let error = add(&EDGES, &[[1.0], [f64::INFINITY]], soft(), &groups()).unwrap();
    assert!(matches!(error, SolverError::Parameter { constraint: 1, parameter: 0, .. }), "{error}");
    // Both edges in one group is wrong because they share vertex 1. The other group is wrong
    // because it contains an edge twice.
    for (order, offsets) in [(vec![0, 1], vec![0, 2]), (vec![0, 0], vec![0, 1, 2])] {
        let error = add(&EDGES, &[[1.0]; 2], soft(), &Groups { order, offsets }).unwrap();
        assert!(matches!(error, SolverError::Groups { kind: "distance", .. }), "{error}");
    }
    let tets = [[0, 1, 2, 7]];
    let groups = greedy(&tets, 8).unwrap();
    let error =
        builder().add_from_rest::<Volume, 4>(&tets, &Default::default(), soft(), &groups).err().unwrap();
    assert!(matches!(error, SolverError::VertexOutOfRange { kind: "volume", vertex: 7, .. }), "{error}");
}

#[test]
fn errors_name_invalid_stiffnesses() {
    let bad = [
        (Stiffness::compliance(-1.0), None),
        (Stiffness::compliance(f64::NAN), None),
        (Stiffness::compliance(f64::INFINITY), None),
        (Stiffness::pbd(1.1), None),
        (Stiffness::pbd(f64::NAN), None),
        (Stiffness::Pbd(Values::Each(vec![0.5, -0.1])), Some(1)),
        (Stiffness::Compliance(Values::Each(vec![-1.0, 0.1])), Some(0)),
    ];
    for (stiffness, expected) in bad {
        let error = add(&EDGES, &[[1.0]; 2], stiffness, &groups()).unwrap();
        let SolverError::Stiffness { constraint, .. } = error else { panic!("{error}") };
        assert_eq!(constraint, expected);
    }
    let short = Stiffness::Compliance(Values::Each(vec![0.1]));
    let error = add(&EDGES, &[[1.0]; 2], short, &groups()).unwrap();
    assert!(matches!(error, SolverError::KindLength { what: "stiffness values", .. }), "{error}");
    let system = builder().add::<Distance, 2>(&EDGES, &[[1.0]; 2], soft(), &groups()).unwrap().build();
    let settings = Settings { formulation: Formulation::Pbd, ..Settings::default() };
    let error = SolverReference::new(system, settings).err().unwrap();
    assert!(matches!(error, SolverError::Formulation { kind: "distance", .. }), "{error}");
}

#[test]
fn errors_name_invalid_handles() {
    let handle = |vertices: &[u32], over_s| Handle {
        vertices: vertices.to_vec(),
        move_m: [1.0; 3],
        at_s: 0.0,
        over_s,
    };
    let error = builder().handle(handle(&[1, 3], 1.0)).err().unwrap();
    assert!(matches!(error, SolverError::Handle { handle: 0, vertex: 3, .. }), "{error}");
    let error = builder().handle(handle(&[1, 1], 1.0)).err().unwrap();
    assert!(matches!(error, SolverError::Handle { handle: 0, vertex: 1, .. }), "{error}");
    let error = builder().handle(handle(&[1], 1.0)).unwrap().handle(handle(&[2, 1], 1.0)).err().unwrap();
    assert!(matches!(error, SolverError::Handle { handle: 1, vertex: 1, .. }), "{error}");
    for over_s in [-1.0, f64::NAN] {
        assert!(matches!(builder().handle(handle(&[1], over_s)).err(), Some(SolverError::Setting { .. })));
    }
}

#[test]
fn a_handle_moves_its_vertices_along_the_path_and_holds_them() {
    let handle = Handle { vertices: vec![2], move_m: [0.0, 3.0, 0.0], at_s: 0.0, over_s: 1.5 };
    let system = builder().handle(handle).unwrap().build();
    let settings = Settings { dt_s: 0.5, substeps: 2, gravity_m_s2: [0.0, -1.0, 0.0], ..Settings::default() };
    let mut solver = SolverReference::new(system, settings).unwrap();
    let heights: Vec<f64> = (0..5)
        .map(|_| {
            solver.step(1).unwrap();
            solver.positions().unwrap()[2].y
        })
        .collect();
    assert_eq!(heights, [1.0, 2.0, 3.0, 3.0, 3.0]);
    assert!(solver.positions().unwrap()[1].y < 0.0, "a vertex without a handle falls");
}

#[test]
fn a_body_far_from_the_origin_keeps_its_coordinates_and_its_precision() {
    let offset = Vector3::new(1e4, -3e4, 0.0);
    let positions: Vec<Point3<f32>> = points().iter().map(|p| (p + offset).map(|x| x as f32)).collect();
    let system = SystemBuilder::<f32>::new(&positions, &[1.0; 3]).unwrap().build();
    assert_eq!(system.positions(), positions);
    assert!(system.vertices().iter().all(|vertex| vertex.position().coords.norm() < 2.0));
    let near: Vec<Point3<f32>> = points().iter().map(|p| p.map(|x| x as f32 + 0.1)).collect();
    let system = SystemBuilder::<f32>::new(&near, &[1.0; 3]).unwrap().build();
    assert_eq!((system.positions(), system.origin().y), (near, 0.1));
}

#[test]
fn overflow_names_the_vertex_and_restores_the_state_before() {
    let velocities = [Vector3::zeros(), Vector3::zeros(), Vector3::new(1e38f32, 0.0, 0.0)];
    let system =
        SystemBuilder::<f32>::new(&points(), &[0.0, 1.0, 1.0]).unwrap().velocities(&velocities).unwrap();
    let settings = Settings { dt_s: 12.0, substeps: 6, ..Settings::default() };
    let mut solver = SolverReference::new(system.build(), settings).unwrap();
    let error = solver.step(5).unwrap_err();
    assert_eq!(error, SolverError::NotFinite { vertex: 2, frame: 0, substep: 1, time_s: 2.0 });
    let kept = solver.positions().unwrap();
    assert_eq!(kept[2].x, 2e38);
    assert!(solver.velocities().unwrap().iter().all(|v| *v == Vector3::zeros()));
    assert_eq!(solver.time_s(), 2.0);
    solver.step(1).unwrap();
    assert_eq!(solver.positions().unwrap(), kept, "a body at rest stays in place");
}

/// Vertex block descent leaves out steps that are not finite, so it must not begin with a gravity
/// that overflows. The same gravity is small enough for a wider number type.
#[test]
fn descent_refuses_a_gravity_that_overflows() {
    fn found<T: Scalar>(gravity: f64) -> Option<SolverError> {
        let system = SystemBuilder::<T>::new(&points(), &[0.0, 1.0, 1.0]).unwrap().build();
        let formulation = Formulation::Vbd;
        let settings = Settings { formulation, gravity_m_s2: [0.0, gravity, 0.0], ..Settings::default() };
        SolverReference::new(system, settings).err()
    }
    let is_refused = |error| matches!(error, Some(SolverError::Setting { key: "gravity_m_s2", .. }));
    assert!(is_refused(found::<f32>(-1e30)) && is_refused(found::<f64>(1e300)));
    let message = found::<f64>(1e300).unwrap().to_string();
    assert!(message.starts_with("gravity_m_s2 is 1e300; expected"), "{message}");
    assert_eq!((found::<f32>(-9.81), found::<f64>(-1e30)), (None, None));
}

#[test]
fn measurements_agree_with_closed_forms() {
    let velocities = [Vector3::zeros(), Vector3::new(0.0, 2.0, 0.0), Vector3::new(0.0, -2.0, 0.0)];
    let system = SystemBuilder::<f64>::new(&points(), &[0.0, 0.5, 0.25])
        .unwrap()
        .velocities(&velocities)
        .unwrap()
        .add::<Distance, 2>(&EDGES, &[[0.5], [2.0]], soft(), &groups())
        .unwrap()
        .build();
    let energy = system.energy([-10.0, 0.0, 0.0]);
    assert_eq!((energy.kinetic_j, energy.gravity_j), (4.0 + 8.0, 20.0 + 80.0));
    // Stretches 0.5 and −1 on compliance 0.1.
    assert!((energy.elastic_j.unwrap() - (0.25 + 1.0) / 0.2).abs() < 1e-12);
    let momentum = system.momentum();
    assert_eq!(momentum.linear, Vector3::new(0.0, 4.0 - 8.0, 0.0));
    assert_eq!(momentum.center.x, (2.0 + 8.0) / 6.0);
    // The moments about the center of mass, 5/3, are −2/3·4 and −1/3·8.
    assert!((momentum.angular.z + 16.0 / 3.0).abs() < 1e-12, "{momentum:?}");
    let residual = system.residuals()[0];
    assert_eq!((residual.name, residual.max), ("distance", 1.0));
    assert!((residual.rms - (0.625f64).sqrt()).abs() < 1e-12);
    let moved: Vec<Point3<f32>> =
        points().iter().map(|p| (p + Vector3::z() * 3.0).map(|x| x as f32)).collect();
    assert_eq!(system.max_displacement(&moved).unwrap(), 3.0);
    assert!(system.max_displacement(&moved[1..]).is_err());
}

#[test]
fn errors_name_rest_shapes_of_size_zero() {
    let mut points = points().to_vec();
    points[2] = points[1];
    points.push(Point3::new(0.0, 1.0, 0.0));
    let builder = || SystemBuilder::<f64>::new(&points, &[1.0; 4]).unwrap();
    let error = builder().add_from_rest::<Distance, 2>(&EDGES, &Default::default(), soft(), &groups());
    let error = error.err().unwrap();
    assert_eq!(error, SolverError::RestShape { kind: "distance", constraint: 1, vertices: vec![1, 2] });
    let flat = [[0, 1, 2, 3]];
    let groups = greedy(&flat, 4).unwrap();
    let error = builder().add_from_rest::<Volume, 4>(&flat, &Default::default(), soft(), &groups);
    assert!(matches!(error.err(), Some(SolverError::RestShape { kind: "volume", constraint: 0, .. })));
    // An explicit rest length of zero is valid.
    assert!(add(&EDGES, &[[0.0], [1.0]], soft(), &self::groups()).is_none());
}

#[test]
fn only_a_collapsed_constraint_is_reported() {
    let system = |points: &[Point3<f64>], masses: &[f64; 3], lengths: &[[f64; 1]]| {
        let builder = SystemBuilder::<f64>::new(points, masses).unwrap();
        builder.add::<Distance, 2>(&EDGES, lengths, soft(), &groups()).unwrap().build()
    };
    let mut together = points();
    together[2] = together[1];
    let error = system(&together, &[0.0, 0.0, 1.0], &[[1.0], [2.0]]).check_collapsed(0.1);
    assert_eq!(
        error,
        Err(SolverError::Collapsed { kind: "distance", vertices: vec![1, 2], ratio: -1.0 }),
        "the first edge is at rest, and the second has no direction"
    );
    assert_eq!(
        system(&together, &[0.0; 3], &[[1.0], [2.0]]).check_collapsed(0.1),
        Ok(()),
        "no vertex can move"
    );
    assert_eq!(system(&together, &[1.0; 3], &[[1.0], [0.0]]).check_collapsed(0.1), Ok(()), "at rest");
    assert_eq!(
        system(&points(), &[1.0; 3], &[[5.0], [5.0]]).check_collapsed(0.1),
        Ok(()),
        "the constraints have gradients"
    );
}
