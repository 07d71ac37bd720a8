//! Vertex block descent: the energy of a step decreases, a body at rest is in equilibrium, and
//! systems without a solution are rejected.

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{Constraint, Distance, Scalar, SkinTension, SkinTensionMaterial, Volume};
use cutis_solver::{
    Formulation, Settings, Solver, SolverError, SolverReference, Stiffness, System, SystemBuilder,
    VertexForce,
};
use cutis_test_kit::Kuhn;
use nalgebra::{Matrix3, Point3, Vector3};

const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

/// A block of 5 × 4 × 4 vertices, 1 cm apart, fixed at x = 0, with contracting skin on top.
fn block(distance: f64) -> System<f64> {
    block_with(distance, 2.0)
}

/// The block of [`block`] with another amplification of the skin.
fn block_with(distance: f64, amplification: f64) -> System<f64> {
    let size = [5u32, 4, 4];
    let Kuhn { positions, edges, tets, .. } = Kuhn::new(size.map(|n| n as usize), 0.01);
    let mut skin = Vec::new();
    for (i, j) in (0..size[1] - 1).flat_map(|j| (0..size[0] - 1).map(move |i| (i, j))) {
        let top = |a: u32, b: u32| i + a + size[0] * (j + b + size[1] * (size[2] - 1));
        skin.extend([[top(0, 0), top(1, 0), top(1, 1)], [top(0, 0), top(1, 1), top(0, 1)]]);
    }
    let count = positions.len();
    let inverse_masses: Vec<f64> = (0..count).map(|n| if n % 5 == 0 { 0.0 } else { 1000.0 }).collect();
    let tension = SkinTensionMaterial { rest_area_scale: 0.8, amplification };
    SystemBuilder::<f64>::new(&positions, &inverse_masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &edges,
            &Default::default(),
            Stiffness::compliance(distance),
            &greedy(&edges, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<Volume, 4>(
            &tets,
            &Default::default(),
            Stiffness::compliance(1e-12),
            &greedy(&tets, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<SkinTension, 3>(
            &skin,
            &tension,
            Stiffness::compliance(1e-5),
            &greedy(&skin, count).unwrap(),
        )
        .unwrap()
        .build()
}

fn settings(formulation: Formulation, substeps: u32, iterations: u32) -> Settings {
    Settings {
        formulation,
        substeps,
        iterations,
        gravity_m_s2: GRAVITY,
        damping_per_s: 20.0,
        ..Settings::default()
    }
}

/// Returns the largest force on a moving vertex over its weight.
fn unbalance(system: &System<f64>) -> f64 {
    let weight = |n: usize| Vector3::from(GRAVITY) / system.vertices()[n].inverse_mass();
    let mut forces: Vec<Vector3<f64>> = (0..system.vertices().len()).map(weight).collect();
    for kind in system.kinds() {
        let arity = kind.arity();
        let mut gradients = vec![Vector3::zeros(); arity];
        for (k, tuple) in kind.indices().chunks_exact(arity).enumerate() {
            let x: Vec<Point3<f64>> =
                tuple.iter().map(|&v| system.vertices()[v as usize].position()).collect();
            let c = kind.evaluate(k, &x, &mut gradients);
            for (&v, gradient) in tuple.iter().zip(&gradients) {
                forces[v as usize] -= gradient * (c / kind.stiffness().values().at(k));
            }
        }
    }
    let moving = |n: &usize| system.vertices()[*n].inverse_mass() > 0.0;
    (0..forces.len()).filter(moving).map(|n| forces[n].norm() / weight(n).norm()).fold(0.0, f64::max)
}

/// Constraints that are evaluated together, in any order, give the bits of single ones.
#[test]
fn constraints_evaluate_alike_one_by_one_and_together() {
    let system = block(1e-3);
    for kind in system.kinds() {
        let arity = kind.arity();
        let constraints: Vec<u32> = (0..kind.len() as u32).rev().chain([0]).collect();
        let moved = |v: u32| system.vertices()[v as usize].position() * (1.0 + 0.01 * f64::from(v));
        let vertices = constraints.iter().flat_map(|&k| &kind.indices()[k as usize * arity..][..arity]);
        let x: Vec<Point3<f64>> = vertices.map(|&v| moved(v)).collect();
        let mut c = vec![f64::NAN; constraints.len()];
        let mut gradients = vec![Vector3::zeros(); x.len()];
        kind.evaluate_all(&constraints, &x, &mut c, &mut gradients);
        let mut one = vec![Vector3::zeros(); arity];
        for (n, &k) in constraints.iter().enumerate() {
            let own = n * arity..(n + 1) * arity;
            assert_eq!(c[n], kind.evaluate(k as usize, &x[own.clone()], &mut one), "{}", kind.name());
            assert_eq!(gradients[own], one, "{}", kind.name());
        }
        assert!(c.iter().all(|&c| c != 0.0) && c[0] != c[1], "control: {c:?}");
    }
}

#[test]
fn a_body_at_rest_is_in_equilibrium_for_all_settings() {
    let mut tips = Vec::new();
    for (substeps, iterations) in [(1, 1), (1, 8), (4, 1), (20, 2)] {
        let settings = settings(Formulation::Vbd, substeps, iterations);
        let mut solver = SolverReference::new(block(1e-3), settings).unwrap();
        solver.step(1500).unwrap();
        let unbalance = unbalance(solver.system().unwrap());
        assert!(unbalance < 1e-6, "{substeps} × {iterations}: {unbalance}");
        tips.push(solver.positions().unwrap()[4].z);
    }
    assert!(tips[0] < -1e-4, "the block hangs: {tips:?}");
    assert!(tips.iter().all(|tip| (tip - tips[0]).abs() < 1e-9), "{tips:?}");
    // Control: XPBD comes to rest elsewhere, farther away for larger substeps.
    let mut xpbd = SolverReference::new(block(1e-3), settings(Formulation::Xpbd, 1, 1)).unwrap();
    xpbd.step(1500).unwrap();
    assert!(unbalance(xpbd.system().unwrap()) > 0.1);
}

/// Returns `Σ m/(2h²)|x − x̃|² + Σ C²/(2α)` after one step of `iterations` from random positions at
/// rest.
fn energy_of_step(iterations: u32, relaxation: f64, amplification: f64) -> f64 {
    let settings = Settings { relaxation, damping_per_s: 0.0, ..settings(Formulation::Vbd, 1, iterations) };
    let mut solver = SolverReference::new(block_with(1e-4, amplification), settings).unwrap();
    let mut start = solver.positions().unwrap();
    let count = start.len();
    for (n, position) in start.iter_mut().enumerate().filter(|(n, _)| n % 5 != 0) {
        let noise = |axis: usize| ((n * 37 + axis * 11) % count) as f64 / count as f64 - 0.5;
        *position += Vector3::new(noise(1), noise(2), noise(3)) * 0.03;
    }
    solver.restore(&start, &vec![Vector3::zeros(); count], 0).unwrap();
    solver.step(1).unwrap();
    let h = settings.substep_s();
    let gravity_h_squared = Vector3::from(GRAVITY) * (h * h);
    let elastic = solver.energy().unwrap().elastic_j.unwrap();
    let inertia = |n: usize, x: &Point3<f64>| {
        0.5 / 1000.0 / (h * h) * (x - start[n] - gravity_h_squared).norm_squared()
    };
    let moving = solver.positions().unwrap();
    let moving = moving.iter().enumerate().filter(|(n, _)| n % 5 != 0);
    elastic + moving.map(|(n, x)| inertia(n, x)).sum::<f64>()
}

#[test]
fn every_iteration_lowers_the_energy_of_a_step() {
    // For strongly amplified skin the model has three quarters of the true curvature, so that ω may
    // be up to 1.5.
    for (relaxation, amplification) in [(0.7, 2.0), (1.0, 2.0), (1.4, 1e3)] {
        let energies: Vec<f64> = (1..=60).map(|n| energy_of_step(n, relaxation, amplification)).collect();
        for (n, pair) in energies.windows(2).enumerate() {
            assert!(pair[1] <= pair[0] * (1.0 + 1e-12), "iteration {}: {pair:?}, ω {relaxation}", n + 2);
        }
        assert!(energies[59] < 0.5 * energies[0], "{energies:?}");
    }
    // With the same number of iterations, over-relaxation gets closer to the minimum.
    assert!(energy_of_step(60, 1.4, 2.0) < energy_of_step(60, 1.0, 2.0));
}

#[test]
fn the_model_of_a_stretched_edge_is_its_hessian_plus_a_known_surplus() {
    let (a, b) = (Point3::new(0.1, -0.2, 0.3), Point3::new(0.5, 0.9, -0.4));
    let force = |x: Point3<f64>| {
        let eval = Distance::eval(&[x, b], &[0.7]);
        let mut vertex_force = VertexForce::none();
        vertex_force.add(eval.c, &eval.grad[0], 0.01, 0.7);
        vertex_force
    };
    let VertexForce { diagonal: d, mixed: m, .. } = force(a);
    let model = Matrix3::new(d.x, m.x, m.y, m.x, d.y, m.z, m.y, m.z, d.z);
    let shift = 1e-6;
    // κ is the curvature across the edge. The true curvature along the edge is zero, but the model
    // adds κ there too.
    let along = (a - b).normalize();
    let length = (a - b).norm();
    let surplus = along * along.transpose() * ((length - 0.7) / length / 0.01);
    for axis in 0..3 {
        let step = Vector3::ith(axis, shift);
        let column = -(force(a + step).force - force(a - step).force) / (2.0 * shift);
        let expected = (model - surplus).column(axis).into_owned();
        assert!((column - expected).norm() < 1e-6 * model.norm(), "{column} {expected}");
    }
}

/// Moves the tip of a tetrahedron with half of its rest volume for one substep, at `10^stiff` times
/// the stiffness that corresponds to its inertia. Returns the distance over the distance to rest.
fn relative_step<T: Scalar>(stiff: i32) -> f64 {
    let base = [[0.1, -0.7, 1.3], [1.2, -0.4, 0.9], [0.4, 0.6, 1.6]].map(Point3::from);
    let tip = Point3::new(0.8, 0.3, 2.1);
    let middle = Point3::from((base[0].coords + base[1].coords + base[2].coords) / 3.0);
    let positions = [base[0], base[1], base[2], middle + (tip - middle) * 0.5];
    let settings = settings(Formulation::Vbd, 1, 4);
    let h = settings.substep_s();
    let params = Volume::from_rest::<T>(
        &[base[0], base[1], base[2], tip].map(|p| p.map(T::constant)),
        &Default::default(),
    );
    let eval = Volume::eval::<T>(&positions.map(|p| p.map(T::constant)), &params);
    let gradient = eval.grad[3].norm().to_f64();
    let compliance = gradient * gradient * h * h / 10_f64.powi(stiff);
    let system = SystemBuilder::<T>::new(&positions, &[0.0, 0.0, 0.0, 1.0])
        .unwrap()
        .add::<Volume, 4>(
            &[[0, 1, 2, 3]],
            &[params],
            Stiffness::compliance(T::constant(compliance)),
            &greedy(&[[0, 1, 2, 3]], 4).unwrap(),
        )
        .unwrap()
        .build();
    let mut solver = SolverReference::new(system, Settings { gravity_m_s2: [0.0; 3], ..settings }).unwrap();
    solver.step(1).unwrap();
    let moved = solver.positions().unwrap()[3].map(T::to_f64) - positions[3];
    moved.norm() * gradient / eval.c.to_f64().abs()
}

/// If a constraint is stiffer than `1/ε` times the inertia, the inertia is lost in the rounding of
/// the model's matrix.
#[test]
fn steps_are_correct_for_every_stiffness() {
    for stiff in 0..=30 {
        for found in [relative_step::<f32>(stiff), relative_step::<f64>(stiff)] {
            let expected = 1.0 / (1.0 + 10_f64.powi(-stiff));
            assert!((found - expected).abs() < 0.01, "{found} instead of {expected} at 1e{stiff}");
        }
    }
}

#[test]
fn systems_that_descent_cannot_solve_are_rejected() {
    let descent = settings(Formulation::Vbd, 1, 1);
    let refused = |system| SolverReference::new(system, descent).err();
    let error = refused(block(0.0)).unwrap();
    assert!(matches!(error, SolverError::Stiffness { kind: "distance", value: 0.0, .. }), "{error}");
    let positions = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0)];
    let edges = [[0, 1], [1, 2]];
    let groups = greedy(&edges, 3).unwrap();
    let chain = |stiffness: Stiffness<f64>| {
        let system = SystemBuilder::<f64>::new(&positions, &[0.0, 1.0, 1.0]).unwrap();
        system.add_from_rest::<Distance, 2>(&edges, &Default::default(), stiffness, &groups).unwrap()
    };
    let error = refused(chain(Stiffness::pbd(1.0)).build()).unwrap();
    assert!(matches!(error, SolverError::Formulation { .. }), "{error}");
    let wrong = Groups::from_colors(&[0, 0, 0]).unwrap();
    let error = refused(chain(Stiffness::compliance(1.0)).vertex_groups(wrong).build()).unwrap();
    assert!(error.to_string().contains("vertices 1 and 2"), "{error}");
    let right = Groups::from_colors(&[0, 0, 1]).unwrap();
    assert_eq!(refused(chain(Stiffness::compliance(1.0)).vertex_groups(right).build()), None);
}
