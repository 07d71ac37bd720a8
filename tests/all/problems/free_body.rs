//! P2: a free body with all constraint kinds. It keeps its linear momentum to rounding, a single
//! projection makes no torque, and its angular momentum drifts with the order of the step. Vertex
//! block descent keeps the linear momentum only in converged substeps.

use cutis_coloring::greedy;
use cutis_constraints::{Constraint, Distance, Scalar, SkinTension, SkinTensionMaterial, Volume};
use cutis_solver::{Formulation, Momentum, Pbd, Settings, Stiffness, SystemBuilder, project};
use cutis_test_kit::Kuhn;
use nalgebra::{Point3, Vector3};

use super::{SCALES, Start, at_most, in_double, in_single, reference, scaled};

/// A pseudo-random number from −1 to 1.
fn noise(n: usize) -> f64 {
    let mixed = (n as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64 / 2f64.powi(52) - 1.0
}

fn noise_vector(n: usize) -> Vector3<f64> {
    Vector3::new(noise(3 * n), noise(3 * n + 1), noise(3 * n + 2))
}

/// Settings of a run of one second.
#[derive(Clone, Copy)]
struct Case {
    formulation: Formulation,
    substeps: u32,
    iterations: u32,
    scale: f64,
    /// True if one vertex is held, for the negative control.
    pinned: bool,
}

const XPBD: Case =
    Case { formulation: Formulation::Xpbd, substeps: 50, iterations: 2, scale: 1.0, pinned: false };
const PBD: Case = Case { formulation: Formulation::Pbd, ..XPBD };
const VBD: Case = Case { formulation: Formulation::Vbd, ..XPBD };

struct Run {
    before: Momentum,
    after: Momentum,
    /// `Σ m|v|`, the reference for the linear momentum.
    flow: f64,
}

/// A deformed, spinning block after one second.
fn run<T: Scalar>(start: &Start<T>, case: &Case) -> Run {
    let Case { formulation, substeps, iterations, scale, pinned } = *case;
    let lattice = Kuhn::new([4, 4, 4], 1.0);
    let count = lattice.positions.len();
    let deformed: Vec<Point3<f64>> =
        lattice.positions.iter().enumerate().map(|(n, p)| p + noise_vector(n) * 0.05).collect();
    let spin = Vector3::new(0.3, 0.8, -0.5);
    let velocities: Vec<Vector3<T>> = deformed
        .iter()
        .map(|p| ((spin.cross(&p.coords) + Vector3::new(0.2, 0.0, 0.1)) * scale).map(T::constant))
        .collect();
    let mut masses: Vec<f64> = (0..count).map(|n| 1.0 / (1.5 + noise(n + 1000))).collect();
    if pinned {
        masses[0] = 0.0;
    }
    let skin: Vec<[u32; 3]> = lattice.tets.iter().map(|&[a, b, c, _]| [a, b, c]).step_by(7).collect();
    let (stiffness, soft) = match formulation {
        Formulation::Pbd => (Stiffness::pbd(T::constant(0.5)), [T::constant(0.5); 2]),
        Formulation::Xpbd | Formulation::Vbd => (
            Stiffness::compliance(T::constant(0.05)),
            [T::constant(0.05 * scale.powi(4)), T::constant(0.05 * scale.powi(2))],
        ),
    };
    let same = |value| match formulation {
        Formulation::Pbd => Stiffness::pbd(value),
        Formulation::Xpbd | Formulation::Vbd => Stiffness::compliance(value),
    };
    let lengths = vec![[T::constant(1.2 * scale)]; lattice.edges.len()];
    let volumes = vec![[T::constant(scale.powi(3) / 6.0)]; lattice.tets.len()];
    let material = SkinTensionMaterial { rest_area_scale: 0.8, amplification: 2.0 };
    let system = SystemBuilder::<T>::new(&scaled(&deformed, scale), &masses)
        .unwrap()
        .velocities(&velocities)
        .unwrap()
        .add::<Distance, 2>(&lattice.edges, &lengths, stiffness, &greedy(&lattice.edges, count).unwrap())
        .unwrap()
        .add::<Volume, 4>(&lattice.tets, &volumes, same(soft[0]), &greedy(&lattice.tets, count).unwrap())
        .unwrap()
        .add_from_rest::<SkinTension, 3>(&skin, &material, same(soft[1]), &greedy(&skin, count).unwrap())
        .unwrap()
        .build();
    let settings = Settings { formulation, dt_s: 1.0, substeps, iterations, ..Settings::default() };
    let mut solver = start(system, settings);
    let before = solver.momentum().unwrap();
    solver.step(1).unwrap();
    let after = solver.momentum().unwrap();
    let speeds = solver.velocities().unwrap().iter().map(|v| v.map(|x| x.to_f64()).norm());
    let heavy = masses.iter().map(|&w| if w > 0.0 { 1.0 / w } else { 0.0 });
    Run { before, after, flow: speeds.zip(heavy).map(|(speed, mass)| speed * mass).sum() }
}

fn linear_drift(run: &Run) -> f64 {
    (run.after.linear - run.before.linear).norm() / run.flow
}

fn stays(run: &Run, bound: f64) -> Result<(), String> {
    at_most("drift of the linear momentum", linear_drift(run), bound)
}

fn angular_drift(run: &Run) -> f64 {
    (run.after.angular - run.before.angular).norm() / run.before.angular.norm()
}

#[test]
fn linear_momentum_stays() {
    for case in [PBD, XPBD] {
        for scale in SCALES {
            in_double(|start| stays(&run(start, &Case { scale, ..case }), 1e-12));
            in_single(|start| stays(&run(start, &Case { scale, ..case }), 1e-3));
        }
    }
}

#[test]
fn control_a_pinned_body_is_refused() {
    stays(&run(&reference::<f64>, &Case { pinned: true, ..XPBD }), 1e-3).unwrap_err();
}

/// Many iterations keep the momentum; a single one does not.
fn stays_once_converged<T: Scalar>(start: &Start<T>, scale: f64, bound: f64) -> Result<(), String> {
    let run = |iterations| run(start, &Case { iterations, scale, ..VBD });
    let once = linear_drift(&run(1));
    at_most("least drift of a single iteration", 1e-5, once)?;
    stays(&run(16), bound)
}

#[test]
fn linear_momentum_stays_under_converged_vertex_block_descent() {
    for scale in SCALES {
        in_double(|start| stays_once_converged(start, scale, 1e-12));
        in_single(|start| stays_once_converged(start, scale, 5e-6));
    }
}

fn angular_drift_falls<T: Scalar>(start: &Start<T>, scale: f64) -> Result<(), String> {
    let drift = |substeps| angular_drift(&run(start, &Case { substeps, scale, ..XPBD }));
    let drifts = [25, 100, 400].map(drift);
    at_most("drift with smaller steps", (drifts[1] / drifts[0]).max(drifts[2] / drifts[1]), 0.5)?;
    at_most("drift of the angular momentum", drifts[2], 1e-2)
}

#[test]
fn angular_momentum_drifts_less_with_smaller_steps() {
    for scale in SCALES {
        in_double(|start| angular_drift_falls(start, scale));
        in_single(|start| angular_drift_falls(start, scale));
    }
}

/// Torque and force of one projection, over the sums of the absolute moments and impulses.
fn leaks<C: Constraint<N>, const N: usize>(
    params: &C::Params<f64>,
    seed: usize,
    scale: f64,
    tilt: f64,
) -> [f64; 2] {
    let x: [Point3<f64>; N] = std::array::from_fn(|i| Point3::from(noise_vector(seed * N + i)) * scale);
    let w: [f64; N] = std::array::from_fn(|i| 1.5 + noise(seed + i));
    let done = project::<C, N, f64, Pbd>(&x, &w, params, Pbd, 1.0, 0.0);
    let (mut force, mut torque, mut forces, mut torques) = (Vector3::zeros(), Vector3::zeros(), 0.0, 0.0);
    for i in 0..N {
        let mut impulse = done.corrections[i] / w[i];
        if i == 0 {
            impulse += Vector3::new(-impulse.y, impulse.x, impulse.z) * tilt;
        }
        force += impulse;
        torque += x[i].coords.cross(&impulse);
        forces += impulse.norm();
        torques += x[i].coords.norm() * impulse.norm();
    }
    [force.norm() / forces, torque.norm() / torques]
}

fn no_leak(leaks: [f64; 2]) -> Result<(), String> {
    at_most("force", leaks[0], 1e-13)?;
    at_most("torque", leaks[1], 1e-13)
}

#[test]
fn one_projection_makes_neither_force_nor_torque() {
    for scale in SCALES {
        for seed in 0..200 {
            no_leak(leaks::<Distance, 2>(&[0.3 * scale], seed, scale, 0.0)).unwrap();
            no_leak(leaks::<SkinTension, 3>(&[0.1 * scale.powi(2), 3.0], seed, scale, 0.0)).unwrap();
            no_leak(leaks::<Volume, 4>(&[0.2 * scale.powi(3)], seed, scale, 0.0)).unwrap();
        }
    }
}

#[test]
fn control_a_tilted_correction_is_refused() {
    no_leak(leaks::<Distance, 2>(&[0.3], 1, 1.0, 1e-9)).unwrap_err();
    no_leak(leaks::<Volume, 4>(&[0.2], 1, 1.0, 1e-9)).unwrap_err();
}
