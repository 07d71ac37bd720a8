//! Vertices moved by kinematic handles, and the readback of chosen vertices, on a body without
//! constraints.

use cutis_gpu::Gpu;
use cutis_solver::{Formulation, Settings, Solver, SolverReference};
use cutis_solver_gpu::SolverGpu;

use crate::parity::bench::{Bench, Failure};
use crate::parity::bodies::Plan;
use crate::parity::comparison::Ring;
use crate::parity::difference::Difference;

const PLAN: Plan<'static> = Plan {
    size: [13, 11, 9],
    formulation: Formulation::Xpbd,
    kinds: &[],
    each: false,
    fixed: true,
    handles: true,
    softness: 1.0,
};

const SETTINGS: Settings = Settings {
    formulation: Formulation::Xpbd,
    dt_s: 0.01,
    substeps: 3,
    iterations: 1,
    gravity_m_s2: [0.0, 0.0, -9.81],
    damping_per_s: 0.0,
    relaxation: 1.0,
};

pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    kinematic(bench)?;
    gather(bench)
}

/// In the second frame, one of two handles is moving and the other reaches its target.
fn kinematic(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let name = "kinematic: two handles in the third of three substeps";
    let measure = |gpu: &Gpu, policy, settings, frames| {
        let mut cpu = SolverReference::<f32>::new(PLAN.system()?, SETTINGS)?;
        let mut on_gpu = SolverGpu::new(gpu, PLAN.system()?, settings)?;
        cpu.step(2)?;
        on_gpu.step(frames)?;
        let (found, expected) = (on_gpu.positions()?, cpu.positions()?);
        let held: Vec<usize> = cpu
            .system()?
            .handles()
            .iter()
            .flat_map(|handle| handle.vertices())
            .map(|&v| v as usize)
            .collect();
        let of = |positions: &[nalgebra::Point3<f32>]| -> Vec<f32> {
            held.iter().flat_map(|&v| positions[v].coords.iter().copied().collect::<Vec<f32>>()).collect()
        };
        Ok(Difference::default().add(of(&found), of(&expected), PLAN.extent()).judged(policy))
    };
    bench.compare(Ring::Kernel, name, |gpu, policy| measure(gpu, policy, SETTINGS, 2))?;
    for (what, settings, frames) in [
        ("a frame less", SETTINGS, 1),
        ("a substep less", Settings { substeps: 2, dt_s: 0.01 * 2.0 / 3.0, ..SETTINGS }, 2),
        ("time × 1.001", Settings { dt_s: 0.01 * 1.001, ..SETTINGS }, 2),
    ] {
        bench.control(Ring::Kernel, name, what, |gpu, policy| measure(gpu, policy, settings, frames))?;
    }
    Ok(())
}

fn gather(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let name = "gather: every third vertex, backwards";
    let measure = |gpu: &Gpu, policy, off: u32| {
        let mut cpu = SolverReference::<f32>::new(PLAN.system()?, SETTINGS)?;
        let mut on_gpu = SolverGpu::new(gpu, PLAN.system()?, SETTINGS)?;
        cpu.step(1)?;
        on_gpu.step(1)?;
        let count = cpu.positions()?.len() as u32;
        let chosen: Vec<u32> = (1..count - 1).rev().step_by(3).collect();
        let other: Vec<u32> = chosen.iter().map(|vertex| vertex + off).collect();
        let numbers =
            |positions: Vec<nalgebra::Point3<f32>>| positions.into_iter().flat_map(|p| [p.x, p.y, p.z]);
        let found = numbers(on_gpu.positions_of(&other)?);
        Ok(Difference::default()
            .add(found, numbers(cpu.positions_of(&chosen)?), PLAN.extent())
            .judged(policy))
    };
    bench.compare(Ring::Kernel, name, |gpu, policy| measure(gpu, policy, 0))?;
    bench.control(Ring::Kernel, name, "off by one", |gpu, policy| measure(gpu, policy, 1))
}
