//! Problems whose answers are known from outside the solver: closed forms, an independent Newton solution, independent
//! programs. Each has a negative control, which its own check must refuse.

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
use cutis_gpu::{Gpu, GpuOptions, Select};
use cutis_solver::Solver;
use nalgebra::Point3;

/// The length scales of every problem: results may not depend on the unit of length.
const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];

/// `points` in another unit of length.
fn scaled(points: &[Point3<f64>], scale: f64) -> Vec<Point3<f64>> {
    points.iter().map(|p| p * scale).collect()
}

/// The solver's positions in double precision, divided by `scale`.
fn positions<T: Scalar>(solver: &mut impl Solver<T>, scale: f64) -> Vec<Point3<f64>> {
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

/// Runs `test` on each GPU adapter of the machine. Without one the test is left out with a word, or fails where one is required.
fn on_each_adapter(mut test: impl FnMut(&Gpu)) {
    let adapters = cutis_gpu::adapters();
    if adapters.is_empty() {
        let required = ["CI", "CUTIS_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some());
        assert!(!required, "this test needs a GPU adapter; a software one is enough");
        eprintln!("left out: there is no GPU adapter");
    }
    for adapter in adapters {
        let options = GpuOptions { select: Select::Index(adapter.index), ..GpuOptions::default() };
        test(&Gpu::open(&options).unwrap());
    }
}
