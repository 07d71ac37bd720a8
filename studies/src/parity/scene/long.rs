//! Long runs: rounding errors grow from step to step, so that on hardware only conserved quantities
//! are compared.
//!
//! A free body without outer forces keeps its momentum, and its energy does not grow. Its angular
//! momentum changes with the length of a step, on the CPU as well. On software adapters every
//! position has to equal the position of the CPU.

use cutis_constraints::{Constraint, Distance, DistanceMaterial, Eval, Real};
use cutis_gpu::Gpu;
use cutis_solver::{Energy, Formulation, Momentum, Settings, Solver, Stiffness, SystemBuilder, Vertex};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;
use nalgebra::{Point3, Vector3};

use crate::parity::bench::{Bench, Effort, Failure};
use crate::parity::bodies::{ConstraintKind, Plan, STEP};
use crate::parity::comparison::{Measured, Ring};
use crate::parity::difference::{Difference, Policy, triples};
use cutis_test_kit::Kuhn;

const PLAN: Plan<'static> = Plan {
    size: [9, 7, 6],
    formulation: Formulation::Xpbd,
    kinds: &[ConstraintKind::Distance, ConstraintKind::Volume, ConstraintKind::SkinTension],
    each: true,
    fixed: false,
    handles: false,
    softness: 100.0,
};

const SETTINGS: Settings = Settings {
    formulation: Formulation::Xpbd,
    dt_s: 1.0 / 60.0,
    substeps: 1,
    iterations: 1,
    gravity_m_s2: [0.0; 3],
    damping_per_s: 0.0,
    relaxation: 1.0,
};

/// Largest change of the momentum over the sum of `m|v|` at the start. Rounding causes 5e-6 in 60
/// frames and 3e-5 in 600. A gradient with an error of a thousandth causes 1e-3.
const MOMENTUM: f64 = 2e-4;
/// Largest energy over the energy at the start. XPBD with a large step loses energy and must not
/// gain any.
const ENERGY: f64 = 1.001;

/// Result of a run.
struct RunResult {
    vertices: Vec<[f32; 4]>,
    start: (Momentum, Energy),
    end: (Momentum, Energy),
    /// `Σ m|v|` at the start.
    impulse: f64,
}

pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let frames = if bench.effort == Effort::Quick { 60 } else { 600 };
    let of = format!("free body, {frames} frames");
    let on_gpu = |gpu: &Gpu, settings| ran(&mut SolverGpu::new(gpu, PLAN.system()?, settings)?, frames);
    let pushed = Settings { gravity_m_s2: [0.0, 0.0, 1e-3], ..SETTINGS };
    let push = "gravity of 1e-3 m/s²";

    if bench.policy == Policy::Exact {
        let expected = ran(&mut SolverCpu::new(PLAN.system()?, SETTINGS, None)?, frames)?;
        let name = format!("{of}: positions");
        let measure = |found: RunResult| {
            Difference::default()
                .add(triples(&found.vertices), triples(&expected.vertices), PLAN.extent())
                .judged(Policy::Exact)
        };
        bench.compare(Ring::Scene, &name, |gpu, _| Ok(measure(on_gpu(gpu, SETTINGS)?)))?;
        bench.control(Ring::Scene, &name, push, |gpu, _| Ok(measure(on_gpu(gpu, pushed)?)))?;
    }

    let name = format!("{of}: momentum");
    bench.compare(Ring::Invariant, &name, |gpu, _| Ok(on_gpu(gpu, SETTINGS)?.momentum()))?;
    bench.control(Ring::Invariant, &name, push, |gpu, _| Ok(on_gpu(gpu, pushed)?.momentum()))?;
    bench.control(Ring::Invariant, &name, "one gradient × 1.001", |gpu, _| {
        Ok(ran(&mut wrong::<LOPSIDED>(gpu)?, frames)?.momentum())
    })?;

    let name = format!("{of}: energy");
    bench.compare(Ring::Invariant, &name, |gpu, _| Ok(on_gpu(gpu, SETTINGS)?.energy()))?;
    bench.control(Ring::Invariant, &name, "rest lengths × 1.2", |gpu, _| {
        Ok(ran(&mut wrong::<OVERLONG>(gpu)?, frames)?.energy())
    })
}

/// Runs a body that rotates and pulsates, without momentum.
fn ran(solver: &mut dyn Solver<f32>, frames: usize) -> Result<RunResult, Failure> {
    let of = |vertex: &Vertex<f32>| {
        let p = vertex.position();
        let turn = Vector3::new(-0.6, 1.0, 1.6).cross(&p.coords);
        turn + p.coords * (9.0 * p.x).sin()
    };
    let positions = solver.positions()?;
    let velocities: Vec<Vector3<f32>> = solver.system()?.vertices().iter().map(of).collect();
    solver.restore(&positions, &velocities, 0)?;
    let start = (solver.momentum()?, solver.energy()?);
    let vertices = solver.system()?.vertices().iter();
    let impulse = vertices.zip(&velocities).map(|(x, v)| f64::from(v.norm() / x.inverse_mass())).sum();
    solver.step(frames)?;
    let end = (solver.momentum()?, solver.energy()?);
    let vertices = bytemuck::cast_slice(solver.system()?.vertices()).to_vec();
    Ok(RunResult { vertices, start, end, impulse })
}

impl RunResult {
    fn momentum(&self) -> Measured {
        let change = self.end.0.linear - self.start.0.linear;
        Measured::at_most(3, change.norm() / self.impulse, MOMENTUM, "Σ m|v|")
    }

    fn energy(&self) -> Measured {
        let ratio = self.end.1.total_j() / self.start.1.total_j();
        Measured::at_most(1, ratio, ENERGY, "energy at the start")
    }
}

/// Springs with a fault in the shader and none in Rust.
struct WrongSprings<const WHAT: u8>;

/// The gradient of one end is larger by a thousandth.
const LOPSIDED: u8 = 0;
/// The rest lengths are larger by a fifth.
const OVERLONG: u8 = 1;

macro_rules! springs {
    ($gradient:literal, $length:literal) => {
        concat!(
            "struct Params { rest_length: f32 }
            fn eval(x: array<vec3f, N>, p: Params) -> Eval {
                let d = x[0] - x[1];
                let length = max(sqrt(dot(d, d)), 1e-30);
                let direction = d * (1.0 / length);
                let gradients = array<vec3f, N>(",
            $gradient,
            " * direction, -direction);
                return Eval(length - ",
            $length,
            " * p.rest_length, gradients);
            }"
        )
    };
}

impl<const WHAT: u8> Constraint<2> for WrongSprings<WHAT> {
    const NAME: &'static str = "wrong distance";
    const WGSL: &'static str = match WHAT {
        LOPSIDED => springs!("1.001", "1.0"),
        _ => springs!("1.0", "1.2"),
    };
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

/// The body with the faulty springs.
fn wrong<const WHAT: u8>(gpu: &Gpu) -> Result<SolverGpu, Failure> {
    let whole = PLAN.system()?;
    let positions = whole.positions();
    let masses: Vec<f32> = whole.vertices().iter().map(Vertex::inverse_mass).collect();
    let edges = Kuhn::new(PLAN.size, STEP).edges;
    let groups = cutis_coloring::greedy(&edges, positions.len())?;
    let stiffness = Stiffness::compliance(1e-3);
    let system = SystemBuilder::<f32>::new(&positions, &masses)?
        .add_from_rest::<WrongSprings<WHAT>, 2>(&edges, &Default::default(), stiffness, &groups)?
        .build();
    Ok(SolverGpu::new(gpu, system, SETTINGS)?)
}
