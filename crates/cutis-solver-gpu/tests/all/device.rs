//! A lost device, and failed measurements.

use cutis_coloring::greedy;
use cutis_constraints::{Constraint, Distance, Eval, Real};
use cutis_solver::{Formulation, Handle, Settings, Solver, SolverError, Stiffness, SystemBuilder};
use cutis_solver_gpu::SolverGpu;
use cutis_test_kit::gpu::on_each_adapter;
use nalgebra::Point3;

use crate::body::{Parts, body, settings};

/// Every call returns an error, and the host keeps the state of the last readback.
#[test]
fn after_a_lost_device_the_last_known_state_remains() {
    on_each_adapter(|gpu| {
        let parts = Parts::all(Formulation::Xpbd);
        let mut solver = SolverGpu::new(gpu, body(parts), settings(&parts, 1)).unwrap();
        solver.step(2).unwrap();
        let (kept, time_s) = (solver.positions().unwrap(), solver.time_s());
        solver.step(1).unwrap();
        gpu.lose();
        let error = solver.step(1).unwrap_err();
        let SolverError::Device { backend: "gpu", ref reason, time_s: reported_s } = error else {
            panic!("{error}");
        };
        assert!(reason.contains("lost"), "{reason}");
        assert_eq!(reported_s, time_s);
        assert!(solver.step(1).is_err(), "the device stays lost");
        assert!(solver.residuals().is_err());
        assert!(solver.positions().unwrap() == kept, "the host returns its copy");
        assert!(solver.simulation().system().positions() == kept);
        assert_eq!(solver.simulation().time_s(), time_s);
    });
}

/// Springs whose WGSL declares a name that only the residual kernel uses, so that this kernel
/// fails.
struct NameClash;

impl Constraint<2> for NameClash {
    const NAME: &'static str = "clash";
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
    type Material = ();

    fn from_rest<T: Real>(x: &[Point3<T>; 2], _: &()) -> [T; 1] {
        Distance::from_rest(x, &Default::default())
    }
    fn eval<T: Real>(x: &[Point3<T>; 2], params: &[T; 1]) -> Eval<T, 2> {
        Distance::eval(x, params)
    }
    fn rest_size<T: Real>(params: &[T; 1]) -> T {
        Distance::rest_size(params)
    }
}

/// The run continues as if there had been no measurement.
#[test]
fn a_failed_measurement_does_not_change_the_run() {
    on_each_adapter(|gpu| {
        let new = || {
            let points = [0.0f32, 0.1, 0.2].map(|x| Point3::new(x, 0.0, 0.0));
            let springs = [[0, 1], [1, 2]];
            let groups = greedy(&springs, 3).unwrap();
            let soft = Stiffness::compliance(1e-3);
            let handle = Handle { vertices: vec![0], move_m: [0.0, 0.1, 0.0], at_s: 0.0, over_s: 0.05 };
            let system = SystemBuilder::<f32>::new(&points, &[1.0f32; 3])
                .unwrap()
                .add_from_rest::<NameClash, 2>(&springs, &(), soft, &groups)
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
        assert!(error.to_string().contains("clash: residual"), "{error}");
        assert_eq!(solver.time_s(), time_s);
        solver.step(1).unwrap();
        assert!(solver.positions().unwrap() == undisturbed.positions().unwrap());
    });
}
