//! P7: a block whose tetrahedra are incompressible is pulled at one end: its volume error vanishes as iterations grow.
//!
//! The block is one cube wide: its 36 tetrahedra leave free some of its 60 coordinates. A wide block of linear
//! tetrahedra has more of them than coordinates and cannot be stretched without a change of volume (locking).

use cutis_coloring::greedy;
use cutis_constraints::{Distance, Scalar, Volume};
use cutis_solver::{
    Formulation, Handle, Settings, Solver, SolverReference, Stiffness, System, SystemBuilder,
};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;
use cutis_tests::lattice::Kuhn;

use super::{SCALES, at_most, on_each_adapter, scaled};

/// The block with one end held and the other on its way to a stretch of 20 %. `softness` is the compliance of the volumes in
/// units that fit the springs'.
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
        .handle(Handle { vertices: end, move_m: [1.2 * scale, 0.0, 0.0], over_s: 20.0 })
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

/// RMS of the volume error over the rest volume after the end has been pulled.
fn volume_error<T: Scalar>(mut solver: impl Solver<T>) -> f64 {
    solver.step(1).unwrap();
    solver.residuals().unwrap().iter().find(|residual| residual.name == "volume").unwrap().rms
}

/// The error must fall from each number of iterations to the next, and be below `bound` at last.
fn check<T: Scalar, S: Solver<T>, const N: usize>(
    iterations: [u32; N],
    bound: f64,
    solver: impl Fn(Settings) -> S,
) -> Result<(), String> {
    let errors = iterations.map(|iterations| volume_error(solver(settings(iterations))));
    for pair in errors.windows(2) {
        at_most("error with more iterations", pair[1], (0.7 * pair[0]).max(bound))
            .map_err(|e| format!("{e}: {errors:?}"))?;
    }
    at_most("last error", errors[N - 1], bound)
}

const SIXTEENFOLD: [u32; 4] = [1, 16, 256, 2048];

fn check_reference<T: Scalar>(softness: f64, scale: f64) -> Result<(), String> {
    check(SIXTEENFOLD, 1e-4, |settings| SolverReference::<T>::new(block(softness, scale), settings).unwrap())
}

#[test]
fn volume_error_vanishes_with_iterations() {
    for scale in SCALES {
        check_reference::<f64>(0.0, scale).unwrap();
        check_reference::<f32>(0.0, scale).unwrap();
    }
}

#[test]
fn volume_error_vanishes_on_threads() {
    let threads = |settings| SolverCpu::<f32>::new(block(0.0, 1.0), settings, None).unwrap();
    check(SIXTEENFOLD, 1e-4, threads).unwrap();
}

/// Fewer iterations: a software device takes its time.
#[test]
fn volume_error_vanishes_on_the_gpu() {
    on_each_adapter(|gpu| {
        let gpu = |settings| SolverGpu::new(gpu, block(0.0, 1.0), settings).unwrap();
        check([1, 8, 64], 3e-3, gpu).unwrap();
    });
}

#[test]
fn control_compressible_tetrahedra_are_refused() {
    check_reference::<f64>(0.1, 1.0).unwrap_err();
    let soft = |settings| SolverReference::<f64>::new(block(0.1, 1.0), settings).unwrap();
    check([1, 8, 64], 3e-3, soft).unwrap_err();
}
