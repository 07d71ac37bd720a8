//! Conjugate gradients with a preconditioner.

use nalgebra::Vector3;

use crate::blocks::{Blocks, add, dot};
use crate::multigrid::Multigrid;

/// An approximate solution.
pub(crate) struct Solution {
    pub x: Vec<Vector3<f64>>,
    /// Number of cycles of the preconditioner.
    pub cycles: usize,
    /// Whether a direction was found along which the matrix is not positive.
    pub indefinite: bool,
}

/// Iterations whose steps are added up. The length of a single step says little.
const WINDOW: usize = 4;

/// Solves `matrix · x = right` until the residual, in the norm of the preconditioner, is
/// `tolerance` of that at zero, and the steps that are still to come, as the last ones suggest, are
/// `tolerance` of the length of `x`. The residual alone says little about the length where some
/// forces are much stiffer than others.
/// Ends early where the matrix is not positive definite.
pub(crate) fn solve(
    matrix: &Blocks<f64, 3, 3>,
    multigrid: &Multigrid,
    right: &[Vector3<f64>],
    tolerance: f64,
    most_cycles: usize,
) -> Solution {
    let mut x = vec![Vector3::zeros(); right.len()];
    let mut residual = right.to_vec();
    let mut z = multigrid.cycle(&residual);
    let mut direction = z.clone();
    let mut energy = dot(&residual, &z);
    let first = energy;
    let (mut cycles, mut indefinite) = (1, false);
    let mut lengths = Vec::new();
    while cycles < most_cycles
        && energy > 0.0
        && (energy > tolerance * tolerance * first || to_come(&lengths) > tolerance * dot(&x, &x).sqrt())
    {
        let product = matrix.times(&direction);
        let curvature = dot(&direction, &product);
        if curvature.is_nan() || curvature <= 0.0 {
            indefinite = true;
            break;
        }
        let length = energy / curvature;
        add(&mut x, length, &direction);
        lengths.push(length * dot(&direction, &direction).sqrt());
        add(&mut residual, -length, &product);
        z = multigrid.cycle(&residual);
        cycles += 1;
        let next = dot(&residual, &z);
        if next.is_nan() || next <= 0.0 {
            break;
        }
        let ratio = next / energy;
        energy = next;
        direction.iter_mut().zip(&z).for_each(|(direction, z)| *direction = z + *direction * ratio);
    }
    if x.iter().all(|x| *x == Vector3::zeros()) {
        x = z;
    }
    Solution { x, cycles, indefinite }
}

/// Estimate of the sum of the steps after these. The sums over windows shrink by a constant ratio.
fn to_come(lengths: &[f64]) -> f64 {
    let Some((before, last)) = lengths.len().checked_sub(WINDOW).map(|start| lengths.split_at(start)) else {
        return f64::INFINITY;
    };
    let last: f64 = last.iter().sum();
    let before: f64 = before.iter().rev().take(WINDOW).sum();
    let ratio = if before > 0.0 { (last / before).max(0.5) } else { 0.5 };
    if ratio < 1.0 { last * ratio / (1.0 - ratio) } else { f64::INFINITY }
}
