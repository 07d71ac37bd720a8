//! Saved states, runs in several calls, and positions that become infinite.

use cutis_coloring::greedy;
use cutis_constraints::Distance;
use cutis_solver::{
    Formulation, Settings, Solver, SolverError, SolverReference, Stiffness, System, SystemBuilder,
};
use cutis_solver_gpu::{GpuSolverError, SolverGpu};
use cutis_test_kit::gpu::{is_exact, on_each_adapter};
use nalgebra::{Point3, Vector3};

use crate::body::{Parts, body, settings};

#[test]
fn one_call_for_many_frames_equals_many_calls() {
    on_each_adapter(|gpu| {
        let parts = Parts { volume: false, ..Parts::all(Formulation::Xpbd) };
        let run = |calls: &[usize]| {
            let mut solver = SolverGpu::new(gpu, body(parts), settings(&parts, 2)).unwrap();
            for &frames in calls {
                solver.step(frames).unwrap();
            }
            (solver.positions().unwrap(), solver.velocities().unwrap().to_vec(), solver.time_s())
        };
        // More frames than the solver runs between two status checks.
        assert!(run(&[70]) == run(&[1, 63, 2, 4]));
    });
}

#[test]
fn a_saved_state_continues_on_either_backend() {
    on_each_adapter(|gpu| {
        let parts = Parts::all(Formulation::Xpbd);
        let settings = settings(&parts, 1);
        let mut first = SolverGpu::new(gpu, body(parts), settings).unwrap();
        first.step(2).unwrap();
        let (positions, velocities) = (first.positions().unwrap(), first.velocities().unwrap().to_vec());
        first.step(1).unwrap();
        let mut second = SolverGpu::new(gpu, body(parts), settings).unwrap();
        second.restore(&positions, &velocities, 2).unwrap();
        assert!(second.positions().unwrap() == positions);
        second.step(1).unwrap();
        assert!(second.positions().unwrap() == first.positions().unwrap());
        assert_eq!(second.time_s(), first.time_s());
        if is_exact(gpu) {
            let mut reference = SolverReference::<f32>::new(body(parts), settings).unwrap();
            reference.restore(&positions, &velocities, 2).unwrap();
            reference.step(1).unwrap();
            assert!(reference.positions().unwrap() == first.positions().unwrap());
        }
        let error = second.restore(&positions[1..], &velocities, 2).unwrap_err();
        assert!(matches!(error, SolverError::VertexLength { what: "positions", .. }), "{error}");
    });
}

fn overflowing() -> System<f32> {
    let points = [0.0f32, 1.0, 2.0].map(|x| Point3::new(x, 0.0, 0.0));
    let velocities = [Vector3::zeros(), Vector3::zeros(), Vector3::new(1e38f32, 0.0, 0.0)];
    let springs = [[0, 1]];
    SystemBuilder::<f32>::new(&points, &[0.0f32, 1.0, 1.0])
        .unwrap()
        .velocities(&velocities)
        .unwrap()
        .add::<Distance, 2>(&springs, &[[0.5]], Stiffness::compliance(0.1), &greedy(&springs, 3).unwrap())
        .unwrap()
        .build()
}

/// As on the CPU, the error names the vertex, and the state is reset to the start of the substep
/// and can be stepped again.
#[test]
fn overflow_resets_the_state_to_the_start_of_its_substep() {
    let settings = Settings { dt_s: 12.0, substeps: 6, ..Settings::default() };
    let mut reference = SolverReference::new(overflowing(), settings).unwrap();
    let expected = reference.step(5).unwrap_err();
    assert!(matches!(expected, SolverError::NotFinite { vertex: 2, frame: 0, substep: 1, .. }), "{expected}");
    on_each_adapter(|gpu| {
        let mut solver = SolverGpu::new(gpu, overflowing(), settings).unwrap();
        assert_eq!(solver.step(5).unwrap_err(), expected);
        assert_eq!(solver.time_s(), reference.time_s());
        let kept = solver.positions().unwrap();
        if is_exact(gpu) {
            assert_eq!(kept, reference.positions().unwrap());
        }
        assert!(solver.velocities().unwrap().iter().all(|v| *v == Vector3::zeros()));
        // The rest of the frame moves only the vertex on the spring.
        solver.step(1).unwrap();
        assert_eq!(solver.positions().unwrap()[2], kept[2]);
        assert_eq!(solver.simulation().clock().substep, 0);
    });
}

#[test]
fn settings_for_another_formulation_are_rejected() {
    on_each_adapter(|gpu| {
        let parts = Parts::all(Formulation::Xpbd);
        let pbd = Settings { formulation: Formulation::Pbd, ..settings(&parts, 1) };
        let error = SolverGpu::new(gpu, body(parts), pbd).err().unwrap();
        assert!(matches!(error, GpuSolverError::Solver(SolverError::Formulation { .. })), "{error}");
    });
}
