//! A device that goes away.

use cutis_coloring::greedy;
use cutis_constraints::{Constraint, Distance, DistanceMaterial, Eval, Real};
use cutis_gpu::GpuOptions;
use cutis_solver::{Formulation, Handle, Settings, Solver, SolverError, Stiffness, SystemBuilder};
use cutis_solver_gpu::SolverGpu;
use nalgebra::Point3;

use crate::body::{Parts, body, settings};
use crate::on_each_adapter;

/// Every call says so, and the host keeps the state that it read last.
#[test]
fn a_lost_device_leaves_the_last_state_that_was_read() {
    on_each_adapter(GpuOptions::default(), |gpu| {
        let parts = Parts::all(Formulation::Xpbd);
        let mut solver = SolverGpu::new(gpu, body(parts), settings(&parts, 1)).unwrap();
        solver.step(2).unwrap();
        let (kept, time_s) = (solver.positions().unwrap(), solver.time_s());
        solver.step(1).unwrap();
        gpu.lose();
        let error = solver.step(1).unwrap_err();
        let SolverError::Device { backend: "gpu", ref reason, time_s: said } = error else {
            panic!("{error}");
        };
        assert!(reason.contains("lost"), "{reason}");
        assert_eq!(said, time_s);
        assert!(solver.step(1).is_err(), "it stays lost");
        assert!(solver.residuals().is_err());
        assert!(solver.positions().unwrap() == kept, "what the host has, it gives");
        assert!(solver.simulation().system().positions() == kept);
        assert_eq!(solver.simulation().time_s(), time_s);
    });
}

/// Springs that claim a name which only the measure uses.
struct Named;

impl Constraint<2> for Named {
    const NAME: &'static str = "named";
    const WGSL: &'static str = concat!(
        "const sums: f32 = 1.0;",
        "struct Params { rest_length: f32 }
        fn eval(x: array<vec3f, N>, p: Params) -> Eval {
            let d = x[0] - x[1];
            let length = max(sqrt(dot(d, d)), 1e-30);
            let direction = d * (sums / length);
            return Eval(length - p.rest_length, array<vec3f, N>(direction, -direction));
        }"
    );
    type Params<T: Real> = [T; 1];
    type Material = DistanceMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 2], material: &DistanceMaterial) -> [T; 1] {
        Distance::from_rest(x, material)
    }
    fn eval<T: Real>(x: &[Point3<T>; 2], params: &[T; 1]) -> Eval<T, 2> {
        Distance::eval(x, params)
    }
    fn rest_size<T: Real>(params: &[T; 1]) -> T {
        Distance::rest_size(params)
    }
}

/// A look at the body that fails changes nothing: the run goes on as if nobody had asked.
#[test]
fn a_measure_that_fails_leaves_the_run_alone() {
    on_each_adapter(GpuOptions::default(), |gpu| {
        let new = || {
            let points = [0.0f32, 0.1, 0.2].map(|x| Point3::new(x, 0.0, 0.0));
            let springs = [[0, 1], [1, 2]];
            let groups = greedy(&springs, 3).unwrap();
            let soft = Stiffness::compliance(1e-3);
            let handle = Handle { vertices: vec![0], move_m: [0.0, 0.1, 0.0], over_s: 0.05 };
            let system = SystemBuilder::<f32>::new(&points, &[1.0f32; 3])
                .unwrap()
                .add_from_rest::<Named, 2>(&springs, &Default::default(), soft, &groups)
                .unwrap()
                .handle(handle)
                .unwrap()
                .build();
            SolverGpu::new(gpu, system, Settings::default()).unwrap()
        };
        let mut undisturbed = new();
        undisturbed.step(3).unwrap();

        let mut solver = new();
        solver.step(2).unwrap();
        let time_s = solver.time_s();
        let error = solver.residuals().unwrap_err();
        assert!(error.to_string().contains("named: residual"), "{error}");
        assert_eq!(solver.time_s(), time_s);
        solver.step(1).unwrap();
        assert!(solver.positions().unwrap() == undisturbed.positions().unwrap());
    });
}
