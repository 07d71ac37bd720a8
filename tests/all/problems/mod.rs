//! Problems with answers from outside the solver: closed forms, an independent Newton solution, and
//! independent programs. Problems that need a solver run on every backend. Each has a negative
//! control that its own check must reject.

mod affine_patch;
mod beam;
mod cantilever;
mod energy_decay;
mod free_body;
mod hanging_bar;
mod incompressible_block;
mod oscillator;
mod sheet_moduli;
mod wound_equilibrium;
mod wound_gape;

use cutis_constraints::Scalar;
use cutis_gpu::Gpu;
use cutis_solver::{Settings, Solver, SolverReference, System};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;
use nalgebra::Point3;

/// Length scales of every problem. Results must not depend on the unit of length.
const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];

/// Starts a solver on a backend.
type Start<T> = dyn Fn(System<T>, Settings) -> Box<dyn Solver<T>>;

fn reference<T: Scalar>(system: System<T>, settings: Settings) -> Box<dyn Solver<T>> {
    Box::new(SolverReference::new(system, settings).unwrap())
}

/// The CPU backend on two threads. It uses them for large colors.
fn cpu<T: Scalar>(system: System<T>, settings: Settings) -> Box<dyn Solver<T>> {
    Box::new(SolverCpu::new(system, settings, Some(2)).unwrap())
}

fn gpu(gpu: &Gpu) -> impl Fn(System<f32>, Settings) -> Box<dyn Solver<f32>> + use<> {
    let gpu = gpu.clone();
    move |system, settings| Box::new(SolverGpu::new(&gpu, system, settings).unwrap())
}

/// Fails if `check` fails on a backend in `f64`. GPUs have no `f64`.
#[track_caller]
fn in_double(check: impl Fn(&Start<f64>) -> Result<(), String>) {
    on_each_host(check);
}

/// Fails if `check` fails on a backend in `f32`.
#[track_caller]
fn in_single(check: impl Fn(&Start<f32>) -> Result<(), String>) {
    on_each_host(&check);
    on_each_adapter(&check);
}

#[track_caller]
fn on_each_host<T: Scalar>(check: impl Fn(&Start<T>) -> Result<(), String>) {
    let hosts: [(&str, &Start<T>); 2] = [("reference", &reference::<T>), ("cpu", &cpu::<T>)];
    for (name, start) in hosts {
        if let Err(error) = check(start) {
            panic!("{name}: {error}");
        }
    }
}

/// Fails if `check` fails on a GPU adapter. Without an adapter the test is skipped, or fails where
/// an adapter is required.
fn on_each_adapter(check: impl Fn(&Start<f32>) -> Result<(), String>) {
    cutis_test_kit::gpu::on_each_adapter(|device| {
        if let Err(error) = check(&gpu(device)) {
            panic!("{}: {error}", device.adapter().name);
        }
    });
}

/// The points in another unit of length.
fn scaled(points: &[Point3<f64>], scale: f64) -> Vec<Point3<f64>> {
    points.iter().map(|p| p * scale).collect()
}

/// The solver's positions in double precision, divided by `scale`.
fn positions<T: Scalar>(solver: &mut dyn Solver<T>, scale: f64) -> Vec<Point3<f64>> {
    solver.positions().unwrap().iter().map(|p| p.map(|x| x.to_f64() / scale)).collect()
}

/// Fails unless `found` is within `tolerance` of `expected`, relative to `expected`.
fn within(found: f64, expected: f64, tolerance: f64) -> Result<(), String> {
    let error = (found / expected - 1.0).abs();
    if error <= tolerance { Ok(()) } else { Err(format!("{found} instead of {expected}: off by {error:e}")) }
}

/// Fails unless `found` is at most `bound`.
fn at_most(what: &str, found: f64, bound: f64) -> Result<(), String> {
    if found <= bound { Ok(()) } else { Err(format!("{what} is {found:e}, above {bound:e}")) }
}
