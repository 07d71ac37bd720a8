//! Time of one sweep over all edges and over all tetrahedra of a Kuhn lattice, as a rate of constraints.
//!
//! `cargo bench -p cutis-solver-cpu`; with `CUTIS_BENCH_LARGE=1` on 129×129×76 vertices instead of 65×65×38. The frame
//! time holds one sweep and the two passes over the vertices.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use cutis_coloring::Groups;
use cutis_constraints::{Distance, Volume};
use cutis_solver::{Formulation, Settings, Solver, Stiffness, System, SystemBuilder};
use cutis_solver_cpu::SolverCpu;
use cutis_test_kit::Kuhn;

fn builder(lattice: &Kuhn) -> SystemBuilder<f32> {
    let masses: Vec<f32> = lattice.positions.iter().map(|p| if p.x == 0.0 { 0.0 } else { 1.0 }).collect();
    SystemBuilder::new(&lattice.positions, &masses).expect("a valid lattice")
}

fn edges(lattice: &Kuhn) -> System<f32> {
    let groups = Groups::from_colors(&lattice.edge_colors).expect("few constraints");
    builder(lattice)
        .add_from_rest::<Distance, 2>(&lattice.edges, &Default::default(), Stiffness::pbd(1.0), &groups)
        .expect("valid edges")
        .build()
}

fn tets(lattice: &Kuhn) -> System<f32> {
    let groups = Groups::from_colors(&lattice.tet_colors).expect("few constraints");
    builder(lattice)
        .add_from_rest::<Volume, 4>(&lattice.tets, &Default::default(), Stiffness::pbd(1.0), &groups)
        .expect("valid tetrahedra")
        .build()
}

fn both(lattice: &Kuhn) -> System<f32> {
    let edges = Groups::from_colors(&lattice.edge_colors).expect("few constraints");
    let tets = Groups::from_colors(&lattice.tet_colors).expect("few constraints");
    builder(lattice)
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &Default::default(),
            Stiffness::compliance(1e-4),
            &edges,
        )
        .expect("valid edges")
        .add_from_rest::<Volume, 4>(&lattice.tets, &Default::default(), Stiffness::compliance(1e-7), &tets)
        .expect("valid tetrahedra")
        .build()
}

fn sweeps(criterion: &mut Criterion) {
    let large = std::env::var_os("CUTIS_BENCH_LARGE").is_some();
    let lattice = Kuhn::new(if large { [129, 129, 76] } else { [65, 65, 38] }, 0.1);
    type Kind = (&'static str, fn(&Kuhn) -> System<f32>, usize);
    let kinds: [Kind; 2] = [("edges", edges, lattice.edges.len()), ("tets", tets, lattice.tets.len())];
    for (name, system, count) in kinds {
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(count as u64)).sample_size(20);
        for threads in [1, 2] {
            let settings = Settings {
                formulation: Formulation::Pbd,
                dt_s: 0.005,
                substeps: 1,
                iterations: 1,
                gravity_m_s2: [0.0, -9.81, 0.0],
                damping_per_s: 0.0,
                relaxation: 1.0,
            };
            let mut solver =
                SolverCpu::new(system(&lattice), settings, Some(threads)).expect("a valid system");
            group.bench_function(BenchmarkId::new("threads", threads), |bencher| {
                bencher.iter(|| solver.step(1).expect("finite"));
            });
        }
        group.finish();
    }
}

/// One iteration of vertex block descent over a body of edges and tetrahedra; per vertex.
fn descent(criterion: &mut Criterion) {
    let large = std::env::var_os("CUTIS_BENCH_LARGE").is_some();
    let lattice = Kuhn::new(if large { [129, 129, 76] } else { [65, 65, 38] }, 0.1);
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
        let mut solver = SolverCpu::new(both(&lattice), settings, Some(threads)).expect("a valid system");
        group.bench_function(BenchmarkId::new("threads", threads), |bencher| {
            bencher.iter(|| solver.step(1).expect("finite"));
        });
    }
    group.finish();
}

criterion_group!(benches, sweeps, descent);
criterion_main!(benches);
