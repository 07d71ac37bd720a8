//! A body that is only searched for its state of rest.

use cutis_coloring::greedy;
use cutis_constraints::Distance;
use cutis_solver::{
    Change, Formulation, Resting, Settings, Solver, SolverError, SolverReference, Stiffness, System,
    SystemBuilder,
};
use nalgebra::{Point3, Vector3};

fn spring(stiffness: Stiffness<f64>) -> System<f64> {
    let positions = [Point3::origin(), Point3::new(2.0, 0.0, 0.0)];
    let groups = greedy(&[[0, 1]], 2).unwrap();
    SystemBuilder::new(&positions, &[0.0, 1.0])
        .unwrap()
        .add::<Distance, 2>(&[[0, 1]], &[[1.0]], stiffness, &groups)
        .unwrap()
        .build()
}

fn soft() -> System<f64> {
    spring(Stiffness::compliance(0.1))
}

const FORMULATIONS: [Formulation; 2] = [Formulation::Xpbd, Formulation::Vbd];

#[test]
fn it_stores_the_body_alone_and_refuses_frames() {
    for formulation in FORMULATIONS {
        let settings = Settings { formulation, iterations: 2, ..Settings::default() };
        let mut resting = Resting::new(soft(), settings).unwrap();
        assert_eq!(resting.bytes(), soft().bytes());
        assert_eq!(resting.schedule().projections_per_frame(), 0);
        assert_eq!(resting.step(0), Ok(()));
        assert_eq!(resting.step(1), Err(SolverError::Resting));
        // Control: a solver takes the step, and stores more for it.
        let mut solver = SolverReference::new(soft(), settings).unwrap();
        assert!(solver.bytes().len() > soft().bytes().len());
        solver.step(1).unwrap();
        assert_ne!(solver.positions().unwrap(), resting.positions().unwrap());
    }
}

#[test]
fn its_state_and_its_parts_change_as_those_of_a_solver() {
    let load = Vector3::new(0.0, 3.0, 0.0);
    let change = Change {
        kinds: vec![(0, soft().kinds()[0].clone())],
        inverse_masses: vec![(0, 2.0)],
        loads: vec![(1, load)],
        states: vec![[0, 1]],
        handles: Vec::new(),
    };
    for formulation in FORMULATIONS {
        let settings = Settings { formulation, iterations: 2, ..Settings::default() };
        let both: [Box<dyn Solver<f64>>; 2] = [
            Box::new(Resting::new(soft(), settings).unwrap()),
            Box::new(SolverReference::new(soft(), settings).unwrap()),
        ];
        let [found, expected] = both.map(|mut solver| {
            let moved = [Point3::origin(), Point3::new(0.0, 1.0, 0.0)];
            solver.restore(&moved, &[load; 2], 7).unwrap();
            solver.change(&change).unwrap();
            let (time_s, system) = (solver.time_s(), solver.system().unwrap());
            let masses: Vec<f64> = system.vertices().iter().map(|vertex| vertex.inverse_mass()).collect();
            (time_s, system.positions(), system.velocities().to_vec(), system.loads().to_vec(), masses)
        });
        assert_eq!(found, expected);
        assert_eq!(found.1[0], Point3::new(0.0, 1.0, 0.0));
    }
}

#[test]
fn it_refuses_what_a_solver_refuses() {
    let settings = Settings { formulation: Formulation::Vbd, ..Settings::default() };
    let huge = Settings { gravity_m_s2: [1e300, 0.0, 0.0], ..settings };
    let short = Settings { dt_s: 1e-300, ..settings };
    let cases = [
        (spring(Stiffness::compliance(0.0)), settings),
        (spring(Stiffness::pbd(1.0)), settings),
        (soft(), huge),
        (soft(), short),
        (soft(), Settings { substeps: 0, ..settings }),
    ];
    for (system, settings) in cases {
        let expected = SolverReference::new(system.clone(), settings).err();
        assert!(expected.is_some(), "{settings:?}");
        assert_eq!(Resting::new(system, settings).err(), expected);
    }
}
