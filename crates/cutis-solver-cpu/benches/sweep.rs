//! Time of one sweep over all edges and over all tetrahedra of a Kuhn lattice, as constraints per
//! second, for each number of SIMD lanes that the processor has.
//!
//! Run `cargo bench -p cutis-solver-cpu`. With `CUTIS_BENCH_SIZE="129 129 76"` the lattice has as
//! many vertices along its axes instead of 65, 65 and 38. The time of a step includes one sweep and
//! the two passes over the vertices.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use cutis_coloring::Groups;
use cutis_constraints::{Distance, SimdLevel, Volume};
use cutis_solver::{Formulation, Settings, Solver, Stiffness, System, SystemBuilder};
use cutis_solver_cpu::SolverCpu;
use cutis_test_kit::Kuhn;

/// The lattice, which the variable `CUTIS_BENCH_SIZE` may change: vertices along x, y and z.
fn lattice() -> Kuhn {
    let size = std::env::var("CUTIS_BENCH_SIZE").unwrap_or_else(|_| "65 65 38".into());
    let size: Vec<usize> = size.split(' ').map(|n| n.parse().expect("a number of vertices")).collect();
    Kuhn::new(size.try_into().expect("three numbers"), 0.1)
}

/// Settings of position-based dynamics with one iteration. Gravity is weak, so that the body keeps
/// its shape however many frames are measured.
fn projection() -> Settings {
    Settings {
        formulation: Formulation::Pbd,
        dt_s: 0.005,
        substeps: 1,
        iterations: 1,
        gravity_m_s2: [0.0, -0.01, 0.0],
        damping_per_s: 0.0,
        relaxation: 1.0,
    }
}

fn builder(lattice: &Kuhn) -> SystemBuilder<f32> {
    let masses: Vec<f32> = lattice.positions.iter().map(|p| if p.x == 0.0 { 0.0 } else { 1.0 }).collect();
    SystemBuilder::new(&lattice.positions, &masses).expect("a valid lattice")
}

fn with_edges(builder: SystemBuilder<f32>, lattice: &Kuhn, stiffness: Stiffness<f32>) -> SystemBuilder<f32> {
    let groups = Groups::from_colors(&lattice.edge_colors).expect("few constraints");
    builder
        .add_from_rest::<Distance, 2>(&lattice.edges, &Default::default(), stiffness, &groups)
        .expect("valid edges")
}

fn with_tets(builder: SystemBuilder<f32>, lattice: &Kuhn, stiffness: Stiffness<f32>) -> SystemBuilder<f32> {
    let groups = Groups::from_colors(&lattice.tet_colors).expect("few constraints");
    builder
        .add_from_rest::<Volume, 4>(&lattice.tets, &Default::default(), stiffness, &groups)
        .expect("valid tetrahedra")
}

fn edges(lattice: &Kuhn) -> System<f32> {
    with_edges(builder(lattice), lattice, Stiffness::pbd(1.0)).build()
}

fn tets(lattice: &Kuhn) -> System<f32> {
    with_tets(builder(lattice), lattice, Stiffness::pbd(1.0)).build()
}

fn both(lattice: &Kuhn) -> System<f32> {
    let edges = with_edges(builder(lattice), lattice, Stiffness::compliance(1e-4));
    with_tets(edges, lattice, Stiffness::compliance(1e-7)).build()
}

fn sweeps(criterion: &mut Criterion) {
    let lattice = lattice();
    type Case = (&'static str, fn(&Kuhn) -> System<f32>, usize);
    let cases: [Case; 2] = [("edges", edges, lattice.edges.len()), ("tets", tets, lattice.tets.len())];
    for (name, system, count) in cases {
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(count as u64)).sample_size(20);
        for threads in [1, 2] {
            for level in SimdLevel::available() {
                let solver = SolverCpu::new(system(&lattice), projection(), Some(threads));
                let mut solver = solver.expect("a valid system").with_level(level);
                let name = format!("{} lanes, threads", level.lanes());
                group.bench_function(BenchmarkId::new(name, threads), |bencher| {
                    bencher.iter(|| solver.step(1).expect("finite"));
                });
            }
        }
        group.finish();
    }
}

/// Time of a frame of five iterations over edges and tetrahedra, as in the comparison with other
/// programs.
fn frames(criterion: &mut Criterion) {
    let lattice = lattice();
    let mut group = criterion.benchmark_group("frame");
    group.throughput(Throughput::Elements(lattice.positions.len() as u64)).sample_size(20);
    for threads in [1, 2] {
        let settings = Settings { iterations: 5, ..projection() };
        let edges = with_edges(builder(&lattice), &lattice, Stiffness::pbd(1.0));
        let system = with_tets(edges, &lattice, Stiffness::pbd(1.0)).build();
        let mut solver = SolverCpu::new(system, settings, Some(threads)).expect("a valid system");
        group.bench_function(BenchmarkId::new("threads", threads), |bencher| {
            bencher.iter(|| solver.step(1).expect("finite"));
        });
    }
    group.finish();
}

/// Time of one iteration of vertex block descent over edges and tetrahedra, as vertices per second.
fn descent(criterion: &mut Criterion) {
    let lattice = lattice();
    let mut group = criterion.benchmark_group("descent");
    group.throughput(Throughput::Elements(lattice.positions.len() as u64)).sample_size(20);
    for threads in [1, 2] {
        let settings = Settings {
            formulation: Formulation::Vbd,
            dt_s: 0.005,
            substeps: 1,
            gravity_m_s2: [0.0, -9.81, 0.0],
            ..Settings::default()
        };
        for level in SimdLevel::available() {
            let solver = SolverCpu::new(both(&lattice), settings, Some(threads));
            let mut solver = solver.expect("a valid system").with_level(level);
            let name = format!("{} lanes, threads", level.lanes());
            group.bench_function(BenchmarkId::new(name, threads), |bencher| {
                bencher.iter(|| solver.step(1).expect("finite"));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, sweeps, frames, descent);
criterion_main!(benches);
