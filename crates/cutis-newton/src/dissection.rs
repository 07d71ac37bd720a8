//! An elimination order that keeps the factors of the Hessian sparse: nested dissection by
//! coordinates.
//!
//! A plane divides the vertices of the body into two halves and a thin separator. The separator is
//! eliminated last, and the halves are divided in the same way. On a lattice of `n` vertices the
//! factors then have `O(n^(4/3))` entries (George 1973; Lipton, Rose and Tarjan 1979). The
//! positions are known, so no graph partitioner is needed.

use nalgebra::Point3;

/// Parts with at most this many vertices are eliminated in the given order.
const LEAF: usize = 12;
/// Fractions of the vertices below the candidate planes.
const SHARES: [f64; 7] = [0.5, 0.46, 0.54, 0.42, 0.58, 0.38, 0.62];

/// Vertices that share a constraint: the neighbors of vertex `v` are
/// `targets[offsets[v]..offsets[v + 1]]`, ascending.
pub(crate) struct Graph {
    pub offsets: Vec<usize>,
    pub targets: Vec<u32>,
}

impl Graph {
    /// Returns the neighbors of `v`.
    pub fn neighbors(&self, v: u32) -> &[u32] {
        &self.targets[self.offsets[v as usize]..self.offsets[v as usize + 1]]
    }
}

/// Returns the vertices of `graph` in the order of elimination.
pub(crate) fn order(graph: &Graph, positions: &[Point3<f64>]) -> Vec<u32> {
    let mut vertices: Vec<u32> = (0..positions.len() as u32).collect();
    let mut dissection = Dissection { graph, positions, side: vec![Side::Outside; positions.len()] };
    dissection.divide(&mut vertices);
    vertices
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Outside,
    Below,
    Above,
}

struct Dissection<'a> {
    graph: &'a Graph,
    positions: &'a [Point3<f64>],
    side: Vec<Side>,
}

impl Dissection<'_> {
    /// Orders `vertices`: the lower half, the upper half, the separator.
    fn divide(&mut self, vertices: &mut [u32]) {
        if vertices.len() <= LEAF {
            return;
        }
        let (axis, middle) = self.best_plane(vertices);
        self.sort(vertices, axis);
        self.mark(vertices, middle);
        // The separator: vertices below the plane with a neighbor above it.
        let touches =
            |&v: &u32| self.graph.neighbors(v).iter().any(|&n| self.side[n as usize] == Side::Above);
        let (separator, below): (Vec<u32>, Vec<u32>) = vertices[..middle].iter().partition(|v| touches(v));
        for &v in &*vertices {
            self.side[v as usize] = Side::Outside;
        }
        let above = vertices[middle..].to_vec();
        let (lower, upper) = (below.len(), below.len() + above.len());
        vertices[..lower].copy_from_slice(&below);
        vertices[lower..upper].copy_from_slice(&above);
        vertices[upper..].copy_from_slice(&separator);
        self.divide(&mut vertices[..lower]);
        self.divide(&mut vertices[lower..upper]);
    }

    /// Returns the axis, and the number of vertices below the plane, of the plane with the best
    /// compromise between a small separator and equal halves.
    fn best_plane(&mut self, vertices: &mut [u32]) -> (usize, usize) {
        let mut best = (f64::INFINITY, 0, vertices.len() / 2);
        for axis in 0..3 {
            self.sort(vertices, axis);
            for share in SHARES {
                let middle = self.between_planes(vertices, axis, (vertices.len() as f64 * share) as usize);
                self.mark(vertices, middle);
                let above = |&n: &u32| self.side[n as usize] == Side::Above;
                let touches = |v: &&u32| self.graph.neighbors(**v).iter().any(above);
                let separator = vertices[..middle].iter().filter(touches).count();
                let larger = (middle - separator).max(vertices.len() - middle);
                // The work on the halves grows with about the square of their sizes.
                let cost = separator as f64 * (larger as f64 / vertices.len() as f64 + 0.5);
                if cost < best.0 {
                    best = (cost, axis, middle);
                }
            }
        }
        for &v in &*vertices {
            self.side[v as usize] = Side::Outside;
        }
        (best.1, best.2)
    }

    /// Returns `middle`, moved to the nearest position where the coordinate changes, unless the
    /// halves would become too unequal.
    fn between_planes(&self, vertices: &[u32], axis: usize, middle: usize) -> usize {
        let at = |n: usize| self.positions[vertices[n] as usize][axis];
        let value = at(middle);
        let (start, end) = (vertices.partition_point(|&v| self.positions[v as usize][axis] < value), {
            vertices.partition_point(|&v| self.positions[v as usize][axis] <= value)
        });
        let nearest = if middle - start <= end - middle { start } else { end };
        let quarter = vertices.len() / 4;
        if (quarter..=vertices.len() - quarter).contains(&nearest) { nearest } else { middle }
    }

    fn sort(&self, vertices: &mut [u32], axis: usize) {
        let key = |v: u32| self.positions[v as usize];
        vertices.sort_unstable_by(|&a, &b| key(a)[axis].total_cmp(&key(b)[axis]).then(a.cmp(&b)));
    }

    fn mark(&mut self, vertices: &[u32], middle: usize) {
        for (n, &v) in vertices.iter().enumerate() {
            self.side[v as usize] = if n < middle { Side::Below } else { Side::Above };
        }
    }
}
