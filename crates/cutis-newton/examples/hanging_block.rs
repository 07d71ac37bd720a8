//! Equilibrium of blocks that hang under their weight: sag, force on the support, and the time and
//! memory of the direct solver by size.
//!
//! `cargo run --release -p cutis-newton --example hanging_block [-- LARGEST]`. `LARGEST` is the
//! number of vertices along an edge of the largest block, 8 by default.
#![allow(clippy::print_stdout)] // an example prints its results

use std::error::Error;
use std::time::Instant;

use cutis_constraints::{Distance, DistanceMaterial};
use cutis_newton::{Options, Problem};
use cutis_solver::{Stiffness, SystemBuilder};
use nalgebra::{Point3, Vector3};

/// Distance between neighboring vertices in m.
const SPACING: f64 = 0.01;
/// Mass of a vertex in kg.
const MASS: f64 = 1e-3;
/// Compliance of a spring in m/N.
const COMPLIANCE: f64 = 1e-3;
const GRAVITY_M_S2: [f64; 3] = [0.0, 0.0, -9.81];

/// A block of `n³` vertices with a fixed top and springs to all neighbors in a cube.
fn block(n: usize) -> Result<Problem, Box<dyn Error>> {
    let cells: Vec<[usize; 3]> = (0..n.pow(3)).map(|v| [v % n, v / n % n, v / (n * n)]).collect();
    let positions: Vec<_> = cells.iter().map(|c| Point3::from(c.map(|i| i as f64 * SPACING))).collect();
    let inverse_masses: Vec<f64> =
        cells.iter().map(|c| if c[2] == n - 1 { 0.0 } else { 1.0 / MASS }).collect();
    let mut springs = Vec::new();
    for (from, cell) in cells.iter().enumerate() {
        for step in 1..8 {
            let offset = [step & 1, step >> 1 & 1, step >> 2];
            if (0..3).all(|axis| cell[axis] + offset[axis] < n) {
                let to = from + offset[0] + n * (offset[1] + n * offset[2]);
                springs.push([from as u32, to as u32]);
            }
        }
    }
    let groups = cutis_coloring::greedy(&springs, positions.len())?;
    let (material, stiffness) = (DistanceMaterial::default(), Stiffness::compliance(COMPLIANCE));
    let system = SystemBuilder::<f64>::new(&positions, &inverse_masses)?
        .add_from_rest::<Distance, 2>(&springs, &material, stiffness, &groups)?
        .build();
    Ok(Problem::of(&system, GRAVITY_M_S2)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let largest = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(8);
    println!("   n    free  sag, mm  support, N  weight, N  factors, MB  iterations  s/iteration  definite");
    for n in [3, 5, 8, 12, 16, 20, 25, 32, 40].into_iter().filter(|&n| n <= largest) {
        let problem = block(n)?;
        let free = problem.free_count();
        let megabytes = problem.factor_bytes()? as f64 / 1e6;
        let start = Instant::now();
        let rest = problem.equilibrium(problem.positions(), &Options::default())?;
        let seconds = start.elapsed().as_secs_f64() / rest.iterations as f64;
        let sag_mm = 1e3 * (problem.positions()[0] - rest.positions[0]).z;
        let forces = problem.forces(&rest.positions);
        let fixed = forces.iter().zip(problem.masses()).filter(|(_, mass)| mass.is_infinite());
        let support: Vector3<f64> = fixed.map(|(force, _)| force).sum();
        let weight = free as f64 * MASS * -GRAVITY_M_S2[2];
        println!(
            "{n:4} {free:7} {sag_mm:8.3} {:11.4} {weight:10.4} {megabytes:12.1} {:11} {seconds:12.3} {:>9}",
            -support.z, rest.iterations, rest.definite
        );
    }
    let found = block(3)?;
    let derivatives = found.check_derivatives(found.positions(), 10)?;
    println!("largest deviation of the gradient from finite differences: {:.1e}", derivatives.gradient);
    println!("largest deviation of the Hessian from finite differences:  {:.1e}", derivatives.hessian);
    Ok(())
}
