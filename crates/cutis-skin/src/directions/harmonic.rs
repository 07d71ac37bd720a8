//! Continues tensors from a few vertices of a graph harmonically over all vertices.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::graph::SkinGraph;
use super::multigrid::Multigrid;
use super::system::System;
use super::tensor::Tensor;

/// The iteration ends when the weighted mean of the residuals, in units of the values, is this
/// small.
const TOLERANCE: f64 = 1e-9;

/// Number of vertices whose products one task adds. It is fixed, so that the sums do not depend on
/// the number of threads.
const PORTION: usize = 4096;

/// Values that equal `fixed` where it is given and are harmonic elsewhere. Vertices that no edges
/// connect with a fixed one are 0.
pub(super) fn extend(graph: &SkinGraph, fixed: &[Option<Tensor>]) -> Vec<Tensor> {
    let (mut values, reached) = nearest_values(graph, fixed);
    let is_free = |v: &u32| reached[*v as usize] && fixed[*v as usize].is_none();
    let free: Vec<u32> = (0..graph.len() as u32).filter(is_free).collect();
    let residual = |&v: &u32| {
        let here = values[v as usize];
        let around = graph.around(v as usize).iter();
        around.fold(Tensor::ZERO, |sum, &(other, weight)| sum + (values[other as usize] - here) * weight)
    };
    let residual: Vec<Tensor> = free.par_iter().map(residual).collect();
    let corrections = solve(&Multigrid::new(System::of_free(graph, &free)), residual);
    for (&v, &correction) in free.iter().zip(&corrections) {
        values[v as usize] += correction;
    }
    values
}

/// Solves a system by conjugate gradients. The five components are solved together, each with its
/// own step lengths.
fn solve(multigrid: &Multigrid, mut residual: Vec<Tensor>) -> Vec<Tensor> {
    let system = multigrid.system();
    let limit = TOLERANCE * TOLERANCE * system.diagonal().iter().sum::<f64>();
    let mut x = vec![Tensor::ZERO; system.len()];
    let mut z = multigrid.precondition(&residual);
    let mut direction = z.clone();
    let mut energy = dot(&residual, &z);
    // In exact arithmetic the iteration ends after as many steps as there are rows.
    for _ in 0..system.len() {
        if energy.0.iter().all(|e| *e <= limit) {
            break;
        }
        let image = system.times(&direction);
        let step = energy.zip(dot(&direction, &image), ratio);
        add_scaled(&mut x, &direction, step);
        add_scaled(&mut residual, &image, step * -1.0);
        z = multigrid.precondition(&residual);
        let next = dot(&residual, &z);
        let growth = next.zip(energy, ratio);
        energy = next;
        direction.par_iter_mut().zip(&z).for_each(|(d, z)| *d = *z + d.zip(growth, |d, g| d * g));
    }
    x
}

/// `a / b`, or 0 for a component that is solved.
fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}

fn add_scaled(x: &mut [Tensor], y: &[Tensor], factor: Tensor) {
    x.par_iter_mut().zip(y).for_each(|(x, y)| *x += y.zip(factor, |y, f| y * f));
}

/// Scalar products of the five components. The portions are added in order.
fn dot(x: &[Tensor], y: &[Tensor]) -> Tensor {
    let of_portion = |(x, y): (&[Tensor], &[Tensor])| {
        x.iter().zip(y).fold(Tensor::ZERO, |sum, (x, y)| sum + x.zip(*y, |x, y| x * y))
    };
    let portions: Vec<Tensor> = x.par_chunks(PORTION).zip(y.par_chunks(PORTION)).map(of_portion).collect();
    portions.into_iter().fold(Tensor::ZERO, |sum, portion| sum + portion)
}

/// The first guess: each vertex has the value of a fixed vertex that is few edges away. Also
/// returns which vertices are connected with a fixed one.
fn nearest_values(graph: &SkinGraph, fixed: &[Option<Tensor>]) -> (Vec<Tensor>, Vec<bool>) {
    let mut values: Vec<Tensor> = fixed.iter().map(|fixed| fixed.unwrap_or(Tensor::ZERO)).collect();
    let mut reached: Vec<bool> = fixed.iter().map(Option::is_some).collect();
    let mut queue: VecDeque<usize> = (0..graph.len()).filter(|&v| reached[v]).collect();
    while let Some(vertex) = queue.pop_front() {
        for &(other, _) in graph.around(vertex) {
            let other = other as usize;
            if !reached[other] {
                reached[other] = true;
                values[other] = values[vertex];
                queue.push_back(other);
            }
        }
    }
    (values, reached)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;

    /// A flat grid of `n × n` points with the given steps.
    fn sheet(n: usize, step_mm: [f64; 2]) -> (SkinGraph, Vec<Point3<f64>>) {
        let index = |i: usize, j: usize| (i + n * j) as u32;
        let mut triangles = Vec::new();
        for (i, j) in (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| (i, j))) {
            triangles.push([index(i, j), index(i + 1, j), index(i + 1, j + 1)]);
            triangles.push([index(i, j), index(i + 1, j + 1), index(i, j + 1)]);
        }
        let at = |v: usize| Point3::new((v % n) as f64 * step_mm[0], (v / n) as f64 * step_mm[1], 0.0);
        let positions: Vec<Point3<f64>> = (0..n * n).map(at).collect();
        (SkinGraph::new(&triangles, &positions), positions)
    }

    #[test]
    fn linear_values_are_harmonic_inside_for_any_steps() {
        for step_mm in [[1.0, 1.0], [0.7, 5.0], [1e-4, 1e-4]] {
            let n = 15;
            let (graph, positions) = sheet(n, step_mm);
            let linear = |v: usize| {
                let p = [positions[v].x / step_mm[0], positions[v].y / step_mm[1]];
                Tensor([p[0], -p[1], 0.3, p[0] + 2.0 * p[1], 0.0]) * (1.0 / n as f64)
            };
            let on_border = |v: usize| [v % n, v / n].iter().any(|&c| c == 0 || c == n - 1);
            let fixed: Vec<_> = (0..n * n).map(|v| on_border(v).then(|| linear(v))).collect();
            let found = extend(&graph, &fixed);
            let error = |v: usize| (found[v] - linear(v)).0.iter().fold(0.0f64, |m, e| m.max(e.abs()));
            let worst = (0..n * n).map(error).fold(0.0, f64::max);
            assert!(worst < 1e-6, "{step_mm:?}: {worst}");
            // Control: the first guess is far from it.
            let guess = nearest_values(&graph, &fixed).0;
            assert!((0..n * n).any(|v| (guess[v] - linear(v)).0[0].abs() > 0.1));
        }
    }

    #[test]
    fn vertices_without_a_connection_are_zero_and_no_value_leaves_the_range() {
        let (graph, _) = sheet(6, [1.0, 1.0]);
        let one = Tensor::of_direction(&Vector3::x());
        let mut fixed = vec![None; 36];
        assert!(extend(&graph, &fixed).iter().all(|value| *value == Tensor::ZERO));
        fixed[7] = Some(one);
        assert!(extend(&graph, &fixed).iter().all(|value| *value == one));
        fixed[28] = Some(one * -1.0);
        let found = extend(&graph, &fixed);
        assert!(found.iter().all(|value| value.0[0].abs() <= one.0[0] + 1e-9));
        assert!(found.iter().any(|value| value.0[0].abs() < 0.5 * one.0[0]));
    }
}
