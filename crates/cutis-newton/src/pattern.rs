//! The sparsity pattern of the Hessian and of its factors. It is found once per problem, because
//! only the numbers change.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltParams, LltRegularization};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal::SupernodalLltRef,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use nalgebra::{Matrix3, Point3};

use crate::dissection::{self, Graph};
use crate::{NewtonError, Problem};

/// A pivot below this fraction of the diagonal entry of the Hessian consists of rounding errors.
const SINGULAR: f64 = 16.0 * f64::EPSILON;

/// The upper triangle of the Hessian in 3×3 blocks, with one block row and column for each free
/// vertex in the order of elimination.
pub(crate) struct Pattern {
    /// The block row of each vertex of the body; `u32::MAX` for fixed vertices.
    pub places: Vec<u32>,
    /// The block row of each free vertex.
    ranks: Vec<u32>,
    /// Start of each block column in `rows`.
    starts: Vec<usize>,
    /// The block rows of each block column, ascending, up to the diagonal.
    rows: Vec<u32>,
    /// The same for single numbers, three columns per vertex.
    column_starts: Vec<usize>,
    row_indices: Vec<usize>,
    symbolic: SymbolicCholesky<usize>,
}

/// The numbers of a Hessian and of its factors `L Lᵀ`.
pub(crate) struct Factors<'a> {
    pattern: &'a Pattern,
    /// The numbers of the Hessian, column by column.
    pub values: Vec<f64>,
    factors: Vec<f64>,
    scratch: MemBuffer,
}

impl Pattern {
    /// Returns the pattern of a problem with vertices near `x`. The positions only affect the order
    /// of elimination.
    pub fn of(problem: &Problem, x: &[Point3<f64>]) -> Result<Self, NewtonError> {
        let free = &problem.free;
        let mut numbers = vec![u32::MAX; x.len()];
        for (number, &v) in (0..).zip(free) {
            numbers[v as usize] = number;
        }
        let graph = graph(problem, &numbers);
        let positions: Vec<Point3<f64>> = free.iter().map(|&v| x[v as usize]).collect();
        let order = dissection::order(&graph, &positions);
        let mut ranks = vec![0; free.len()];
        for (rank, &number) in (0..).zip(&order) {
            ranks[number as usize] = rank;
        }
        let (mut starts, mut rows) = (vec![0], Vec::new());
        for (column, &number) in (0..).zip(&order) {
            let from = rows.len();
            let above =
                graph.neighbors(number).iter().map(|&n| ranks[n as usize]).filter(|&row| row < column);
            rows.extend(above);
            rows[from..].sort_unstable();
            rows.push(column);
            starts.push(rows.len());
        }
        let places = numbers.iter().map(|&n| ranks.get(n as usize).copied().unwrap_or(u32::MAX)).collect();
        let (column_starts, row_indices) = single(&starts, &rows);
        let n = 3 * free.len();
        let matrix = SymbolicSparseColMatRef::new_checked(n, n, &column_starts, None, &row_indices);
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic =
            factorize_symbolic_cholesky(matrix, Side::Upper, SymmetricOrdering::Identity, parameters)
                .map_err(|_| NewtonError::Memory { free: free.len(), bytes: None })?;
        Ok(Self { places, ranks, starts, rows, column_starts, row_indices, symbolic })
    }

    /// Three numbers for each free vertex, permuted into the order of elimination.
    pub fn permuted(&self, by_vertex: &[f64]) -> Vec<f64> {
        let mut by_rank = vec![0.0; by_vertex.len()];
        for (&rank, from) in self.ranks.iter().zip(by_vertex.chunks_exact(3)) {
            by_rank[3 * rank as usize..][..3].copy_from_slice(from);
        }
        by_rank
    }

    /// Returns the numbers in the order of the free vertices. Reverses
    /// [`permuted`](Self::permuted).
    pub fn restored(&self, by_rank: &[f64]) -> Vec<f64> {
        self.ranks.iter().flat_map(|&rank| &by_rank[3 * rank as usize..][..3]).copied().collect()
    }

    /// Returns the number of entries in the factors.
    pub fn factor_len(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Allocates a Hessian and its factors, all zero.
    pub fn factors(&self) -> Result<Factors<'_>, NewtonError> {
        let bytes = |numbers: usize| u64::try_from(numbers).ok()?.checked_mul(size_of::<f64>() as u64);
        let error = |numbers| NewtonError::Memory { free: self.starts.len() - 1, bytes: bytes(numbers) };
        let zeros = |len: usize| {
            let mut numbers = Vec::new();
            numbers.try_reserve_exact(len).map_err(|_| error(len))?;
            numbers.resize(len, 0.0);
            Ok(numbers)
        };
        let request = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, parameters());
        let request = request.or(self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        Ok(Factors {
            pattern: self,
            values: zeros(9 * self.rows.len())?,
            factors: zeros(self.factor_len())?,
            scratch: MemBuffer::try_new(request).map_err(|_| error(self.factor_len()))?,
        })
    }
}

/// Returns the free vertices, by number, and their neighbors.
fn graph(problem: &Problem, numbers: &[u32]) -> Graph {
    let mut pairs = Vec::new();
    for elements in &problem.elastic.kinds {
        for k in 0..elements.len() {
            let moving =
                || elements.vertices(k).iter().map(|&v| numbers[v as usize]).filter(|&n| n != u32::MAX);
            pairs.extend(moving().flat_map(|a| moving().filter(move |&b| b != a).map(move |b| (a, b))));
        }
        pairs.sort_unstable();
        pairs.dedup();
    }
    let mut offsets = vec![0; problem.free.len() + 1];
    for &(from, _) in &pairs {
        offsets[from as usize + 1] += 1;
    }
    for n in 1..offsets.len() {
        offsets[n] += offsets[n - 1];
    }
    Graph { offsets, targets: pairs.into_iter().map(|(_, to)| to).collect() }
}

/// Returns the column starts and row indices of the single numbers of the blocks.
fn single(starts: &[usize], rows: &[u32]) -> (Vec<usize>, Vec<usize>) {
    let (mut column_starts, mut row_indices) = (vec![0], Vec::with_capacity(9 * rows.len()));
    for column in starts.windows(2) {
        for _ in 0..3 {
            let rows = rows[column[0]..column[1]].iter().map(|&row| 3 * row as usize);
            row_indices.extend(rows.flat_map(|row| [row, row + 1, row + 2]));
            column_starts.push(row_indices.len());
        }
    }
    (column_starts, row_indices)
}

fn parameters() -> Spec<LltParams, f64> {
    Spec::default()
}

impl Factors<'_> {
    /// Adds a block to the Hessian. Blocks below the diagonal are ignored, because they are the
    /// transposed ones above it.
    pub fn add(&mut self, row: u32, column: u32, block: &Matrix3<f64>) {
        if row > column {
            return;
        }
        let pattern = self.pattern;
        let (start, end) = (pattern.starts[column as usize], pattern.starts[column as usize + 1]);
        let rows = &pattern.rows[start..end];
        let local = rows.partition_point(|&other| other < row);
        debug_assert_eq!(rows[local], row, "every pair of vertices in a constraint has a block");
        for (k, values) in block.column_iter().enumerate() {
            let first = 9 * start + 3 * (k * rows.len() + local);
            for (place, value) in self.values[first..first + 3].iter_mut().zip(values.iter()) {
                *place += value;
            }
        }
    }

    /// Returns the index of the diagonal entry `n` among the numbers of the Hessian.
    pub fn diagonal(&self, n: usize) -> usize {
        // The diagonal block is the last of its columns.
        self.pattern.column_starts[n + 1] - 3 + n % 3
    }

    /// Returns the Hessian times `x`: three numbers for each free vertex, in their order.
    pub fn product(&self, x: &[f64]) -> Vec<f64> {
        let pattern = self.pattern;
        let x = pattern.permuted(x);
        let mut y = vec![0.0; x.len()];
        for column in 0..x.len() {
            let entries = pattern.column_starts[column]..pattern.column_starts[column + 1];
            for (&row, value) in pattern.row_indices[entries.clone()].iter().zip(&self.values[entries]) {
                y[row] += value * x[column];
                // Diagonal blocks are stored completely. Of the others only the upper ones are.
                if row / 3 != column / 3 {
                    y[column] += value * x[row];
                }
            }
        }
        pattern.restored(&y)
    }

    /// Factorizes the Hessian. Returns false if it is not positive definite to rounding.
    pub fn factorize(&mut self) -> bool {
        let pattern = self.pattern;
        let n = pattern.column_starts.len() - 1;
        let matrix =
            SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.row_indices);
        let done = pattern.symbolic.factorize_numeric_llt(
            &mut self.factors,
            SparseColMatRef::new(matrix, &self.values),
            Side::Upper,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            parameters(),
        );
        done.is_ok() && self.pivots_exceed_rounding()
    }

    /// Returns whether every pivot is larger than the rounding error of its diagonal entry.
    fn pivots_exceed_rounding(&self) -> bool {
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.pattern.symbolic.raw() else { return true };
        let factors = SupernodalLltRef::new(symbolic, &self.factors);
        (0..symbolic.n_supernodes()).all(|s| {
            let supernode = factors.supernode(s);
            let (start, block) = (supernode.start(), supernode.val());
            (0..block.ncols()).all(|j| {
                let (pivot, whole) = (block[(j, j)], self.values[self.diagonal(start + j)]);
                pivot * pivot > SINGULAR * whole
            })
        })
    }

    /// Returns the solution of `H x = b` with the last factorized Hessian. `b` has three numbers
    /// for each free vertex, in their order.
    pub fn solve(&mut self, b: &[f64]) -> Vec<f64> {
        let mut x = self.pattern.permuted(b);
        let factors = faer::sparse::linalg::cholesky::LltRef::new(&self.pattern.symbolic, &self.factors);
        let column = MatMut::from_column_major_slice_mut(&mut x, b.len(), 1);
        factors.solve_in_place_with_conj(Conj::No, column, Par::Seq, MemStack::new(&mut self.scratch));
        self.pattern.restored(&x)
    }
}

#[cfg(test)]
mod tests {
    use cutis_coloring::greedy;
    use cutis_constraints::Distance;
    use cutis_solver::{Stiffness, SystemBuilder};
    use cutis_test_kit::Kuhn;

    use super::*;

    /// Returns a lattice of `n³` vertices with springs on its edges. The first vertex is fixed.
    fn lattice(n: usize) -> Problem {
        let Kuhn { positions, edges: springs, .. } = Kuhn::new([n; 3], 1.0);
        let inverse_masses: Vec<f64> = (0..positions.len()).map(|v| f64::from(v > 0)).collect();
        let system = SystemBuilder::<f64>::new(&positions, &inverse_masses)
            .unwrap()
            .add_from_rest::<Distance, 2>(
                &springs,
                &Default::default(),
                Stiffness::compliance(1.0),
                &greedy(&springs, positions.len()).unwrap(),
            )
            .unwrap()
            .build();
        Problem::of(&system, [0.0; 3]).unwrap()
    }

    #[test]
    fn dissection_gives_less_fill_in_than_minimum_degree() {
        for (n, share) in [(8, 1.0), (14, 0.8)] {
            let problem = lattice(n);
            let pattern = problem.pattern().unwrap();
            let size = 3 * problem.free.len();
            let matrix = SymbolicSparseColMatRef::new_checked(
                size,
                size,
                &pattern.column_starts,
                None,
                &pattern.row_indices,
            );
            let degree = factorize_symbolic_cholesky(
                matrix,
                Side::Upper,
                SymmetricOrdering::Amd,
                CholeskySymbolicParams {
                    supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                    ..Default::default()
                },
            )
            .unwrap();
            let (ours, theirs) = (pattern.factor_len() as f64, degree.len_val() as f64);
            assert!(ours < share * theirs, "{ours} against {theirs} for {n}");
        }
    }

    #[test]
    fn a_solution_inverts_the_product() {
        let problem = lattice(5);
        let pattern = problem.pattern().unwrap();
        let mut factors = pattern.factors().unwrap();
        let size = 3 * problem.free.len();
        for (column, &number) in (0..).zip(&pattern.ranks) {
            factors.add(number, number, &(Matrix3::identity() * (30.0 + f64::from(column % 7))));
        }
        for column in 0..pattern.rows.len().min(pattern.starts.len() - 1) {
            for at in pattern.starts[column]..pattern.starts[column + 1] - 1 {
                let block = Matrix3::from_fn(|i, j| 0.1 * (at % 5 + i) as f64 - 0.2 * j as f64);
                factors.add(pattern.rows[at], column as u32, &block);
            }
        }
        let x: Vec<f64> = (0..size).map(|n| (n % 11) as f64 - 5.0).collect();
        let b = factors.product(&x);
        assert!(factors.factorize());
        let solved = factors.solve(&b);
        assert!(x.iter().zip(&solved).all(|(x, y)| (x - y).abs() < 1e-12), "{solved:?}");
    }

    #[test]
    fn singular_and_indefinite_matrices_are_reported() {
        let problem = lattice(2);
        let pattern = problem.pattern().unwrap();
        for (value, definite) in [(1.0, true), (0.0, false), (-1.0, false), (1e-15, false), (f64::NAN, false)]
        {
            let mut factors = pattern.factors().unwrap();
            for rank in 0..problem.free.len() as u32 {
                factors.add(rank, rank, &Matrix3::identity());
            }
            // The last pivot becomes 1 − (1 − value).
            let block = Matrix3::from_diagonal(&nalgebra::Vector3::new((1.0_f64 - value).sqrt(), 0.0, 0.0));
            let block = if value < 0.0 { Matrix3::identity() * (1.0 - value) } else { block };
            let last = problem.free.len() as u32 - 1;
            factors.add(pattern.rows[pattern.starts[last as usize]], last, &block);
            assert_eq!(factors.factorize(), definite, "{value}");
        }
    }
}
