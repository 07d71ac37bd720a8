//! Equilibria, compared with a direct solver.

use cutis_newton::{Problem, relative_rms};
use cutis_rest::{Body, Options, Rest};
use cutis_solver::{Settings, Solver, SolverReference};
use nalgebra::{Point3, Vector3};

use crate::blocks::{EDGE, GRAVITY_M_S2, Make};

/// Options for comparisons.
const EXACT: Options = Options { error: 1e-9, force: 1e-12, most_steps: 100, most_cycles: 300 };

fn settled(make: Make, options: &Options) -> Rest {
    Body::of(&make.system(), GRAVITY_M_S2).unwrap().settle(options, &mut |_| ()).unwrap()
}

fn cycles(rest: &Rest) -> usize {
    rest.steps.iter().map(|step| step.cycles).sum()
}

/// Blocks of soft and stiff halves, with little and much change of volume, whole and cut. The small
/// ones are solved directly, the others on several levels.
#[test]
fn blocks_rest_where_a_direct_solver_finds_them() {
    let usual = Make::default();
    let makes = [
        Make { size: 5, ..usual },
        usual,
        Make { size: 13, ..usual },
        Make { size: 11, cut: true, ..usual },
        Make { size: 11, contrast: 1000.0, ..usual },
        Make { size: 11, incompressibility: 100.0, ..usual },
        Make { size: 11, youngs_modulus_pa: 3e3, ..usual },
    ];
    for (n, make) in makes.into_iter().enumerate() {
        let system = make.system();
        let problem = Problem::of(&system, GRAVITY_M_S2).unwrap();
        let start = system.positions();
        let expected = problem.equilibrium(&start, &cutis_newton::Options::default()).unwrap();
        let found = settled(make, &EXACT);
        let error = relative_rms(&found.positions, &expected.positions, &start);
        assert!(error < 1e-6, "block {n}: {error:e} in {:?}", found.steps);
        // Control: the block moves by more than the error, and a rough search ends elsewhere.
        let sag = start.iter().zip(&found.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(sag > 1e-3 * EDGE, "block {n}: {sag}");
        let rough = settled(make, &Options { error: 0.05, force: 0.0, ..EXACT });
        let rough = relative_rms(&rough.positions, &expected.positions, &start);
        assert!(rough > error && rough < 0.05, "block {n}: {rough:e}");
    }
}

/// The error that a search states is not smaller than the true one.
#[test]
fn stated_errors_hold() {
    let usual = Make { size: 11, ..Make::default() };
    for make in [
        Make { youngs_modulus_pa: 3e3, ..usual },
        Make { contrast: 1000.0, ..usual },
        Make { incompressibility: 100.0, ..usual },
        Make { cut: true, ..usual },
    ] {
        let exact = settled(make, &EXACT);
        let start = make.system().positions();
        for error in [0.1, 0.01, 1e-3, 1e-5] {
            let found = settled(make, &Options { error, force: 0.0, ..EXACT });
            let real = relative_rms(&found.positions, &exact.positions, &start);
            assert!(
                real <= found.error && found.error <= error,
                "{error}: {} and {real} {:#?}",
                found.error,
                found.steps
            );
        }
    }
}

/// From 500 to 33 thousand vertices the cycles grow by less than a half.
#[test]
fn cycles_hardly_grow_with_the_body() {
    let options = Options { error: 1e-3, ..EXACT };
    let counts = [8, 16, 32].map(|size| cycles(&settled(Make { size, ..Make::default() }, &options)));
    assert!(2 * counts[2] <= 3 * counts[0].max(counts[1]), "{counts:?}");
}

#[test]
fn threads_do_not_change_a_bit() {
    let make = Make { size: 14, cut: true, ..Make::default() };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| settled(make, &Options::default()))
    };
    let one = on(1);
    for threads in [2, 3, 8] {
        assert!(on(threads) == one, "{threads} threads");
    }
}

#[test]
fn a_body_at_rest_does_not_move() {
    let system = Make::default().system();
    let rest = Body::of(&system, [0.0; 3]).unwrap().settle(&Options::default(), &mut |_| ()).unwrap();
    assert_eq!((rest.positions, rest.steps.len(), rest.error), (system.positions(), 0, 0.0));
}

/// The top of a block moves by half of the edge at once. The block follows, and rests where it also
/// rests after twenty small moves. Control: the search that only the top has left takes more steps.
#[test]
fn a_body_follows_vertices_that_are_moved_far() {
    let system = Make { size: 7, ..Make::default() }.system();
    let at_rest = Body::of(&system, [0.0; 3]).unwrap().settle(&EXACT, &mut |_| ()).unwrap().positions;
    let moved = |share: f64| {
        let mut solver = SolverReference::new(system.clone(), Settings::default()).unwrap();
        let top = |x: &Point3<f64>| x.z > EDGE - 1e-3;
        let by = Vector3::new(0.4 * EDGE, 0.0, 0.3 * EDGE) * share;
        let place = |x: &Point3<f64>| if top(x) { x + by } else { *x };
        let positions: Vec<Point3<f64>> = system.positions().iter().map(place).collect();
        solver.restore(&positions, &vec![Vector3::zeros(); positions.len()], 0).unwrap();
        solver.system().unwrap().clone()
    };
    let body = |share| Body::of(&moved(share), [0.0; 3]).unwrap();
    let followed = body(1.0).settle_after(&at_rest, &EXACT, &mut |_| ()).unwrap();
    let mut slowly = at_rest.clone();
    for n in 1..=20 {
        slowly = body(f64::from(n) / 20.0).settle_after(&slowly, &EXACT, &mut |_| ()).unwrap().positions;
    }
    let error = relative_rms(&followed.positions, &slowly, &at_rest);
    assert!(error < 1e-6, "{error}");
    let torn = body(1.0).settle_from(&at_rest, &EXACT, &mut |_| ());
    let steps = torn.map(|rest| rest.steps.len()).unwrap_or(usize::MAX);
    assert!(followed.steps.len() < steps, "{} and {steps} steps", followed.steps.len());
}

/// A body far from its rest shape, turned inside out in a part, comes to rest or says that it did
/// not.
#[test]
fn a_start_far_from_rest_ends_at_a_minimum_or_an_error() {
    let system = Make { size: 6, ..Make::default() }.system();
    let options = Options { most_steps: 300, ..EXACT };
    let moved = |by: f64| -> Vec<Point3<f64>> {
        let wave =
            |x: &Point3<f64>| Point3::new(x.x + by * (90.0 * x.y).sin(), x.y + by * (70.0 * x.z).sin(), x.z);
        system.positions().iter().map(wave).collect()
    };
    let body = Body::of(&system, GRAVITY_M_S2).unwrap();
    let expected = body.settle(&options, &mut |_| ()).unwrap();
    for by in [0.005, 0.01] {
        let found = body.settle_from(&moved(by), &options, &mut |_| ()).unwrap();
        let error = relative_rms(&found.positions, &expected.positions, &system.positions());
        assert!(error < 1e-5, "{by}: {error}");
    }
    match body.settle_from(&moved(0.08), &options, &mut |_| ()) {
        Ok(rest) => assert!(rest.force < 1e-3, "{}", rest.force),
        Err(error) => assert!(error.to_string().contains("not at rest"), "{error}"),
    }
}

/// A block that nothing holds starts in a heap, a thousand times smaller than it is. It unfolds and
/// comes to rest in its shape.
#[test]
fn a_heap_unfolds() {
    let noise = |n: usize| (n as f64 * 12.9898).sin() * EDGE;
    for size in [3, 4] {
        let system = Make { size, held: false, ..Make::default() }.system();
        let heap = |(n, x): (usize, &Point3<f64>)| {
            Point3::from(1e-3 * (x.coords + 0.2 * Vector3::new(noise(n), noise(n + 7), noise(n + 13))))
        };
        let positions: Vec<Point3<f64>> = system.positions().iter().enumerate().map(heap).collect();
        let mut solver = SolverReference::new(system.clone(), Settings::default()).unwrap();
        solver.restore(&positions, &vec![Vector3::zeros(); positions.len()], 0).unwrap();
        let body = Body::of(solver.system().unwrap(), [0.0; 3]).unwrap();
        let found = body.settle(&Options::default(), &mut |_| ()).unwrap();
        assert!(found.energy_change_j < 0.0 && found.steps.len() < 100);
        // All springs have their lengths: the distances between vertices are those at the start.
        let distances = |x: &[Point3<f64>]| -> Vec<f64> { x.iter().map(|p| (p - x[0]).norm()).collect() };
        let pairs = distances(&found.positions).into_iter().zip(distances(&system.positions()));
        let far = pairs.map(|(found, wanted)| (found - wanted).abs()).fold(0.0, f64::max);
        assert!(far < 1e-3 * EDGE, "size {size}: {far:e} m after {} steps", found.steps.len());
    }
}
