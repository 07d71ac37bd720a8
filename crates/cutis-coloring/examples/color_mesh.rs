//! Colors the edges and triangles of a small mesh for a parallel solver, and its vertices for a
//! solver that moves one vertex after the other.
//!
//! `cargo run -p cutis-coloring --example color_mesh`
#![allow(clippy::print_stdout)] // an example prints its results

use cutis_coloring::{ColoringError, Groups, Incidence, Tuples, greedy, greedy_vertices};

/// Vertices along each side of the mesh.
const SIDE: u32 = 30;

/// Prints the number of groups and their sizes.
fn report(name: &str, groups: &Groups) {
    let sizes: Vec<usize> = groups.iter().map(<[u32]>::len).collect();
    println!("{name}: {} groups of sizes {sizes:?}", groups.len());
}

fn main() -> Result<(), ColoringError> {
    // A square sheet of quads, each split into two triangles.
    let vertex = |i: u32, j: u32| i + SIDE * j;
    let mut triangles = Vec::new();
    for (i, j) in (0..SIDE - 1).flat_map(|j| (0..SIDE - 1).map(move |i| (i, j))) {
        let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    let sides = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [a, c]].map(|[a, b]| [a.min(b), a.max(b)]);
    let mut edges: Vec<[u32; 2]> = triangles.iter().copied().flat_map(sides).collect();
    edges.sort_unstable();
    edges.dedup();
    let vertex_count = (SIDE * SIDE) as usize;

    for (name, groups) in
        [("edges", greedy(&edges, vertex_count)?), ("triangles", greedy(&triangles, vertex_count)?)]
    {
        report(name, &groups);
    }

    // The vertices of one border are fixed and need no color.
    let moves: Vec<bool> = (0..vertex_count).map(|v| v >= SIDE as usize).collect();
    let kinds = [Tuples::of(&edges), Tuples::of(&triangles)];
    let incidences = [Incidence::new(kinds[0], vertex_count)?, Incidence::new(kinds[1], vertex_count)?];
    let groups = greedy_vertices(&kinds, &incidences, &moves)?;
    groups.verify_vertices(&kinds, &moves)?;
    report("moving vertices", &groups);
    Ok(())
}
