//! Traffic between host and device: a frame is one submission and a readback of twelve bytes, and
//! measurements read only what they need.

use cutis_gpu::{Counters, GpuOptions};
use cutis_solver::{Formulation, Solver, SolverReference};
use cutis_solver_gpu::{SolverGpu, device_bytes};
use cutis_test_kit::gpu::{on_each_adapter, on_each_adapter_with};

use crate::body::{Parts, body, settings};

/// Runs `work` and returns its submissions, readbacks and bytes read.
fn traffic(solver: &mut SolverGpu, work: impl FnOnce(&mut SolverGpu)) -> [u64; 3] {
    let [before, after] = [solver.gpu().counters(), {
        work(solver);
        solver.gpu().counters()
    }];
    let of = |count: fn(&Counters) -> u64| count(&after) - count(&before);
    [of(|c| c.submits), of(|c| c.readbacks), of(|c| c.readback_bytes)]
}

#[test]
fn a_frame_is_one_submission_and_a_readback_of_twelve_bytes() {
    on_each_adapter(|gpu| {
        let parts = Parts::all(Formulation::Xpbd);
        let mut solver = SolverGpu::new(gpu, body(parts), settings(&parts, 2)).unwrap();
        assert_eq!(traffic(&mut solver, |s| s.step(1).unwrap()), [1, 1, 12]);
        assert_eq!(traffic(&mut solver, |s| s.step(5).unwrap()), [5, 1, 12]);
        assert_eq!(traffic(&mut solver, |s| s.step(0).unwrap()), [0, 0, 0]);

        let some = [3, 700, 5];
        let [submits, readbacks, bytes] =
            traffic(&mut solver, |s| assert_eq!(s.positions_of(&some).unwrap().len(), 3));
        assert_eq!([submits, readbacks, bytes], [1, 1, 48], "only the three vertices");

        // All positions and velocities are read once, and not again while they stay the same.
        let count = solver.vertices().len() as u64;
        let [_, readbacks, bytes] = traffic(&mut solver, |s| drop(s.positions().unwrap()));
        assert_eq!([readbacks, bytes], [2, 32 * count]);
        let again = traffic(&mut solver, |s| {
            s.velocities().unwrap();
            s.energy().unwrap();
            s.positions_of(&some).unwrap();
        });
        assert_eq!(again, [0, 0, 0]);
        let [_, _, bytes] = traffic(&mut solver, |s| drop(s.residuals().unwrap()));
        assert!(bytes < 4 * count, "{bytes} bytes for the residuals");
    });
}

#[test]
fn positions_of_some_vertices_equal_those_of_all() {
    on_each_adapter_with(&GpuOptions { chunk_cap: Some(64), ..GpuOptions::default() }, |gpu| {
        let parts = Parts::all(Formulation::Xpbd);
        let mut solver = SolverGpu::new(gpu, body(parts), settings(&parts, 1)).unwrap();
        solver.step(2).unwrap();
        let chosen: Vec<u32> = (0..solver.vertices().len() as u32).rev().step_by(3).collect();
        let found = solver.positions_of(&chosen).unwrap();
        let other = solver.positions_of(&chosen[1..]).unwrap();
        let all = solver.positions().unwrap();
        let expected: Vec<_> = chosen.iter().map(|&v| all[v as usize]).collect();
        assert!(found == expected);
        assert!(other == expected[1..]);
        assert!(solver.positions_of(&[all.len() as u32]).is_err());
    });
}

#[test]
fn residuals_by_reduction_agree_with_the_host() {
    on_each_adapter_with(&GpuOptions { chunk_cap: Some(100), ..GpuOptions::default() }, |gpu| {
        let parts = Parts::all(Formulation::Pbd);
        let mut solver = SolverGpu::new(gpu, body(parts), settings(&parts, 2)).unwrap();
        solver.step(3).unwrap();
        let found = solver.residuals().unwrap();
        let expected = solver.system().unwrap().residuals();
        assert_eq!(found.len(), 4);
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(found.name, expected.name);
            assert!(expected.rms > 1e-4, "{}: the residual is too small to compare", expected.name);
            for (a, b) in [(found.rms, expected.rms), (found.max, expected.max)] {
                assert!((a / b - 1.0).abs() < 2e-6, "{}: {a} instead of {b}", found.name);
            }
        }
        solver.step(1).unwrap();
        assert_ne!(solver.residuals().unwrap(), found, "control: another state");
    });
}

/// Kinds, handles and multipliers have kernels and buffers only if a body uses them.
#[test]
fn only_parts_in_use_have_kernels_and_buffers() {
    on_each_adapter(|gpu| {
        let kernels = |parts: Parts, iterations| {
            let before = gpu.counters();
            let solver = SolverGpu::new(gpu, body(parts), settings(&parts, iterations)).unwrap();
            let after = gpu.counters();
            let parts: u64 = solver.device_bytes().iter().map(|part| part.bytes as u64).sum();
            // The uniforms and the status have 16 to 32 bytes each.
            let extra = after.buffer_bytes - before.buffer_bytes - parts;
            assert!(extra < 4096, "{extra} bytes more than reported");
            after.kernels - before.kernels
        };
        let none = Parts::none(Formulation::Xpbd);
        assert_eq!(kernels(none, 1), 5, "the five passes over vertices");
        assert_eq!(kernels(Parts { distance: true, ..none }, 1), 6);
        assert_eq!(
            kernels(Parts { distance: true, ..none }, 2),
            7,
            "a kernel for the first iteration and one for later ones"
        );
        assert_eq!(kernels(Parts { distance: true, handle: true, ..none }, 1), 7);
        assert_eq!(kernels(Parts::all(Formulation::Xpbd), 1), 9);
        // Descent has five passes, another prediction, the vertex steps, and a kernel per kind.
        assert_eq!(kernels(Parts::none(Formulation::Vbd), 1), 7);
        assert_eq!(kernels(Parts { handle: false, ..Parts::all(Formulation::Vbd) }, 2), 10);
        assert_eq!(gpu.counters().buffer_bytes, 0, "the solver frees all buffers");
    });
}

#[test]
fn the_memory_can_be_computed_without_a_device() {
    let parts = Parts::all(Formulation::Xpbd);
    let system = body::<f32>(parts);
    let names = |iterations| {
        let parts = device_bytes(&system, &settings(&parts, iterations));
        parts.iter().map(|part| part.name).collect::<Vec<_>>()
    };
    assert_eq!(names(1), ["vertices", "loads", "distance", "stc", "volume", "handles"]);
    assert_eq!(names(2), ["vertices", "loads", "distance", "stc", "volume", "multipliers", "handles"]);
    let solver = SolverReference::new(system, settings(&parts, 1)).unwrap();
    assert_eq!(solver.bytes()[0].bytes, 12 * 9 * 7 * 40, "the host has another layout");
}
