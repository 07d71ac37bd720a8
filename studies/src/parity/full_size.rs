//! The lattice of the largest volume of the paper with three kinds of constraints: one step within
//! the baseline limits of WebGPU.
//!
//! Only one body is in memory at a time. The body of the device is dropped before the body of the
//! CPU is built.

use std::time::Instant;

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{Distance, SkinTension, SkinTensionMaterial, Volume};
use cutis_solver::{Formulation, MemoryPart, Settings, Solver, Stiffness, System, SystemBuilder};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;
use nalgebra::{Point3, Vector3};

use super::bench::{Bench, Failure};
use super::comparison::Ring;
use super::difference::Difference;
use cutis_test_kit::Kuhn;

/// Vertices along each axis.
const SIZE: [usize; 3] = [129, 129, 289];
/// Length of a lattice step in m.
const STEP: f64 = 3e-3;

const SETTINGS: Settings = Settings {
    formulation: Formulation::Xpbd,
    dt_s: 1.0 / 60.0,
    substeps: 1,
    iterations: 1,
    gravity_m_s2: [0.0, 0.0, -9.81],
    damping_per_s: 0.0,
    relaxation: 1.0,
};

/// Runs the ring.
pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let name = format!("{} × {} × {} vertices, three kinds, one XPBD step", SIZE[0], SIZE[1], SIZE[2]);
    let gpu = bench.gpu.clone();
    let mut details: Vec<(&'static str, f64)> = Vec::new();

    bench.log.line("  building the body for the device")?;
    let (system, built_s) = timed(system)?;
    for kind in system.kinds() {
        bench.log.line(&format!("  {}: {} in {} colors", kind.name(), kind.len(), kind.colors()))?;
    }
    let (rest, velocities) = (system.positions(), system.velocities().to_vec());
    details.push(("vertices", rest.len() as f64));
    details.push(("constraints", system.kinds().iter().map(|kind| kind.len() as f64).sum()));
    details.push(("host: body, GiB", gib(&system.bytes())));
    details.push(("host: time to build, s", built_s));
    bench.log.line("  uploading and stepping it on the device")?;
    let (mut on_gpu, uploaded_s) = timed(|| Ok(SolverGpu::new(&gpu, system, SETTINGS)?))?;
    details.push(("device: upload and kernels, s", uploaded_s));
    details.push(("device: planned, GiB", gib(&on_gpu.device_bytes())));
    details.push(("device: allocated, GiB", gpu.counters().buffer_bytes as f64 / GIB));
    let before = gpu.counters().dispatches;
    let (_, first_s) = timed(|| Ok(on_gpu.step(1)?))?;
    details.push(("device: first step, s", first_s));
    details.push(("device: dispatches of a step", (gpu.counters().dispatches - before) as f64));
    let found = on_gpu.positions()?;

    bench.log.line("  the control: the same with other velocities")?;
    let faster: Vec<Vector3<f32>> = velocities.iter().map(|v| v * 1.001).collect();
    on_gpu.restore(&rest, &faster, 0)?;
    let (_, second_s) = timed(|| Ok(on_gpu.step(1)?))?;
    details.push(("device: second step, s", second_s));
    let wrong = on_gpu.positions()?;
    drop((on_gpu, rest, velocities, faster));

    bench.log.line("  building the body again, for the CPU backend")?;
    let mut on_cpu = SolverCpu::new(self::system()?, SETTINGS, None)?;
    let (_, cpu_s) = timed(|| Ok(on_cpu.step(1)?))?;
    details.push(("CPU backend: first step, s", cpu_s));
    let expected = on_cpu.positions()?;
    drop(on_cpu);
    details.extend(
        peak_gib().map(|peak| ("host: peak of the process, device memory in it on software, GiB", peak)),
    );

    let numbers =
        |positions: &[Point3<f32>]| positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect::<Vec<_>>();
    let judged = |found: &[Point3<f32>], policy| {
        Difference::default().add(numbers(found), numbers(&expected), STEP * SIZE[2] as f64).judged(policy)
    };
    let row = bench.compare(Ring::FullSize, &name, |_, policy| Ok(judged(&found, policy)))?;
    row.details.extend(details);
    bench.control(Ring::FullSize, &name, "velocities × 1.001", |_, policy| Ok(judged(&wrong, policy)))
}

/// A block with skin on all sides. Its lowest layer is fixed, and its velocities deform it.
fn system() -> Result<System<f32>, Failure> {
    let Kuhn { positions, edges, edge_colors, tets, tet_colors } = Kuhn::new(SIZE, STEP);
    let layer = SIZE[0] * SIZE[1];
    let masses: Vec<f32> = (0..positions.len()).map(|n| if n < layer { 0.0 } else { 3.7e4 }).collect();
    let wave = |p: &Point3<f64>| {
        let [x, y, z] = [p.x, p.y, p.z].map(|c| (c * 40.0) as f32);
        Vector3::new(y.sin(), z.cos(), (x + y).sin()) * 0.3
    };
    let velocities: Vec<Vector3<f32>> = positions.iter().map(wave).collect();
    let count = positions.len();
    let builder = SystemBuilder::<f32>::new(&positions, &masses)?.velocities(&velocities)?;
    drop((positions, masses, velocities));
    let groups = Groups::from_colors(&edge_colors)?;
    let stiffness = Stiffness::compliance(0.07);
    let builder = builder.add_from_rest::<Distance, 2>(&edges, &Default::default(), stiffness, &groups)?;
    drop((edges, edge_colors, groups));
    let groups = Groups::from_colors(&tet_colors)?;
    let stiffness = Stiffness::compliance(1e-13);
    let builder = builder.add_from_rest::<Volume, 4>(&tets, &Default::default(), stiffness, &groups)?;
    drop((tets, tet_colors, groups));
    let skin = skin();
    let groups = greedy(&skin, count)?;
    let material = SkinTensionMaterial { rest_area_scale: 0.9, amplification: 2.0 };
    let stiffness = Stiffness::compliance(1e-7);
    Ok(builder.add_from_rest::<SkinTension, 3>(&skin, &material, stiffness, &groups)?.build())
}

/// Two triangles for each square on the six sides.
fn skin() -> Vec<[u32; 3]> {
    let strides = [1, SIZE[0], SIZE[0] * SIZE[1]];
    let mut triangles = Vec::new();
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [0, SIZE[axis] - 1] {
            for u in 0..SIZE[a] - 1 {
                for v in 0..SIZE[b] - 1 {
                    let corner = side * strides[axis] + u * strides[a] + v * strides[b];
                    let across = corner + strides[a] + strides[b];
                    for other in [corner + strides[a], corner + strides[b]] {
                        triangles.push([corner, other, across].map(|vertex| vertex as u32));
                    }
                }
            }
        }
    }
    triangles
}

fn timed<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<(T, f64), Failure> {
    let start = Instant::now();
    let done = work()?;
    Ok((done, start.elapsed().as_secs_f64()))
}

const GIB: f64 = (1u64 << 30) as f64;

fn gib(parts: &[MemoryPart]) -> f64 {
    parts.iter().map(|part| part.bytes).sum::<usize>() as f64 / GIB
}

/// Peak memory of this process. `None` if the system does not report it.
fn peak_gib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024.0 / GIB)
}
