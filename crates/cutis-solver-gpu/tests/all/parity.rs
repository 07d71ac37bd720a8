//! Results equal those of the reference solver: bit for bit on software adapters, within rounding
//! on hardware. Controls must differ.

use std::time::Instant;

use cutis_gpu::{Gpu, GpuOptions};
use cutis_solver::{Formulation, Settings, Solver, SolverReference, StepProfile};
use cutis_solver_gpu::SolverGpu;
use cutis_test_kit::gpu::{is_exact, on_each_adapter, on_each_adapter_with};
use nalgebra::{Point3, Vector3};

use crate::body::{Parts, body, settings};

/// Largest difference of positions on hardware after a few frames, relative to the body's extent.
const TOLERANCE: f32 = 1e-6;

fn state(solver: &mut dyn Solver<f32>) -> (Vec<Point3<f32>>, Vec<Vector3<f32>>) {
    (solver.positions().unwrap(), solver.velocities().unwrap().to_vec())
}

/// True if both solvers have the same state after three frames, in steps of one and two frames.
fn agree(gpu: &Gpu, parts: Parts, on_gpu: Settings, on_cpu: Settings) -> bool {
    let mut first = SolverGpu::new(gpu, body(parts), on_gpu).unwrap();
    let mut second = SolverReference::<f32>::new(body(parts), on_cpu).unwrap();
    for frames in [1, 2] {
        first.step(frames).unwrap();
        second.step(frames).unwrap();
    }
    let (found, expected) = (state(&mut first), state(&mut second));
    assert_eq!(first.time_s(), second.time_s());
    if is_exact(gpu) {
        return found == expected;
    }
    let extent = 12.0 * parts.step as f32;
    let difference = found.0.iter().zip(&expected.0).map(|(a, b)| (a - b).amax()).fold(0.0, f32::max);
    difference <= TOLERANCE * extent
}

fn assert_parity(gpu: &Gpu, parts: Parts, iterations: u32) {
    let settings = settings(&parts, iterations);
    let name = &gpu.adapter().name;
    assert!(agree(gpu, parts, settings, settings), "{name}: {parts:?}, {iterations} iterations");
    // Control: another gravity must give another state.
    let other = Settings { gravity_m_s2: settings.gravity_m_s2.map(|g| g * 1.001), ..settings };
    assert!(!agree(gpu, parts, other, settings), "{name}: {parts:?}: another gravity gives the same state");
}

#[test]
fn all_kinds_together_agree_in_every_formulation() {
    on_each_adapter(|gpu| {
        for (formulation, iterations) in
            [(Formulation::Pbd, 2), (Formulation::Xpbd, 1), (Formulation::Xpbd, 3), (Formulation::Vbd, 2)]
        {
            for step in [1e-4, 0.1, 100.0] {
                for each in [true, false] {
                    assert_parity(gpu, Parts { step, each, ..Parts::all(formulation) }, iterations);
                }
            }
        }
    });
}

#[test]
fn every_kind_alone_agrees() {
    on_each_adapter(|gpu| {
        for formulation in [Formulation::Pbd, Formulation::Xpbd, Formulation::Vbd] {
            let none = Parts::none(formulation);
            let paper = formulation == Formulation::Pbd;
            for parts in [
                none,
                Parts { distance: true, ..none },
                Parts { volume: true, ..none },
                Parts { skin: true, ..none },
                Parts { paper, ..none },
                Parts { handle: true, distance: true, ..none },
                Parts { loads: true, distance: true, ..none },
            ] {
                assert_parity(gpu, parts, 1);
            }
        }
    });
}

/// Colors and vertices are split into many chunks, and the limits are WebGPU's baseline.
#[test]
fn chunks_and_baseline_limits_do_not_change_results() {
    for chunk_cap in [Some(7), Some(100), None] {
        on_each_adapter_with(
            &GpuOptions { chunk_cap, baseline_limits: true, ..GpuOptions::default() },
            |gpu| {
                for iterations in [1, 2] {
                    assert_parity(gpu, Parts::all(Formulation::Xpbd), iterations);
                    assert_parity(gpu, Parts::all(Formulation::Vbd), iterations);
                }
            },
        );
    }
}

/// Parts are timed by the clock of the host or by the timestamps of the device.
#[test]
fn a_timed_step_has_the_same_bits_and_reports_its_parts() {
    let projected: &[&str] = &["vertices", "handles", "distance", "stc", "volume", "check"];
    let descending: &[&str] = &["vertices", "handles", "descent", "check"];
    for (formulation, expected) in [(Formulation::Xpbd, projected), (Formulation::Vbd, descending)] {
        for timestamps in [false, true] {
            on_each_adapter_with(&GpuOptions { timestamps, ..GpuOptions::default() }, |gpu| {
                let parts = Parts::all(formulation);
                let settings = settings(&parts, 2);
                let mut plain = SolverGpu::new(gpu, body(parts), settings).unwrap();
                let mut timed = SolverGpu::new(gpu, body(parts), settings).unwrap();
                plain.step(3).unwrap();
                let (mut profile, start) = (StepProfile::default(), Instant::now());
                timed.step_timed(1, &mut profile).unwrap();
                timed.step_timed(2, &mut profile).unwrap();
                let wall = start.elapsed().as_secs_f64();
                assert!(state(&mut timed) == state(&mut plain));
                let names: Vec<&str> = profile.parts().iter().map(|part| part.name).collect();
                assert_eq!(names, expected);
                assert!(profile.parts().iter().all(|part| part.seconds > 0.0) && profile.total_s() < wall);
            });
        }
    }
}
