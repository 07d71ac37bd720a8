//! The backend against the reference solver: equal bit for bit, for any number of threads.

use std::time::Instant;

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{Distance, Scalar, SimdLevel, SkinTension, SkinTensionMaterial, Volume};
use cutis_solver::{
    Change, Formulation, Handle, Settings, Solver, SolverError, SolverReference, StepProfile, Stiffness,
    System, SystemBuilder, Values,
};
use cutis_solver_cpu::{CpuError, SolverCpu};
use cutis_test_kit::Kuhn;
use nalgebra::{Point3, Vector3};

/// A block with several chunks of every color and several blocks of vertices. It has all kinds of
/// constraints, one fixed face, and a handle that moves an edge.
fn body<T: Scalar>(formulation: Formulation) -> System<T> {
    let lattice = Kuhn::new([40, 24, 20], 0.1);
    let count = lattice.positions.len();
    let masses: Vec<f64> = (0..count).map(|n| (n % 40).min(1) as f64 * (0.5 + (n % 7) as f64)).collect();
    let held = (0..count as u32).filter(|n| n % 40 == 39 && (n / 40) % 24 == 0).collect();
    let skin: Vec<[u32; 3]> = lattice.tets.iter().map(|&[a, b, c, _]| [a, b, c]).step_by(5).collect();
    let each = |count: usize, unit: f64| {
        let value = |n: usize| (1 + n % 3) as f64;
        match formulation {
            Formulation::Pbd => {
                Stiffness::Pbd(Values::Each((0..count).map(|n| T::constant(0.3 * value(n))).collect()))
            }
            Formulation::Xpbd | Formulation::Vbd => Stiffness::Compliance(Values::Each(
                (0..count).map(|n| T::constant(unit * value(n))).collect(),
            )),
        }
    };
    let material = SkinTensionMaterial { rest_area_scale: 0.8, amplification: 2.0 };
    SystemBuilder::<T>::new(&lattice.positions, &masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &Default::default(),
            each(lattice.edges.len(), 1e-3),
            &greedy(&lattice.edges, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<SkinTension, 3>(
            &skin,
            &material,
            each(skin.len(), 1e-5),
            &greedy(&skin, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<Volume, 4>(
            &lattice.tets,
            &Default::default(),
            each(lattice.tets.len(), 1e-7),
            &greedy(&lattice.tets, count).unwrap(),
        )
        .unwrap()
        .handle(Handle { vertices: held, move_m: [0.1, 0.2, 0.0], at_s: 0.0, over_s: 0.03 })
        .unwrap()
        .loads(&(0..count).map(|n| Vector3::x() * T::constant((n % 5) as f64)).collect::<Vec<_>>())
        .unwrap()
        .build()
}

fn settings(formulation: Formulation, iterations: u32) -> Settings {
    let (dt_s, substeps, damping_per_s) = (0.01, 2, 0.5);
    let relaxation = if formulation == Formulation::Vbd { 1.3 } else { 1.0 };
    let gravity_m_s2 = [0.0, -9.81, 0.0];
    Settings { formulation, dt_s, substeps, iterations, gravity_m_s2, damping_per_s, relaxation }
}

/// Positions and velocities after three frames, as bits.
fn bits<T: Scalar>(mut solver: impl Solver<T>, calls: &[usize]) -> Vec<u64> {
    for &frames in calls {
        solver.step(frames).unwrap();
    }
    let positions = solver.positions().unwrap();
    let numbers = positions.iter().map(|p| p.coords).chain(solver.velocities().unwrap().iter().copied());
    numbers.flat_map(|v| [v.x, v.y, v.z].map(|x| x.to_f64().to_bits())).collect()
}

fn parity<T: Scalar>(formulation: Formulation, iterations: u32) {
    let settings = settings(formulation, iterations);
    let reference = bits(SolverReference::new(body::<T>(formulation), settings).unwrap(), &[3]);
    for level in SimdLevel::available() {
        let threads: &[usize] = if level == SimdLevel::best() { &[1, 2, 3, 8] } else { &[2] };
        for &threads in threads {
            let solver = SolverCpu::new(body::<T>(formulation), settings, Some(threads)).unwrap();
            let found = bits(solver.with_level(level), &[1, 2]);
            assert!(found == reference, "{threads} threads, {level:?}, {formulation:?}");
        }
    }
    // Control: another number of iterations gives other bits.
    let other = Settings { iterations: iterations + 1, ..settings };
    assert!(bits(SolverReference::new(body::<T>(formulation), other).unwrap(), &[3]) != reference);
}

#[test]
fn results_equal_the_reference_for_any_number_of_threads_and_lanes() {
    parity::<f32>(Formulation::Pbd, 2);
    parity::<f32>(Formulation::Xpbd, 1);
    parity::<f32>(Formulation::Xpbd, 3);
    parity::<f64>(Formulation::Xpbd, 2);
    parity::<f32>(Formulation::Vbd, 1);
    parity::<f32>(Formulation::Vbd, 3);
    parity::<f64>(Formulation::Vbd, 2);
}

/// In a lattice most vertices are in teams, which vertex block descent moves together, and most
/// constraints are in rows, which projections read by column.
#[test]
fn a_lattice_has_the_bits_of_the_reference() {
    for (formulation, iterations) in
        [(Formulation::Vbd, 2), (Formulation::Xpbd, 1), (Formulation::Xpbd, 2), (Formulation::Pbd, 2)]
    {
        assert_lattice(settings(formulation, iterations));
    }
}

fn assert_lattice(settings: Settings) {
    let lattice = Kuhn::new([40, 5, 5], 0.1);
    let masses: Vec<f32> = lattice.positions.iter().map(|p| if p.x == 0.0 { 0.0 } else { 1.0 }).collect();
    let groups = |colors: &[u16]| Groups::from_colors(colors).unwrap();
    let each = |base: f32, count: usize| {
        let values = (0..count).map(|n| 1.0 + (n % 7) as f32);
        match settings.formulation {
            Formulation::Pbd => Stiffness::Pbd(Values::Each(values.map(|value| 0.1 * value).collect())),
            _ => Stiffness::Compliance(Values::Each(values.map(|value| base * value).collect())),
        }
    };
    let sum = |p: &Point3<f64>| ((p.x + p.y + p.z) / 0.1).round() as u16 % 4;
    let colors: Vec<u16> = lattice.positions.iter().map(sum).collect();
    let system = SystemBuilder::<f32>::new(&lattice.positions, &masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &Default::default(),
            each(1e-4, lattice.edges.len()),
            &groups(&lattice.edge_colors),
        )
        .unwrap()
        .add_from_rest::<Volume, 4>(
            &lattice.tets,
            &Default::default(),
            each(1e-7, lattice.tets.len()),
            &groups(&lattice.tet_colors),
        )
        .unwrap()
        .vertex_groups(groups(&colors))
        .handle(Handle { vertices: vec![39, 79, 84], move_m: [0.1, 0.2, 0.0], at_s: 0.0, over_s: 0.03 })
        .unwrap()
        .build();
    let reference = || SolverReference::new(system.clone(), settings).unwrap();
    // A change that removes some edges ends the runs there.
    let (edges, colors): (Vec<[u32; 2]>, Vec<u16>) = lattice
        .edges
        .iter()
        .zip(&lattice.edge_colors)
        .filter(|(edge, _)| edge[0] % 11 != 3)
        .map(|(edge, color)| (*edge, *color))
        .unzip();
    let kinds = SystemBuilder::<f32>::new(&lattice.positions, &masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(&edges, &Default::default(), each(1e-4, edges.len()), &groups(&colors))
        .unwrap()
        .take_kinds();
    let change = Change { kinds: kinds.into_iter().map(|kind| (0, kind)).collect(), ..Change::default() };
    let changed = |mut solver: Box<dyn Solver<f32>>| {
        solver.step(1).unwrap();
        solver.change(&change).unwrap();
        solver.step(2).unwrap();
        solver.positions().unwrap().iter().map(|p| p.coords.map(f32::to_bits)).collect::<Vec<_>>()
    };
    let descends = settings.formulation == Formulation::Vbd;
    for level in SimdLevel::available() {
        let solver = || SolverCpu::new(system.clone(), settings, Some(2)).unwrap().with_level(level);
        let simulation = solver();
        let simulation = simulation.simulation();
        assert_eq!((simulation.team_bytes() > 0, simulation.column_bytes() > 0), (descends, !descends));
        assert!(bits(solver(), &[3]) == bits(reference(), &[3]), "{level:?}");
        assert!(changed(Box::new(solver())) == changed(Box::new(reference())), "{level:?}, after a change");
    }
    let other = Settings { dt_s: 1.001 * settings.dt_s, ..settings };
    let control = SolverReference::new(system.clone(), other).unwrap();
    assert!(bits(control, &[3]) != bits(reference(), &[3]), "control");
}

/// After a step that is not finite the body is at the start of the substep, at rest.
#[test]
fn a_body_that_is_not_finite_returns_to_the_same_state() {
    let lattice = Kuhn::new([40, 5, 5], 0.1);
    // The largest velocity leaves the range of the number type in one substep.
    let settings = Settings { dt_s: 10.0, substeps: 1, ..settings(Formulation::Xpbd, 1) };
    let groups = Groups::from_colors(&lattice.edge_colors).unwrap();
    let system = SystemBuilder::<f32>::new(&lattice.positions, &vec![1.0; lattice.positions.len()])
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &Default::default(),
            Stiffness::compliance(1e-4),
            &groups,
        )
        .unwrap()
        .build();
    let state = |mut solver: Box<dyn Solver<f32>>| {
        solver.step(1).unwrap();
        let (positions, mut velocities) =
            (solver.positions().unwrap(), solver.velocities().unwrap().to_vec());
        velocities[777].y = f32::MAX;
        velocities[778].x = f32::MAX;
        solver.restore(&positions, &velocities, 1).unwrap();
        let error = solver.step(1).unwrap_err();
        let stopped = (solver.positions().unwrap(), solver.velocities().unwrap().to_vec());
        solver.step(1).unwrap();
        (error.to_string(), stopped, solver.positions().unwrap())
    };
    let expected = state(Box::new(SolverReference::new(system.clone(), settings).unwrap()));
    for threads in [1, 3] {
        let solver = SolverCpu::new(system.clone(), settings, Some(threads)).unwrap();
        assert!(solver.simulation().column_bytes() > 0);
        assert_eq!(state(Box::new(solver)), expected);
    }
}

#[test]
fn a_run_from_a_saved_state_has_the_same_bits() {
    for formulation in [Formulation::Xpbd, Formulation::Vbd] {
        assert_continues(formulation);
    }
}

fn assert_continues(formulation: Formulation) {
    let settings = settings(formulation, 1);
    let new = || SolverCpu::new(body::<f32>(formulation), settings, Some(2)).unwrap();
    let whole = bits(new(), &[3]);
    let mut first = new();
    first.step(2).unwrap();
    let mut second = new();
    let (positions, velocities) = (first.positions().unwrap(), first.velocities().unwrap().to_vec());
    second.restore(&positions, &velocities, 2).unwrap();
    assert_eq!(second.time_s(), first.time_s());
    assert!(bits(second, &[1]) == whole);
    let error = new().restore(&positions[1..], &velocities, 2).unwrap_err();
    assert!(matches!(error, SolverError::VertexLength { what: "positions", .. }), "{error}");
}

#[test]
fn a_number_of_threads_out_of_range_is_rejected() {
    for threads in [0, 1_000_000] {
        let solver =
            SolverCpu::new(body::<f32>(Formulation::Pbd), settings(Formulation::Pbd, 1), Some(threads));
        assert!(matches!(solver.err(), Some(CpuError::Threads { .. })));
    }
}

#[test]
fn a_timed_step_has_the_same_bits_and_reports_its_parts() {
    let settings = |iterations| Settings { iterations, substeps: 3, ..Settings::default() };
    for iterations in [1, 2] {
        let mut plain = SolverReference::<f32>::new(body(Formulation::Xpbd), settings(iterations)).unwrap();
        plain.step(2).unwrap();
        let mut timed: [Box<dyn Solver<f32>>; 3] = [
            Box::new(SolverReference::new(body(Formulation::Xpbd), settings(iterations)).unwrap()),
            Box::new(SolverCpu::new(body(Formulation::Xpbd), settings(iterations), Some(1)).unwrap()),
            Box::new(SolverCpu::new(body(Formulation::Xpbd), settings(iterations), Some(3)).unwrap()),
        ];
        for solver in &mut timed {
            let mut profile = StepProfile::default();
            let start = Instant::now();
            solver.step_timed(1, &mut profile).unwrap();
            solver.step_timed(1, &mut profile).unwrap();
            let wall = start.elapsed().as_secs_f64();
            assert!(solver.positions().unwrap() == plain.positions().unwrap());
            assert!(solver.velocities().unwrap() == plain.velocities().unwrap());
            let names: Vec<&str> = profile.parts().iter().map(|part| part.name).collect();
            let clear: &[&str] = if iterations > 1 { &["multipliers"] } else { &[] };
            let expected =
                [&["vertices", "handles"], clear, &["distance", "stc", "volume", "check"]].concat();
            assert_eq!(names, expected);
            assert!(profile.parts().iter().all(|part| part.seconds > 0.0));
            assert!(profile.total_s() <= wall, "{profile:?} of {wall} s");
            // Another process may interrupt a step between two parts, so the best of many counts.
            let share = |solver: &mut Box<dyn Solver<f32>>| {
                let (mut profile, start) = (StepProfile::default(), Instant::now());
                solver.step_timed(1, &mut profile).unwrap();
                profile.total_s() / start.elapsed().as_secs_f64()
            };
            let best = (0..50).map(|_| share(solver)).find(|share| *share > 0.5);
            assert!(best.is_some(), "the parts are most of a step");
        }
    }
}

/// A conversion to double precision gives the body that is built in double precision.
#[test]
fn a_body_in_double_precision_is_the_same_body() {
    for formulation in [Formulation::Pbd, Formulation::Xpbd] {
        let settings = Settings { formulation, substeps: 2, iterations: 2, ..Settings::default() };
        let same = body::<f64>(formulation).to_f64();
        let mut expected = SolverCpu::new(body::<f64>(formulation), settings, Some(1)).unwrap();
        let mut found = SolverCpu::new(same, settings, Some(2)).unwrap();
        let mut double = SolverCpu::new(body::<f32>(formulation).to_f64(), settings, Some(2)).unwrap();
        let mut single = SolverCpu::new(body::<f32>(formulation), settings, Some(2)).unwrap();
        for solver in [&mut expected, &mut found, &mut double] {
            solver.step(2).unwrap();
        }
        single.step(2).unwrap();
        assert!(found.positions().unwrap() == expected.positions().unwrap());
        let distance = |a: &[Point3<f64>], b: &[Point3<f64>]| {
            a.iter().zip(b).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
        };
        let single: Vec<Point3<f64>> = single.positions().unwrap().iter().map(|p| p.cast()).collect();
        let double = double.positions().unwrap();
        assert!((1e-12..1e-5).contains(&distance(&double, &single)), "{}", distance(&double, &single));
        assert!(distance(&double, &expected.positions().unwrap()) < 1e-5);
    }
}
