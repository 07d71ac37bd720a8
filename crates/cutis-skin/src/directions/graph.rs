//! The graph of the vertices and edges of a skin.

use nalgebra::Point3;
use rayon::prelude::*;

/// The edges of a skin, stored per vertex, with the weights of a Laplace operator.
pub(super) struct SkinGraph {
    /// Start of each vertex in `neighbors`, and its end at the next position.
    starts: Vec<usize>,
    /// Neighbors and weights, ascending by neighbor.
    neighbors: Vec<(u32, f64)>,
}

impl SkinGraph {
    /// The graph of triangles over vertices at `positions_mm`. The weight of an edge is 1/length²,
    /// relative to the shortest edge. On a rectangle of a grid these are, up to a factor, the
    /// weights of the difference quotients of the Laplace operator.
    pub fn new(triangles: &[[u32; 3]], positions_mm: &[Point3<f64>]) -> Self {
        let both = |&[a, b, c]: &[u32; 3]| [[a, b], [b, a], [b, c], [c, b], [c, a], [a, c]];
        let mut edges: Vec<[u32; 2]> = triangles.iter().flat_map(both).collect();
        edges.par_sort_unstable();
        edges.dedup();
        let length = |&[a, b]: &[u32; 2]| (positions_mm[b as usize] - positions_mm[a as usize]).norm();
        let lengths: Vec<f64> = edges.par_iter().map(length).collect();
        let shortest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let mut starts = vec![0; positions_mm.len() + 1];
        edges.iter().for_each(|edge| starts[edge[0] as usize + 1] += 1);
        for vertex in 0..positions_mm.len() {
            starts[vertex + 1] += starts[vertex];
        }
        let weighted = |(edge, length): (&[u32; 2], &f64)| (edge[1], (shortest / length).powi(2));
        Self { starts, neighbors: edges.iter().zip(&lengths).map(weighted).collect() }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The neighbors of a vertex with their weights.
    pub fn around(&self, vertex: usize) -> &[(u32, f64)] {
        &self.neighbors[self.starts[vertex]..self.starts[vertex + 1]]
    }
}
