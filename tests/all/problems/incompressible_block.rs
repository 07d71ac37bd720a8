//! P7: a block of incompressible tetrahedra is pulled at one end. Its volume error vanishes with
//! the number of iterations.
//!
//! The block is one cube wide: its 36 tetrahedra do not determine all of its 60 coordinates. A wide
//! block has more linear tetrahedra than coordinates and cannot be stretched without a change of
//! volume (locking).

use cutis_coloring::greedy;
use cutis_constraints::{Distance, Scalar, Volume};
use cutis_solver::{Formulation, Handle, Settings, Solver, Stiffness, System, SystemBuilder};
use cutis_test_kit::Kuhn;

use super::{SCALES, Start, at_most, cpu, on_each_adapter, reference, scaled};

/// A block with one fixed end and one end that moves to a stretch of 20 %. `softness` is the
/// compliance of the volumes in the springs' units.
fn block<T: Scalar>(softness: f64, scale: f64) -> System<T> {
    let lattice = Kuhn::new([7, 2, 2], 1.0);
    let count = lattice.positions.len();
    let masses: Vec<f64> = lattice.positions.iter().map(|p| if p.x == 0.0 { 0.0 } else { 1.0 }).collect();
    let end: Vec<u32> = (0..count as u32).filter(|&v| lattice.positions[v as usize].x == 6.0).collect();
    let soft = Stiffness::compliance(T::one());
    let rigid = Stiffness::compliance(T::constant(softness * scale.powi(4)));
    SystemBuilder::<T>::new(&scaled(&lattice.positions, scale), &masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &Default::default(),
            soft,
            &greedy(&lattice.edges, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<Volume, 4>(
            &lattice.tets,
            &Default::default(),
            rigid,
            &greedy(&lattice.tets, count).unwrap(),
        )
        .unwrap()
        .handle(Handle { vertices: end, move_m: [1.2 * scale, 0.0, 0.0], at_s: 0.0, over_s: 20.0 })
        .unwrap()
        .build()
}

fn settings(iterations: u32) -> Settings {
    Settings {
        formulation: Formulation::Xpbd,
        dt_s: 40.0,
        substeps: 80,
        iterations,
        gravity_m_s2: [0.0; 3],
        damping_per_s: 0.5,
        ..Settings::default()
    }
}

/// RMS of the relative volume error after the pull.
fn volume_error<T: Scalar>(mut solver: Box<dyn Solver<T>>) -> f64 {
    solver.step(1).unwrap();
    solver.residuals().unwrap().iter().find(|residual| residual.name == "volume").unwrap().rms
}

/// Fails unless the error falls with each larger number of iterations and ends below `bound`.
fn check<T: Scalar, const N: usize>(
    start: &Start<T>,
    softness: f64,
    scale: f64,
    iterations: [u32; N],
    bound: f64,
) -> Result<(), String> {
    let errors =
        iterations.map(|iterations| volume_error(start(block(softness, scale), settings(iterations))));
    for pair in errors.windows(2) {
        at_most("error with more iterations", pair[1], (0.7 * pair[0]).max(bound))
            .map_err(|e| format!("{e}: {errors:?}"))?;
    }
    at_most("last error", errors[N - 1], bound)
}

/// Numbers of iterations with which the error vanishes.
fn vanishes<T: Scalar>(start: &Start<T>, softness: f64, scale: f64) -> Result<(), String> {
    check(start, softness, scale, [1, 16, 256, 2048], 1e-4)
}

/// Fewer iterations, because software devices are slow.
fn falls<T: Scalar>(start: &Start<T>, softness: f64) -> Result<(), String> {
    check(start, softness, 1.0, [1, 8, 64], 3e-3)
}

#[test]
fn volume_error_vanishes_with_iterations() {
    for scale in SCALES {
        vanishes(&reference::<f64>, 0.0, scale).unwrap();
        vanishes(&reference::<f32>, 0.0, scale).unwrap();
    }
}

#[test]
fn volume_error_vanishes_on_threads() {
    vanishes(&cpu::<f32>, 0.0, 1.0).unwrap();
}

#[test]
fn volume_error_falls_on_the_gpu() {
    on_each_adapter(|start| falls(start, 0.0));
}

#[test]
fn control_compressible_tetrahedra_are_refused() {
    vanishes(&reference::<f64>, 0.1, 1.0).unwrap_err();
    falls(&reference::<f64>, 0.1).unwrap_err();
}
