//! Time and memory of a Newton iteration against the size of a block of tetrahedra.
//!
//! `cargo bench -p cutis-newton [-- LARGEST]`: the largest edge of the block in vertices, 25 unless told.
#![allow(clippy::print_stdout)] // printing is what a benchmark is for

#[path = "../tests/suite/blocks.rs"]
mod blocks;

use std::time::Instant;

use cutis_newton::{Options, Problem};

fn main() {
    let largest = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(25);
    println!(
        "Block of n³ vertices, one face held, springs and volumes, under its weight; from rest to 1e-10"
    );
    println!(
        "{:>4} {:>9} {:>12} {:>12} {:>10} {:>14}",
        "n", "free", "factors, MB", "pattern, s", "iterations", "per iteration"
    );
    for n in [5, 8, 12, 16, 20, 25, 32, 40].into_iter().filter(|&n| n <= largest) {
        let problem =
            Problem::of(&blocks::hanging(n, 1.0), [0.0, 0.0, -1e-3]).expect("the block is a problem");
        let start = Instant::now();
        let bytes = problem.factor_bytes().expect("the factors can be counted");
        let pattern = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let minimum =
            problem.equilibrium(problem.positions(), &Options::default()).expect("the block comes to rest");
        let per_iteration = start.elapsed().as_secs_f64() / minimum.iterations as f64;
        let (free, megabytes) = (problem.free_count(), bytes as f64 / 1e6);
        println!(
            "{n:4} {free:9} {megabytes:12.1} {pattern:12.3} {:10} {per_iteration:12.3} s",
            minimum.iterations
        );
    }
}
