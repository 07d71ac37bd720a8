//! The solution on the last level.

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Pass, WORKGROUP};
use nalgebra::{Cholesky, DMatrix, Dyn};
use rayon::prelude::*;

use super::kernels::Kernels;
use super::uniform::DenseUniform;
use crate::multigrid;

/// A factor of a matrix, `A = L Lᵀ`. Its inverse `W = L⁻¹` gives the solution `Wᵀ W b`.
///
/// Rounded to single precision, this is symmetric and not negative, and its relative error goes
/// with the root of the condition of `A`. The inverse of `A` itself would have an error that goes
/// with the condition, and could be indefinite where nothing holds a body.
pub struct Bottom {
    /// None for a matrix without a factor: the solution is the right-hand side.
    products: Option<[BindGroup; 2]>,
    threads: usize,
}

impl Bottom {
    /// Uploads the inverse of the factor. Vectors have `lanes` numbers for the unknowns of a node.
    /// The solution for `right` goes to `x`.
    ///
    /// # Errors
    /// [`GpuError`] if the device has too little memory or is lost.
    pub fn new(
        gpu: &Gpu,
        kernels: &Kernels,
        bottom: &multigrid::Bottom,
        [unknowns, lanes]: [usize; 2],
        right: &Buffer<f32>,
        x: &Buffer<f32>,
    ) -> Result<Self, GpuError> {
        let Some(factor) = &bottom.factor else { return Ok(Self { products: None, threads: 0 }) };
        let columns = inverse(factor);
        let size = columns.len();
        let between = gpu.zeroed("rest: vector of the last level", right.len())?;
        let [size_word, unknowns, lanes] = [size, unknowns, lanes].map(|n| n as u32);
        let uniform = DenseUniform { size: size_word, unknowns, lanes, unused: 0 };
        let uniform = gpu.uniform("rest: last level", &uniform)?;
        // `W` is zero above the diagonal.
        let entry = |row: usize, column: usize| row.checked_sub(column).map_or(0.0, |n| columns[column][n]);
        let product = |entry: &dyn Fn(usize, usize) -> f64, from: &Buffer<f32>, to: &Buffer<f32>| {
            let row = |row: usize| (0..size).map(move |column| entry(row, column) as f32);
            let matrix: Vec<f32> = (0..size).flat_map(row).collect();
            let matrix = gpu.buffer("rest: factor of the last level", &matrix)?;
            let bindings = [(0, uniform.whole()), (1, matrix.whole()), (2, from.whole()), (3, to.whole())];
            gpu.bind(&kernels.times, 0, &bindings)
        };
        let products =
            [product(&entry, right, &between)?, product(&|row, column| entry(column, row), &between, x)?];
        Ok(Self { products: Some(products), threads: WORKGROUP * size })
    }

    /// Solves for `right`.
    pub fn solve(&self, pass: &mut Pass<'_>, kernels: &Kernels, right: &Buffer<f32>, x: &Buffer<f32>) {
        match &self.products {
            None => pass.copy(right, 0..right.len(), x, 0),
            Some(products) => {
                products.iter().for_each(|group| pass.dispatch(&kernels.times, &[group], self.threads));
            }
        }
    }
}

/// The columns of `L⁻¹`, each from the diagonal on.
fn inverse(factor: &Cholesky<f64, Dyn>) -> Vec<Vec<f64>> {
    let lower: &DMatrix<f64> = factor.l_dirty();
    let size = lower.nrows();
    let column = |first: usize| {
        let mut x = vec![0.0; size - first];
        x[0] = 1.0;
        for n in 0..x.len() {
            let own = lower.column(first + n);
            x[n] /= own[first + n];
            let (done, rest) = x.split_at_mut(n + 1);
            let below = &own.as_slice()[first + n + 1..];
            rest.iter_mut().zip(below).for_each(|(x, below)| *x -= below * done[n]);
        }
        x
    };
    (0..size).into_par_iter().map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `L W = 1`. Control: another matrix is not.
    #[test]
    fn the_inverse_of_a_factor_is_its_inverse() {
        let size = 40;
        let entry = |row: usize, column: usize| ((row * 31 + column * 17 + 1) as f64).sin();
        let half = DMatrix::from_fn(size, size, entry);
        let matrix = &half * half.transpose() + DMatrix::identity(size, size);
        let factor = Cholesky::new(matrix).unwrap();
        let columns = inverse(&factor);
        let inverse = DMatrix::from_fn(size, size, |row, column| {
            row.checked_sub(column).map_or(0.0, |n| columns[column][n])
        });
        let error = |inverse: &DMatrix<f64>| (factor.l() * inverse - DMatrix::identity(size, size)).norm();
        assert!(error(&inverse) < 1e-12, "{:e}", error(&inverse));
        assert!(error(&inverse.transpose()) > 0.1);
    }
}
