//! Changes between frames: a changed body continues as one that was built so.

use cutis_coloring::{Groups, greedy};
use cutis_constraints::Distance;
use cutis_solver::{
    Change, Formulation, Handle, Kind, Settings, Solver, SolverError, SolverReference, Stiffness, System,
    SystemBuilder,
};
use nalgebra::{Point3, Vector3};

const CHAIN: [[u32; 2]; 3] = [[0, 1], [1, 2], [2, 3]];

fn points() -> Vec<Point3<f64>> {
    (0..5).map(|n| Point3::new(f64::from(n.min(3)), 0.0, 0.0)).collect()
}

fn builder(inverse_masses: &[f64; 5]) -> SystemBuilder<f64> {
    let colors = Groups::from_colors(&[0, 1, 0, 1, 1]).unwrap();
    SystemBuilder::new(&points(), inverse_masses).unwrap().vertex_groups(colors)
}

/// Springs along a chain, with their compliance.
fn springs(builder: SystemBuilder<f64>, chain: &[[u32; 2]], compliance: f64) -> SystemBuilder<f64> {
    let lengths = vec![[0.9]; chain.len()];
    let groups = greedy(chain, 5).unwrap();
    builder.add::<Distance, 2>(chain, &lengths, Stiffness::compliance(compliance), &groups).unwrap()
}

/// Four masses in a chain, whose last spring is a kind of its own, and a fifth one at the place of
/// the fourth that nothing holds.
fn chain() -> System<f64> {
    springs(springs(builder(&[0.0, 1.0, 1.0, 1.0, 0.0]), &CHAIN[..2], 0.01), &CHAIN[2..], 0.01).build()
}

fn kind(chain: &[[u32; 2]], compliance: f64) -> Kind<f64> {
    springs(builder(&[0.0; 5]), chain, compliance).take_kinds().remove(0)
}

/// The last spring now ends at the fifth mass, which begins where the fourth is. The fourth is
/// held.
fn exchange() -> Change<f64> {
    Change {
        kinds: vec![(1, kind(&[[2, 4]], 0.02))],
        inverse_masses: vec![(3, 0.0), (4, 0.5)],
        loads: vec![(2, Vector3::new(0.0, 3.0, 0.0))],
        states: vec![[4, 3]],
        handles: Vec::new(),
    }
}

fn settings(formulation: Formulation) -> Settings {
    Settings { formulation, substeps: 3, iterations: 2, ..Settings::default() }
}

#[test]
fn a_changed_body_continues_as_one_that_was_built_so() {
    for formulation in [Formulation::Xpbd, Formulation::Vbd] {
        let mut changed = SolverReference::new(chain(), settings(formulation)).unwrap();
        changed.step(7).unwrap();
        let (mut x, mut v) = (changed.positions().unwrap(), changed.velocities().unwrap().to_vec());
        assert_eq!(x[4], points()[4], "nothing moves the fifth mass");
        changed.change(&exchange()).unwrap();
        (x[4], v[4]) = (x[3], v[3]);
        let built = springs(builder(&[0.0, 1.0, 1.0, 0.0, 0.5]), &CHAIN[..2], 0.01);
        let mut system = springs(built, &[[2, 4]], 0.02).build();
        let load = |n: usize| if n == 2 { Vector3::new(0.0, 3.0, 0.0) } else { Vector3::zeros() };
        system.set_loads(&[0, 1, 2, 3, 4].map(load)).unwrap();
        let mut built = SolverReference::new(system, settings(formulation)).unwrap();
        built.restore(&x, &v, 7).unwrap();
        for solver in [&mut changed, &mut built] {
            solver.step(9).unwrap();
        }
        assert_eq!(changed.positions().unwrap(), built.positions().unwrap(), "{formulation:?}");
        assert_eq!(changed.velocities().unwrap(), built.velocities().unwrap(), "{formulation:?}");
        // Control: without the change the fifth mass would stay in its place.
        assert_ne!(changed.positions().unwrap()[4], points()[4]);
    }
}

/// A handle grabs a mass where it is, and the others move as if it had been built there. Control:
/// without the handle the mass moves otherwise.
#[test]
fn a_handle_grabs_a_vertex_where_it_is() {
    for formulation in [Formulation::Xpbd, Formulation::Vbd] {
        let settings = settings(formulation);
        let mut changed = SolverReference::new(chain(), settings).unwrap();
        changed.step(7).unwrap();
        let (x, mut v) = (changed.positions().unwrap(), changed.velocities().unwrap().to_vec());
        assert_ne!(x[2], points()[2]);
        let at_s = changed.time_s();
        let handle = Handle { vertices: vec![2], move_m: [0.0, 0.5, 0.0], at_s, over_s: 2.0 * settings.dt_s };
        changed.change(&Change { handles: vec![handle.clone()], ..Change::default() }).unwrap();
        changed.step(1).unwrap();
        let half = Vector3::new(0.0, 0.25, 0.0);
        assert!((changed.positions().unwrap()[2] - x[2] - half).norm() < 1e-15, "{formulation:?}");
        changed.step(4).unwrap();
        let moved = changed.positions().unwrap();
        assert_eq!(moved[2], x[2] + 2.0 * half, "{formulation:?}");

        let colors = Groups::from_colors(&[0, 1, 0, 1, 1]).unwrap();
        let built = SystemBuilder::new(&x, &[0.0, 1.0, 1.0, 1.0, 0.0]).unwrap().vertex_groups(colors);
        let built = springs(springs(built, &CHAIN[..2], 0.01), &CHAIN[2..], 0.01).handle(handle).unwrap();
        let mut built = SolverReference::new(built.build(), settings).unwrap();
        v[2] = Vector3::zeros();
        built.restore(&x, &v, 7).unwrap();
        built.step(5).unwrap();
        assert_eq!(built.positions().unwrap(), moved, "{formulation:?}");

        let mut free = SolverReference::new(chain(), settings).unwrap();
        free.step(12).unwrap();
        assert_ne!(free.positions().unwrap()[1], moved[1]);
    }
}

#[test]
fn changes_that_do_not_fit_are_refused_and_change_nothing() {
    let handle = Handle { vertices: vec![0], move_m: [0.0; 3], at_s: 0.0, over_s: 1.0 };
    let held = springs(builder(&[0.0, 1.0, 1.0, 1.0, 0.0]), &CHAIN, 0.01).handle(handle).unwrap().build();
    let refuse = |change: Change<f64>, expected: &str| {
        let mut solver = SolverReference::new(held.clone(), settings(Formulation::Vbd)).unwrap();
        let error = solver.change(&change).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
        assert_eq!(solver.system().unwrap().vertices(), held.vertices());
    };
    let none = Change::default;
    refuse(Change { kinds: vec![(1, kind(&CHAIN, 0.01))], ..none() }, "number of a new kind is 1");
    let few = SystemBuilder::<f64>::new(&points()[..4], &[1.0; 4]).unwrap();
    let groups = greedy(&CHAIN, 4).unwrap();
    let few = few.add::<Distance, 2>(&CHAIN, &[[1.0]; 3], Stiffness::compliance(0.1), &groups).unwrap();
    let few = { few }.take_kinds().remove(0);
    refuse(Change { kinds: vec![(0, few)], ..none() }, "4 entries");
    refuse(Change { inverse_masses: vec![(5, 1.0)], ..none() }, "vertex 5");
    refuse(Change { inverse_masses: vec![(1, f64::NAN)], ..none() }, "inverse mass is NaN");
    refuse(Change { inverse_masses: vec![(0, 1.0)], ..none() }, "because a handle moves it");
    refuse(Change { loads: vec![(1, Vector3::repeat(f64::INFINITY))], ..none() }, "load is inf");
    refuse(Change { states: vec![[1, 9]], ..none() }, "vertex 9");
    let grab = |vertices: &[u32], over_s| Handle { vertices: vertices.to_vec(), over_s, ..Handle::default() };
    refuse(Change { handles: vec![grab(&[1, 7], 1.0)], ..none() }, "vertex 7");
    refuse(Change { handles: vec![grab(&[0], 1.0)], ..none() }, "already moved by another handle");
    let twice = vec![grab(&[1], 1.0), grab(&[2, 1], 1.0)];
    refuse(Change { handles: twice, ..none() }, "already moved by another handle");
    refuse(Change { handles: vec![grab(&[1], f64::NAN)], ..none() }, "over_s");
}

/// A mass that begins to move must have a color of its own among its neighbors, in all kinds.
#[test]
fn a_vertex_that_begins_to_move_is_checked_for_its_color() {
    let colors = Groups::from_colors(&[0, 1, 0, 0, 1]).unwrap();
    let builder = SystemBuilder::new(&points(), &[0.0, 1.0, 1.0, 0.0, 0.0]).unwrap().vertex_groups(colors);
    let system = springs(builder, &CHAIN, 0.01).build();
    let mut solver = SolverReference::new(system, settings(Formulation::Vbd)).unwrap();
    let change = Change { inverse_masses: vec![(3, 1.0)], ..Change::default() };
    assert!(matches!(solver.change(&change).unwrap_err(), SolverError::Groups { .. }));
}
