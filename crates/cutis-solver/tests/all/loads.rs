//! Loads: constant forces on vertices, and the load that keeps a body under tension at rest.

use cutis_coloring::greedy;
use cutis_constraints::{Distance, Scalar, SkinTension, SkinTensionMaterial};
use cutis_solver::{
    Formulation, Settings, Solver, SolverError, SolverReference, Stiffness, System, SystemBuilder,
};
use cutis_test_kit::Kuhn;
use nalgebra::{Point3, Vector3};

/// One mass of 2 kg on a spring of 1 m and 1e-3 m/N, pulled by `load` along the spring.
fn spring(load: f64) -> System<f64> {
    let positions = [Point3::origin(), Point3::new(1.0, 0.0, 0.0)];
    let tuples = [[0, 1]];
    SystemBuilder::<f64>::new(&positions, &[0.0, 0.5])
        .unwrap()
        .add::<Distance, 2>(&tuples, &[[1.0]], Stiffness::compliance(1e-3), &greedy(&tuples, 2).unwrap())
        .unwrap()
        .loads(&[Vector3::zeros(), Vector3::new(load, 0.0, 0.0)])
        .unwrap()
        .build()
}

fn settings(formulation: Formulation, substeps: u32, iterations: u32) -> Settings {
    Settings { formulation, substeps, iterations, damping_per_s: 20.0, ..Settings::default() }
}

/// A block of tissue under tension on all sides, free except for one face.
fn tense<T: Scalar>() -> System<T> {
    let lattice = Kuhn::new([6, 5, 4], 0.01);
    let count = lattice.positions.len();
    let skin: Vec<[u32; 3]> = lattice.tets.iter().map(|&[a, b, c, _]| [a, b, c]).step_by(3).collect();
    let inverse_masses: Vec<f64> = (0..count).map(|n| if n % 6 == 0 { 0.0 } else { 1000.0 }).collect();
    let tension = SkinTensionMaterial { rest_area_scale: 0.7, amplification: 2.0 };
    SystemBuilder::<T>::new(&lattice.positions, &inverse_masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &Default::default(),
            Stiffness::compliance(T::constant(0.02)),
            &greedy(&lattice.edges, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<SkinTension, 3>(
            &skin,
            &tension,
            Stiffness::compliance(T::constant(1e-5)),
            &greedy(&skin, count).unwrap(),
        )
        .unwrap()
        .build()
}

/// Largest displacement after 200 frames, in m.
fn drift<T: Scalar>(system: System<T>, settings: Settings) -> f64 {
    let start = system.positions();
    let mut solver = SolverReference::new(system, settings).unwrap();
    solver.step(200).unwrap();
    solver.system().unwrap().max_displacement(&start).unwrap()
}

#[test]
fn a_load_stretches_a_spring_by_its_compliance() {
    let load = 20.0;
    let stretch = load * 1e-3;
    for formulation in [Formulation::Xpbd, Formulation::Vbd] {
        for substeps in [1, 7, 50] {
            let mut solver = SolverReference::new(spring(load), settings(formulation, substeps, 1)).unwrap();
            solver.step(800).unwrap();
            let found = solver.positions().unwrap()[1].x - 1.0;
            let error = (found / stretch - 1.0).abs();
            assert!(error < 1e-6, "{formulation:?}, {substeps} substeps: {found} instead of {stretch}");
        }
    }
    let energy = spring(load).energy([0.0; 3]);
    assert_eq!((energy.load_j, energy.total_j()), (-load, -load));
}

#[test]
fn vertex_block_descent_holds_a_tense_body_bit_for_bit() {
    fn held<T: Scalar>() -> System<T> {
        let mut system = tense::<T>();
        let load: Vec<Vector3<T>> = system.constraint_forces().unwrap().iter().map(|force| -force).collect();
        system.set_loads(&load).unwrap();
        system
    }
    for (substeps, iterations) in [(1, 1), (3, 2), (20, 4)] {
        let settings = settings(Formulation::Vbd, substeps, iterations);
        assert_eq!(drift(held::<f32>(), settings), 0.0, "f32, {substeps}×{iterations}");
        assert_eq!(drift(held::<f64>(), settings), 0.0, "f64, {substeps}×{iterations}");
        // Loads that were computed in single precision hold a body in double precision up to the
        // rounding of the loads.
        assert!((1e-12..1e-7).contains(&drift(held::<f32>().to_f64(), settings)));
        // Control: without the load the tension contracts the body by millimeters.
        assert!(drift(tense::<f32>(), settings) > 1e-3);
    }
}

#[test]
fn invalid_loads_are_rejected() {
    let mut system = spring(0.0);
    assert!(system.loads().is_empty(), "loads of zero are not stored");
    let short = system.set_loads(&[Vector3::x()]);
    assert!(matches!(short, Err(SolverError::VertexLength { what: "loads", found: 1, expected: 2 })));
    let nan = system.set_loads(&[Vector3::x(), Vector3::new(0.0, f64::NAN, 0.0)]);
    assert!(matches!(nan, Err(SolverError::Vertex { vertex: 1, what: "load", .. })));
    assert!(system.loads().is_empty(), "the loads are unchanged after an error");
    let positions = [Point3::origin(), Point3::new(1.0, 0.0, 0.0)];
    let groups = greedy(&[[0, 1]], 2).unwrap();
    let pbd = SystemBuilder::<f64>::new(&positions, &[0.0, 1.0])
        .unwrap()
        .add::<Distance, 2>(&[[0, 1]], &[[1.0]], Stiffness::pbd(1.0), &groups)
        .unwrap()
        .build();
    assert!(matches!(pbd.constraint_forces(), Err(SolverError::Formulation { .. })), "PBD has no forces");
}
