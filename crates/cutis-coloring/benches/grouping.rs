//! Time to color and sort the edges and tets of a Kuhn lattice, against the project's targets.
//!
//! `cargo bench -p cutis-coloring` prints the minimum of several runs, per constraint, and the ratio to the target.
#![allow(clippy::print_stdout)] // printing is what a benchmark is for

use std::time::Instant;

use cutis_coloring::{Groups, greedy};

/// Data set A of the skin-tension paper.
const VERTICES: [u32; 3] = [129, 129, 76];
const RUNS: usize = 9;
/// The seven edge directions of the Kuhn lattice: all non-zero corners of the unit cube.
const DIRECTIONS: [[u32; 3]; 7] =
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1], [1, 1, 1]];
/// The six tets of a cell: paths along the axes from its lowest to its highest corner, in every order of the axes.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

fn index([i, j, k]: [u32; 3]) -> u32 {
    (k * VERTICES[1] + j) * VERTICES[0] + i
}

fn lattice_points(size: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    let [nx, ny, nz] = size;
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

fn edges() -> Vec<[u32; 2]> {
    let mut edges = Vec::new();
    for from in lattice_points(VERTICES) {
        for direction in DIRECTIONS {
            let to: [u32; 3] = std::array::from_fn(|axis| from[axis] + direction[axis]);
            if (0..3).all(|axis| to[axis] < VERTICES[axis]) {
                edges.push([index(from), index(to)]);
            }
        }
    }
    edges
}

fn tets() -> Vec<[u32; 4]> {
    let mut tets = Vec::new();
    for cell in lattice_points(VERTICES.map(|n| n - 1)) {
        for path in PATHS {
            let mut corner = cell;
            let mut tet = [index(cell); 4];
            for (step, axis) in path.into_iter().enumerate() {
                corner[axis] += 1;
                tet[step + 1] = index(corner);
            }
            tets.push(tet);
        }
    }
    tets
}

/// Least time in milliseconds of several runs, and the last result.
fn least<R>(mut run: impl FnMut() -> R) -> (f64, R) {
    let mut timed = || {
        let start = Instant::now();
        let result = run();
        (start.elapsed().as_secs_f64() * 1e3, result)
    };
    let (mut least, mut result) = timed();
    for _ in 1..RUNS {
        let (time, next) = timed();
        least = least.min(time);
        result = next;
    }
    (least, result)
}

fn report<const N: usize>(name: &str, constraints: &[[u32; N]], color_target_ms: f64, sort_target_ms: f64) {
    let vertex_count = VERTICES.iter().map(|&n| n as usize).product();
    let count = constraints.len();
    let (total, groups) = least(|| greedy(constraints, vertex_count).expect("a lattice is valid"));
    groups.verify(constraints, vertex_count).expect("greedy colors are valid");
    let mut colors = vec![0u16; count];
    for (color, group) in groups.iter().enumerate() {
        for &i in group {
            colors[i as usize] = color as u16;
        }
    }
    let (sort, sorted) = least(|| Groups::from_colors(&colors).expect("few constraints"));
    assert_eq!(sorted, groups);
    let (verify, valid) = least(|| groups.verify(constraints, vertex_count));
    valid.expect("greedy colors are valid");

    let line = |what: &str, ms: f64, target: Option<f64>| {
        let per_constraint = ms * 1e6 / count as f64;
        let target = target.map_or(String::new(), |t| format!(", target {t:5.1} ms, ratio {:.2}", ms / t));
        println!("{name:5} {what:15} {ms:7.1} ms, {per_constraint:5.2} ns per constraint{target}");
    };
    println!("{name:5} {:?}", groups.statistics());
    line("color and sort", total, Some(color_target_ms + sort_target_ms));
    line("sort alone", sort, Some(sort_target_ms));
    line("color (diff.)", total - sort, Some(color_target_ms));
    line("verify", verify, None);
}

fn main() {
    let [nx, ny, nz] = VERTICES;
    println!("Kuhn lattice {nx}×{ny}×{nz}, one thread, least of {RUNS} runs");
    report("edges", &edges(), 31.0, 68.0);
    report("tets", &tets(), 41.0, 110.0);
}
