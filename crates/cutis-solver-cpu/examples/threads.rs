//! One body on different numbers of threads: the results have the same bits.
//!
//! A bar of tetrahedra is fixed at one end and bends under its weight.
//!
//! `cargo run -p cutis-solver-cpu --example threads`
#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::time::Instant;

use cutis_constraints::{Distance, Volume};
use cutis_solver::{Settings, Solver, SolverReference, Stiffness, System, SystemBuilder};
use cutis_solver_cpu::SolverCpu;
use nalgebra::Point3;

/// Vertices along x, y and z, 5 mm apart.
const SIZE: [u32; 3] = [41, 9, 9];

/// Builds the bar, with six tetrahedra around the diagonal of each cube.
fn bar() -> Result<System<f32>, Box<dyn std::error::Error>> {
    let index = |[i, j, k]: [u32; 3]| i + SIZE[0] * (j + SIZE[1] * k);
    let (mut positions, mut tets, mut edges) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..SIZE[2] {
        for j in 0..SIZE[1] {
            for i in 0..SIZE[0] {
                positions.push(Point3::new(i as f32, j as f32, k as f32) * 0.005);
                if i + 1 == SIZE[0] || j + 1 == SIZE[1] || k + 1 == SIZE[2] {
                    continue;
                }
                // A tetrahedron for each order in which a path along the axes crosses the cube.
                for axes in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]] {
                    let mut corner = [i, j, k];
                    let tet: [u32; 4] = std::array::from_fn(|n| {
                        if n > 0 {
                            corner[axes[n - 1]] += 1;
                        }
                        index(corner)
                    });
                    edges.extend((0..4).flat_map(|a| (a + 1..4).map(move |b| [tet[a], tet[b]])));
                    tets.push(tet);
                }
            }
        }
    }
    edges.sort_unstable();
    edges.dedup();

    let count = positions.len();
    let inverse_masses: Vec<f32> =
        (0..count as u32).map(|n| if n % SIZE[0] == 0 { 0.0 } else { 8000.0 }).collect();
    let builder = SystemBuilder::<f32>::new(&positions, &inverse_masses)?;
    let groups = cutis_coloring::greedy(&edges, count)?;
    let stiffness = Stiffness::compliance(1e-5); // in m/N
    let builder = builder.add_from_rest::<Distance, 2>(&edges, &Default::default(), stiffness, &groups)?;
    let groups = cutis_coloring::greedy(&tets, count)?;
    let stiffness = Stiffness::compliance(1e-12); // in m³/Pa
    Ok(builder.add_from_rest::<Volume, 4>(&tets, &Default::default(), stiffness, &groups)?.build())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let gravity_m_s2 = [0.0, 0.0, -9.81];
    let settings = Settings { gravity_m_s2, substeps: 20, damping_per_s: 2.0, ..Settings::default() };
    let frames = 15;
    let system = bar()?;
    let constraints: usize = system.kinds().iter().map(|kind| kind.len()).sum();
    println!("{} vertices, {constraints} constraints, {frames} frames", system.vertices().len());

    let mut reference = SolverReference::new(system.clone(), settings)?;
    let start = Instant::now();
    reference.step(frames)?;
    println!("reference:  {:6.0} ms", 1e3 * start.elapsed().as_secs_f64());
    let expected = reference.positions()?;

    for threads in [1, 2, 4] {
        let mut solver = SolverCpu::new(system.clone(), settings, Some(threads))?;
        let start = Instant::now();
        solver.step(frames)?;
        let ms = 1e3 * start.elapsed().as_secs_f64();
        let equal = solver.positions()? == expected;
        println!("{} thread(s): {ms:6.0} ms, same bits as the reference: {equal}", solver.threads());
        assert!(equal);
    }
    let end = expected[SIZE[0] as usize - 1];
    println!("the free end is {:.1} mm lower after {:.2} s", -1e3 * end.z, reference.time_s());
    Ok(())
}
