//! Time to color and sort the edges and tetrahedra of a Kuhn lattice, compared with target times.
//!
//! `cargo bench -p cutis-coloring` prints the shortest of several runs, also per constraint, and
//! its ratio to the target.
#![allow(clippy::print_stdout)] // a benchmark prints its results

use std::time::Instant;

use cutis_coloring::{Groups, greedy};
use cutis_test_kit::Kuhn;

/// Vertices of data set A of the skin tension paper.
const VERTICES: [usize; 3] = [129, 129, 76];
const RUNS: usize = 9;

/// Shortest time of several runs in milliseconds, and the last result.
fn shortest<R>(mut run: impl FnMut() -> R) -> (f64, R) {
    let mut timed = || {
        let start = Instant::now();
        let result = run();
        (start.elapsed().as_secs_f64() * 1e3, result)
    };
    let (mut shortest, mut result) = timed();
    for _ in 1..RUNS {
        let (time, next) = timed();
        shortest = shortest.min(time);
        result = next;
    }
    (shortest, result)
}

fn report<const N: usize>(name: &str, constraints: &[[u32; N]], color_target_ms: f64, sort_target_ms: f64) {
    let vertex_count = VERTICES.iter().product();
    let count = constraints.len();
    let (total, groups) = shortest(|| greedy(constraints, vertex_count).expect("a lattice is valid"));
    groups.verify(constraints, vertex_count).expect("greedy colors are valid");
    let mut colors = vec![0u16; count];
    for (color, group) in groups.iter().enumerate() {
        for &i in group {
            colors[i as usize] = color as u16;
        }
    }
    let (sort, sorted) = shortest(|| Groups::from_colors(&colors).expect("few constraints"));
    assert_eq!(sorted, groups);
    let (verify, valid) = shortest(|| groups.verify(constraints, vertex_count));
    valid.expect("greedy colors are valid");

    let line = |what: &str, ms: f64, target: Option<f64>| {
        let per_constraint = ms * 1e6 / count as f64;
        let target = target.map_or(String::new(), |t| format!(", target {t:5.1} ms, ratio {:.2}", ms / t));
        println!("{name:5} {what:15} {ms:7.1} ms, {per_constraint:5.2} ns per constraint{target}");
    };
    println!("{name:5} {count} constraints in {} groups", groups.len());
    line("color and sort", total, Some(color_target_ms + sort_target_ms));
    line("sort only", sort, Some(sort_target_ms));
    line("color only", total - sort, Some(color_target_ms));
    line("verify", verify, None);
}

fn main() {
    let [nx, ny, nz] = VERTICES;
    println!("Kuhn lattice {nx}×{ny}×{nz}, one thread, shortest of {RUNS} runs");
    let lattice = Kuhn::new(VERTICES, 1.0);
    report("edges", &lattice.edges, 31.0, 68.0);
    report("tets", &lattice.tets, 41.0, 110.0);
}
