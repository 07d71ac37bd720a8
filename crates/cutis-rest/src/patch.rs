//! More smoothing where a body is much stiffer than next to it.
//!
//! A cut leaves flat tetrahedra at its walls. They resist a change of their volume with forces that
//! are many times those of other tetrahedra, but turn and slide as easily. The smoother takes such
//! motions for stiff ones, and the coarse levels do not have them. So the nodes there and their
//! neighbors are smoothed alone, while the others hold still (a subspace correction: Xu, SIAM
//! Review 34, 1992). There are few of them, so that many steps cost little.

use std::sync::Arc;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::blocks::ROWS;
use crate::matrix::Matrix;
use crate::smoother::{Operator, Smoother};
use crate::symmetric::{Above, Neighbors};
use crate::vectors::Vector;

/// A node is stiff if its diagonal block is this many times as large as that of most neighbors.
const STIFF: f64 = 3.0;
/// One of so many neighbors may be softer than the one that counts.
const SOFTER: usize = 4;
/// Most nodes of a patch, as a share of all.
const MOST: f64 = 0.25;
/// The smoother runs this often, and reaches down to this share of the spectrum.
pub(crate) const ROUNDS: usize = 4;
const SPECTRUM: f32 = 0.02;

/// The stiff nodes of a level and their neighbors.
pub(crate) struct Patch {
    /// Its nodes, ascending.
    pub nodes: Vec<u32>,
    /// Its nodes and their neighbors, ascending: the nodes with another residual if these move.
    pub around: Vec<u32>,
    /// The rows and columns of its nodes.
    pub matrix: Matrix,
    pub smoother: Smoother<3, 4>,
    /// Memory: the residual of the level, the solution for it and the residual of that.
    right: Vector<4>,
    x: Vector<4>,
    residual: Vector<4>,
}

impl Patch {
    /// The patch of a matrix whose nodes are at some places, in m. None if no node is stiff.
    pub fn of(matrix: &Matrix, places: &[Point3<f64>]) -> Option<Self> {
        let nodes = nodes_with_neighbors(matrix, &stiff(matrix)?);
        let around = nodes_with_neighbors(matrix, &nodes);
        let own = part(matrix, &nodes);
        let places: Vec<_> = nodes.iter().map(|&node| places[node as usize]).collect();
        let zero = vec![[0.0; 4]; nodes.len()];
        let smoother = Smoother::new(&own, &places, SPECTRUM);
        Some(Self {
            nodes,
            around,
            matrix: own,
            smoother,
            right: zero.clone(),
            x: zero.clone(),
            residual: zero,
        })
    }

    /// Adapts to another matrix with the same neighbors.
    pub fn update(&mut self, matrix: &Matrix) {
        fill(&mut self.matrix, matrix, &self.nodes);
        self.smoother.update(&self.matrix);
    }

    /// Smooths an approximation `x` of the level at the nodes of the patch, where `residual` is its
    /// residual.
    pub fn smooth(&mut self, x: &mut [[f32; 4]], residual: &[[f32; 4]]) {
        for (to, &node) in self.right.iter_mut().zip(&self.nodes) {
            *to = residual[node as usize];
        }
        self.smoother.start(&self.matrix, &self.right, &mut self.x, &mut self.residual);
        for _ in 1..ROUNDS {
            self.smoother.smooth(&self.matrix, &self.right, &mut self.x, &mut self.residual, None);
        }
        for (step, &node) in self.x.iter().zip(&self.nodes) {
            (0..4).for_each(|n| x[node as usize][n] += step[n]);
        }
    }

    /// Computes the residual of the level at the patch and around it.
    pub fn find_residual(
        &self,
        matrix: &Matrix,
        right: &[[f32; 4]],
        x: &[[f32; 4]],
        residual: &mut [[f32; 4]],
    ) {
        let at = |&node: &u32| {
            let product = matrix.row_times(node as usize, |node| x[node]);
            std::array::from_fn(|n| right[node as usize][n] - product[n])
        };
        let found: Vec<[f32; 4]> = self.around.par_iter().with_min_len(ROWS).map(at).collect();
        for (&node, found) in self.around.iter().zip(found) {
            residual[node as usize] = found;
        }
    }
}

/// The stiff nodes of a matrix, ascending. With their neighbors they are at most a share [`MOST`]
/// of all: if there are more, only the stiffest ones count.
fn stiff(matrix: &Matrix) -> Option<Vec<u32>> {
    let neighbors = &matrix.above().neighbors;
    let nodes = || (0..matrix.nodes()).into_par_iter().with_min_len(ROWS);
    let size = |node: usize| {
        let block = matrix.diagonal(node);
        block[0][0] + block[1][1] + block[2][2]
    };
    let sizes: Vec<f64> = nodes().map(size).collect();
    // How many times as large a node is as most of its neighbors.
    let ratio = |of_neighbors: &mut Vec<f64>, node: usize| {
        of_neighbors.clear();
        of_neighbors.extend(neighbors.of(node).iter().map(|&neighbor| sizes[neighbor as usize]));
        let place = of_neighbors.len() / SOFTER;
        if place == of_neighbors.len() {
            return 0.0;
        }
        let ratio = sizes[node] / *of_neighbors.select_nth_unstable_by(place, f64::total_cmp).1;
        // Next to nodes that nothing holds there is no usual size.
        if ratio.is_finite() { ratio } else { 0.0 }
    };
    let ratios: Vec<f64> = nodes().map_init(Vec::new, ratio).collect();
    let mut least = STIFF;
    loop {
        let stiff: Vec<u32> = nodes().filter(|&n| ratios[n] > least).map(|node| node as u32).collect();
        if stiff.is_empty() {
            return None;
        }
        let most = (MOST * matrix.nodes() as f64) as usize;
        if stiff.len() <= most && nodes_with_neighbors(matrix, &stiff).len() <= most {
            return Some(stiff);
        }
        least *= 2.0;
    }
}

/// Some nodes and their neighbors, ascending.
fn nodes_with_neighbors(matrix: &Matrix, nodes: &[u32]) -> Vec<u32> {
    let neighbors = &matrix.above().neighbors;
    let mut found = nodes.to_vec();
    nodes.iter().for_each(|&node| found.extend_from_slice(neighbors.of(node as usize)));
    found.sort_unstable();
    found.dedup();
    found
}

/// The rows and columns of some nodes, ascending.
fn part(matrix: &Matrix, nodes: &[u32]) -> Matrix {
    let (mut starts, mut later) = (vec![0], Vec::new());
    for &node in nodes {
        for neighbor in matrix.above().neighbors.later(node as usize) {
            later.extend(nodes.binary_search(neighbor).ok().map(|place| place as u32));
        }
        starts.push(later.len());
    }
    let neighbors = Arc::new(Neighbors::from_later(starts, &later));
    let mut part = Matrix { above: Above::zeros(neighbors), sums: vec![[[0.0; 4]; 3]; nodes.len()] };
    fill(&mut part, matrix, nodes);
    part
}

/// Fills a part of a matrix.
fn fill(part: &mut Matrix, matrix: &Matrix, nodes: &[u32]) {
    let neighbors = part.above.neighbors.clone();
    let values = part.above.values_mut();
    let mut place = 0;
    for (row, (&node, sums)) in nodes.iter().zip(&mut part.sums).enumerate() {
        let mut own = neighbors.of(row).iter().map(|&n| nodes[n as usize]).peekable();
        // The sum of the blocks of the part.
        let mut sum = [[0.0; 3]; 3];
        matrix.for_each(node as usize, |column, block| {
            let is_diagonal = column == node as usize;
            if !is_diagonal && own.next_if(|&next| next as usize == column).is_none() {
                return;
            }
            for (to, from) in sum.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
                *to += from;
            }
            if column > node as usize {
                for (to, &from) in values[place..].iter_mut().zip(block.as_flattened()) {
                    *to = from as f32;
                }
                place += block.as_flattened().len();
            }
        });
        for (to, from) in sums.iter_mut().zip(sum) {
            (0..3).for_each(|n| to[n] = from[n] as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::Body;
    use crate::conjugate::solve;
    use crate::curvature::Curvature;
    use crate::host::{HostEquations, Vectors};
    use crate::multigrid::Multigrid;
    use crate::springs::{FLAT_M, block, flat_block};
    use crate::vectors::dot;

    fn noise(n: usize) -> f64 {
        ((n as f64 + 1.0) * 12.9898).sin() * 43758.5453 % 1.0
    }

    fn vector(count: usize, seed: usize) -> Vector<4> {
        let number = |node: usize, n: usize| if n < 3 { noise(seed + 3 * node + n) as f32 } else { 0.0 };
        (0..count).map(|node| std::array::from_fn(|n| number(node, n))).collect()
    }

    /// The matrix of the flat block, times a factor between different nodes, and its places.
    fn flat(factor: f32) -> (Matrix, Vec<Point3<f64>>) {
        let body = Body::of(&flat_block(), [0.0; 3]).unwrap();
        let mut matrix = body.empty_matrix();
        body.fill(&mut matrix, &body.start, Curvature::Stretched, 0.0);
        matrix.above.values_mut().iter_mut().for_each(|x| *x *= factor);
        (matrix, body.free.iter().map(|&v| body.start[v as usize]).collect())
    }

    #[test]
    fn the_patch_is_where_tetrahedra_are_flat() {
        let (matrix, places) = flat(1.0);
        let patch = Patch::of(&matrix, &places).unwrap();
        let place = |node: &u32| places[*node as usize];
        let is_flat = |x: Point3<f64>| (0.035..0.055).contains(&x.x) && FLAT_M.contains(&x.z);
        let stiff_nodes = stiff(&matrix).unwrap();
        // One edge at the top has few tetrahedra, and its neighbors have even fewer.
        let elsewhere = stiff_nodes.iter().filter(|n| !is_flat(place(n))).count();
        assert!(elsewhere < stiff_nodes.len() / 50, "{elsewhere} of {}", stiff_nodes.len());
        let flat = places.iter().filter(|x| is_flat(**x)).count();
        assert!(stiff_nodes.len() > flat / 2, "{} of {flat}", stiff_nodes.len());
        assert!(patch.nodes.len() <= matrix.nodes() / 4);
        let body = Body::of(&block(), [0.0; 3]).unwrap();
        let mut matrix = body.empty_matrix();
        body.fill(&mut matrix, &body.start, Curvature::Stretched, 0.0);
        assert!(stiff(&matrix).is_none(), "a block without flat tetrahedra has no patch");
    }

    /// A product with the part is one with the matrix where all other nodes hold still. After
    /// another matrix it is that of the other one.
    #[test]
    fn a_part_has_the_rows_and_columns_of_its_nodes() {
        let (matrix, places) = flat(1.0);
        let mut patch = Patch::of(&matrix, &places).unwrap();
        let x = vector(patch.nodes.len(), 7);
        let mut whole = vec![[0.0; 4]; matrix.nodes()];
        patch.nodes.iter().zip(&x).for_each(|(&node, x)| whole[node as usize] = *x);
        let (mut own, mut of_whole) = (x.clone(), whole.clone());
        let apart = |own: &Vector<4>, of_whole: &Vector<4>, patch: &Patch| {
            let pairs = patch.nodes.iter().map(|&node| of_whole[node as usize]).zip(own);
            let of_node =
                |(a, b): ([f32; 4], &[f32; 4])| (0..3).map(|n| (a[n] - b[n]).abs()).fold(0.0, f32::max);
            let largest = own.as_flattened().iter().fold(0.0, |most: f32, x| most.max(x.abs()));
            pairs.map(of_node).fold(0.0, f32::max) / largest
        };
        patch.matrix.times(&x, &mut own);
        matrix.times(&whole, &mut of_whole);
        assert!(apart(&own, &of_whole, &patch) < 1e-6, "{:e}", apart(&own, &of_whole, &patch));
        let (other, _) = flat(3.0);
        other.times(&whole, &mut of_whole);
        assert!(apart(&own, &of_whole, &patch) > 0.1, "control");
        patch.update(&other);
        patch.matrix.times(&x, &mut own);
        assert!(apart(&own, &of_whole, &patch) < 1e-6, "{:e}", apart(&own, &of_whole, &patch));
    }

    /// A cycle with a patch is a symmetric map, as conjugate gradients need it.
    #[test]
    fn a_cycle_with_a_patch_is_symmetric() {
        let (matrix, places) = flat(1.0);
        let mut multigrid = Multigrid::new(&matrix, &places);
        assert!(multigrid.patch.is_some());
        let (a, b) = (vector(matrix.nodes(), 1), vector(matrix.nodes(), 100));
        let mut of = |right: &Vector<4>| {
            let (mut to, mut product) = (right.clone(), right.clone());
            multigrid.cycle(&matrix, right, &mut to, &mut product);
            (to, product)
        };
        let ((of_a, product), (of_b, _)) = (of(&a), of(&b));
        let scale = (dot(&of_a, &of_a) * dot(&b, &b)).sqrt();
        let error = (dot(&of_a, &b) - dot(&a, &of_b)).abs() / scale;
        assert!(error < 5e-8, "{error:e}");
        assert!(dot(&of_a, &a) > 0.0 && dot(&of_b, &b) > 0.0);
        let mut expected = of_a.clone();
        matrix.times(&of_a, &mut expected);
        assert!(product == expected, "the product belongs to the result");
        // Control: with the patch after the cycle only, it is not.
        let mut patch = multigrid.patch.take().unwrap();
        let mut half = |right: &Vector<4>| {
            let (mut to, mut product) = (right.clone(), right.clone());
            multigrid.cycle(&matrix, right, &mut to, &mut product);
            patch.find_residual(&matrix, right, &to, &mut product);
            patch.smooth(&mut to, &product);
            to
        };
        let (of_a, of_b) = (half(&a), half(&b));
        let control = (dot(&of_a, &b) - dot(&a, &of_b)).abs() / scale;
        eprintln!("asymmetry: {error:e}, control: {control:e}");
        assert!(control > 5e-7, "{control:e}");
    }

    #[test]
    fn a_patch_saves_cycles() {
        let (matrix, places) = flat(1.0);
        let right: Vec<Vector3<f64>> =
            (0..matrix.nodes()).map(|n| Vector3::from_fn(|axis, _| noise(3 * n + axis))).collect();
        let cycles = [true, false].map(|with| {
            let mut multigrid = Multigrid::new(&matrix, &places);
            if !with {
                multigrid.patch = None;
            }
            let (mut vectors, multigrid) = (Vectors::default(), &mut multigrid);
            let mut equations = HostEquations { matrix: &matrix, multigrid, vectors: &mut vectors };
            solve(&mut equations, &right, 1e-4, 300).unwrap().cycles
        });
        eprintln!("cycles with and without a patch: {cycles:?}");
        assert!(3 * cycles[0] < 2 * cycles[1], "{cycles:?}");
    }
}
