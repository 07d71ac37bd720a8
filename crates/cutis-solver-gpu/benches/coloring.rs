//! Time and number of colors of the coloring on each GPU of the machine and of the greedy coloring
//! on the CPU, for a lattice and the triangles of its surface, as in the skin of a body. In order,
//! and with the constraints and vertices shuffled.
//!
//! `cargo bench -p cutis-solver-gpu --bench coloring`
#![allow(clippy::print_stdout)] // a benchmark prints its results

use std::time::Instant;

use cutis_coloring::{Groups, greedy};
use cutis_gpu::{Gpu, GpuOptions, Select, adapters};
use cutis_solver_gpu::color;
use cutis_test_kit::{Kuhn, Random};

/// Vertices of data set A of the skin tension paper.
const VERTICES: [usize; 3] = [129, 129, 76];
const RUNS: usize = 3;

/// Prints the shortest time of several runs, with the time of the transfers.
fn report<const N: usize>(
    what: &str,
    constraints: &[[u32; N]],
    vertex_count: usize,
    run: impl Fn() -> Groups,
) {
    let timed = |_| {
        let start = Instant::now();
        let groups = run();
        (start.elapsed().as_secs_f64() * 1e3, groups)
    };
    let runs: Vec<(f64, Groups)> = (0..RUNS).map(timed).collect();
    let ms = runs.iter().map(|(ms, _)| *ms).fold(f64::INFINITY, f64::min);
    runs[0].1.verify(constraints, vertex_count).expect("the groups are valid");
    println!("{what}: {} constraints, {ms:.1} ms, {} colors", constraints.len(), runs[0].1.len());
}

/// The constraints in another order, with other numbers for the vertices.
fn shuffled<const N: usize>(constraints: &[[u32; N]], vertex_count: usize) -> Vec<[u32; N]> {
    let mut random = Random::new(1);
    let mut shuffle = |count: usize| {
        let mut all: Vec<u32> = (0..count as u32).collect();
        (1..count).for_each(|n| all.swap(n, random.below(n + 1)));
        all
    };
    let vertices = shuffle(vertex_count);
    let renamed = |&n: &u32| constraints[n as usize].map(|v| vertices[v as usize]);
    shuffle(constraints.len()).iter().map(renamed).collect()
}

fn compare<const N: usize>(name: &str, constraints: &[[u32; N]], devices: &[Gpu]) {
    let count = VERTICES.iter().product();
    let other = shuffled(constraints, count);
    for (order, constraints) in [("in order", constraints), ("shuffled", &other)] {
        let title = |device: &str| format!("{name} {order}, {device}");
        report(&title("CPU, one thread"), constraints, count, || {
            greedy(constraints, count).expect("a lattice is valid")
        });
        for gpu in devices {
            report(&title(&gpu.adapter().name), constraints, count, || {
                color(gpu, constraints, count).expect("a lattice is valid")
            });
        }
    }
}

/// The triangles that belong to one tetrahedron only.
fn surface(tets: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let faces = |&[a, b, c, d]: &[u32; 4]| [[b, c, d], [a, c, d], [a, b, d], [a, b, c]];
    let mut all: Vec<[u32; 3]> = tets.iter().flat_map(faces).collect();
    all.iter_mut().for_each(|face| face.sort_unstable());
    all.sort_unstable();
    all.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

fn main() {
    let open = |index| Gpu::open(&GpuOptions { select: Select::Index(index), ..GpuOptions::default() });
    let devices: Vec<Gpu> = adapters().into_iter().filter_map(|adapter| open(adapter.index).ok()).collect();
    let [nx, ny, nz] = VERTICES;
    println!("Kuhn lattice {nx}×{ny}×{nz}, shortest of {RUNS} runs, with transfers");
    let lattice = Kuhn::new(VERTICES, 1.0);
    compare("edges", &lattice.edges, &devices);
    compare("tetrahedra", &lattice.tets, &devices);
    compare("surface triangles", &surface(&lattice.tets), &devices);
}
