//! The passes over vertices: prediction, velocity update, both in one, and the check for finite
//! numbers.

use cutis_gpu::{Binding, Buffer, Gpu, GpuError};
use cutis_shaders::solver;
use cutis_solver::{Formulation, Integrator, Settings, Simulation, Solver, SolverReference, System, Vertex};
use nalgebra::Vector3;

use super::replaced;
use crate::parity::bench::{Bench, Failure};
use crate::parity::bodies::Plan;
use crate::parity::comparison::{Measured, Ring};
use crate::parity::difference::{Difference, triples};

/// Result of the check if all vertices are finite.
const NONE: u32 = u32::MAX;

pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    integrate(bench)?;
    check(bench)
}

/// Free and fixed vertices without constraints.
fn system() -> Result<System<f32>, Failure> {
    let (formulation, kinds) = (Formulation::Xpbd, &[][..]);
    Plan { size: [13, 11, 9], formulation, kinds, each: false, fixed: true, handles: false, softness: 1.0 }
        .system()
}

fn settings(substeps: u32) -> Settings {
    let gravity_m_s2 = [0.31, -9.81, 1.7];
    // A large step, so that a thousandth of the effect of gravity shows on hardware too.
    Settings { dt_s: 0.3, substeps, gravity_m_s2, damping_per_s: 0.7, ..Settings::default() }
}

/// Initial velocities in m/s.
fn velocities(count: usize) -> Vec<Vector3<f32>> {
    let wave = |n: usize| (n as f32 * 0.37).sin();
    (0..count).map(|n| Vector3::new(wave(n), -2.0 * wave(n + 1), 0.7 * wave(2 * n))).collect()
}

/// `predict`, `finish_and_predict` and `finish`: one frame of one and of three substeps without
/// constraints.
fn integrate(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    for substeps in [1, 3] {
        let middle = if substeps == 1 { "" } else { "finish and predict, " };
        let name = format!("integrate: predict, {middle}finish");
        let settings = settings(substeps);
        let measure = |gpu: &Gpu, policy, source: &str| {
            let mut cpu = SolverReference::<f32>::new(system()?, settings)?;
            let positions = cpu.positions()?;
            let start = velocities(positions.len());
            cpu.restore(&positions, &start, 0)?;
            let [found, fast] = on_gpu(gpu, source, &system()?, &start, settings)?;
            cpu.step(1)?;
            let system = cpu.system()?;
            let expected: &[[f32; 4]] = bytemuck::cast_slice(system.vertices());
            let speeds = system.velocities();
            let fastest = speeds.iter().fold(0.0, |most: f32, v| most.max(v.amax()));
            let extent = extent(expected);
            let difference = Difference::default().add(triples(&found), triples(expected), extent);
            // A velocity is a difference of positions over a time.
            let scale = f64::from(fastest).max(extent / settings.substep_s());
            let speeds = speeds.iter().flat_map(|v| [v.x, v.y, v.z]);
            Ok(difference.add(triples(&fast), speeds, scale).judged(policy))
        };
        bench.compare(Ring::Kernel, &name, |gpu, policy| {
            measure(gpu, policy, &solver::vertices(solver::Loads::None))
        })?;
        for (what, from, to) in [
            ("gravity × 1.001", "+ settings.gravity_h)", "+ settings.gravity_h * 1.001)"),
            ("velocity × 1.001", "(velocity +", "(velocity * 1.001 +"),
            ("fixed vertices move", "vertex.w > 0.0", "vertex.w >= 0.0"),
            ("another damping", "* settings.velocity_factor", "* (settings.velocity_factor * 1.001)"),
        ] {
            bench.control(Ring::Kernel, &name, what, |gpu, policy| {
                measure(gpu, policy, &replaced(&solver::vertices(solver::Loads::None), from, to)?)
            })?;
        }
    }
    Ok(())
}

fn extent(vertices: &[[f32; 4]]) -> f64 {
    triples(vertices).fold(0.0, |most: f64, x| most.max(f64::from(x).abs()))
}

/// Vertices and velocities after a frame.
fn on_gpu(
    gpu: &Gpu,
    source: &str,
    system: &System<f32>,
    velocities: &[Vector3<f32>],
    settings: Settings,
) -> Result<[Vec<[f32; 4]>; 2], Failure> {
    let buffers = Buffers::new(gpu, system.vertices(), velocities, settings)?;
    buffers.run(gpu, source, "predict", &[0, 1, 2, 3])?;
    for _ in 1..settings.substeps {
        buffers.run(gpu, source, "finish_and_predict", &[0, 1, 3, 4, 5])?;
    }
    buffers.run(gpu, source, "finish", &[0, 1, 2, 3, 4, 5])?;
    let all = 0..system.vertices().len();
    Ok([gpu.read(&buffers.vertices, all.clone())?, gpu.read(&buffers.velocities, all)?])
}

/// `check` finds the first vertex that is not finite.
fn check(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let name = "check: the first vertex that is not finite";
    let measure = |gpu: &Gpu, source: &str| {
        let mut worst = 0.0;
        let cases = [None, Some((0, f32::NAN)), Some((700, f32::INFINITY)), Some((1286, f32::NEG_INFINITY))];
        for (n, case) in cases.iter().enumerate() {
            let system = system()?;
            let mut vertices = system.vertices().to_vec();
            for (vertex, value) in case.iter().flat_map(|&(first, value)| [(first, value), (1286, value)]) {
                let mut place = vertices[vertex].position();
                place[n % 3] = value;
                vertices[vertex].set_position(place);
            }
            let expected =
                vertices.iter().position(|vertex| !vertex.is_finite()).map_or(NONE, |vertex| vertex as u32);
            let buffers = Buffers::new(gpu, &vertices, &velocities(vertices.len()), settings(1))?;
            buffers.run(gpu, source, "check", &[0, 4, 5])?;
            let found = gpu.read(&buffers.status, 0..1)?[0];
            worst = f64::max(worst, f64::from(found.abs_diff(expected)));
        }
        Ok(Measured::at_most(cases.len() as u64, worst, 0.0, "a vertex"))
    };
    bench.compare(Ring::Kernel, name, |gpu, _| measure(gpu, &solver::vertices(solver::Loads::None)))?;
    for (what, from, to) in [
        ("a coordinate is not checked", "is_finite(x.y)", "is_finite(x.x)"),
        (
            "the last vertex that is not finite",
            "atomicMin(&status.vertex, first + i)",
            "atomicStore(&status.vertex, first + i + 1u)",
        ),
    ] {
        bench.control(Ring::Kernel, name, what, |gpu, _| {
            measure(gpu, &replaced(&solver::vertices(solver::Loads::None), from, to)?)
        })?;
    }
    Ok(())
}

/// Buffers of the passes, in the order of their bindings.
struct Buffers {
    vertices: Buffer<[f32; 4]>,
    previous: Buffer<[f32; 4]>,
    velocities: Buffer<[f32; 4]>,
    settings: Buffer<[f32; 8]>,
    status: Buffer<u32>,
}

impl Buffers {
    fn new(
        gpu: &Gpu,
        vertices: &[Vertex<f32>],
        velocities: &[Vector3<f32>],
        settings: Settings,
    ) -> Result<Self, Failure> {
        let velocities: Vec<[f32; 4]> = velocities.iter().map(|v| [v.x, v.y, v.z, 0.0]).collect();
        let simulation = Simulation::new(system()?, settings)?;
        let &Integrator { h, velocity_factor, gravity_h: g, load_h } = simulation.integrator();
        Ok(Self {
            vertices: gpu.buffer("vertices", bytemuck::cast_slice(vertices))?,
            previous: gpu.zeroed("previous", vertices.len())?,
            velocities: gpu.buffer("velocities", &velocities)?,
            settings: gpu.uniform("settings", &[g.x, g.y, g.z, h, velocity_factor, 0.0, load_h, 0.0])?,
            status: gpu.buffer("status", &[NONE, 0, 0])?,
        })
    }

    /// Runs an entry point with the bindings `used` over all vertices, in parts if there are too
    /// many.
    fn run(&self, gpu: &Gpu, source: &str, entry: &str, used: &[u32]) -> Result<(), GpuError> {
        let kernel = gpu.kernel(entry, source, entry)?;
        let count = self.vertices.len();
        let part = gpu.chunk_len(size_of::<[f32; 4]>()).div_ceil(16) * 16;
        let mut pass = gpu.pass(entry);
        for start in (0..count).step_by(part) {
            let range = start..count.min(start + part);
            let first = gpu.uniform("first", &(start as u32))?;
            let binding = |&n: &u32| -> (u32, Binding<'_>) {
                match n {
                    0 => (n, self.vertices.range(range.clone())),
                    1 => (n, self.previous.range(range.clone())),
                    2 => (n, self.velocities.range(range.clone())),
                    3 => (n, self.settings.whole()),
                    4 => (n, first.whole()),
                    _ => (n, self.status.whole()),
                }
            };
            let bindings: Vec<_> = used.iter().map(binding).collect();
            pass.dispatch(&kernel, &[&gpu.bind(&kernel, 0, &bindings)?], range.len());
        }
        pass.submit()
    }
}
