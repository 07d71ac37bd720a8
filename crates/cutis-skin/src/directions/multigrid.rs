//! A preconditioner for harmonic continuation: smoothing on coarser and coarser groups of vertices.

use rayon::prelude::*;

use super::system::System;
use super::tensor::Tensor;

/// Factor of a smoothing step. It is stable below 1, because the eigenvalues of the matrix divided
/// by its diagonal are below 2.
const DAMPING: f64 = 0.7;

/// Factor of the correction from the groups. Values that are constant in each group are stiffer
/// than smooth values, so that the plain correction is too small (D. Braess, *Computing* 55 (1995)
/// 379–393).
const CORRECTION: f64 = 1.8;

/// Number of rows below which a system is only smoothed.
const FEWEST: usize = 30;

/// Smoothing steps on the coarsest system.
const LAST_STEPS: usize = 12;

/// A system and its coarser versions.
pub(super) struct Multigrid {
    system: System,
    /// The group of each row, and the systems of the groups.
    coarser: Option<(Vec<u32>, Box<Self>)>,
}

impl Multigrid {
    pub fn new(system: System) -> Self {
        let (groups, count) = system.groups();
        // At least half as many rows must go, so that the depth is limited.
        let coarser = (system.len() > FEWEST && 2 * count < system.len()).then(|| {
            let coarse = Self::new(system.coarse(&groups, count));
            (groups, Box::new(coarse))
        });
        Self { system, coarser }
    }

    pub fn system(&self) -> &System {
        &self.system
    }

    /// An approximate solution for the right-hand side `r`. It is a symmetric positive definite
    /// linear function of `r`.
    pub fn precondition(&self, r: &[Tensor]) -> Vec<Tensor> {
        let mut x: Vec<Tensor> = vec![Tensor::ZERO; r.len()];
        let Some((groups, coarse)) = &self.coarser else {
            (0..LAST_STEPS).for_each(|_| self.smooth(&mut x, r));
            return x;
        };
        self.smooth(&mut x, r);
        let image = self.system.times(&x);
        let mut sums = vec![Tensor::ZERO; coarse.system.len()];
        for ((&group, &r), &image) in groups.iter().zip(r).zip(&image) {
            sums[group as usize] += r - image;
        }
        let correction = coarse.precondition(&sums);
        x.par_iter_mut().zip(groups).for_each(|(x, &group)| *x += correction[group as usize] * CORRECTION);
        self.smooth(&mut x, r);
        x
    }

    /// One damped Jacobi step.
    fn smooth(&self, x: &mut [Tensor], r: &[Tensor]) {
        let image = self.system.times(x);
        let rows = x.par_iter_mut().zip(r).zip(&image).zip(self.system.diagonal());
        rows.for_each(|(((x, &r), &image), diagonal)| *x += (r - image) * (DAMPING / diagonal));
    }
}

#[cfg(test)]
mod tests {
    use cutis_test_kit::Random;
    use nalgebra::Point3;

    use super::super::graph::SkinGraph;
    use super::*;

    /// The system of an `n × n` sheet with one fixed corner.
    fn sheet(n: usize) -> System {
        let index = |i: usize, j: usize| (i + n * j) as u32;
        let cells = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| (i, j)));
        let triangles: Vec<[u32; 3]> = cells
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let at = |v: usize| Point3::new((v % n) as f64, (v / n) as f64, 0.0);
        let positions: Vec<Point3<f64>> = (0..n * n).map(at).collect();
        let free: Vec<u32> = (1..(n * n) as u32).collect();
        System::of_free(&SkinGraph::new(&triangles, &positions), &free)
    }

    fn random(len: usize, seed: u64) -> Vec<Tensor> {
        let mut random = Random::new(seed);
        (0..len).map(|_| Tensor(std::array::from_fn(|_| random.between(-1.0, 1.0)))).collect()
    }

    /// Scalar product of the first components.
    fn dot(x: &[Tensor], y: &[Tensor]) -> f64 {
        x.iter().zip(y).map(|(x, y)| x.0[0] * y.0[0]).sum()
    }

    #[test]
    fn the_preconditioner_is_symmetric_and_positive() {
        let multigrid = Multigrid::new(sheet(17));
        assert!(multigrid.coarser.as_ref().is_some_and(|(_, coarse)| coarse.coarser.is_some()));
        for seed in 0..5 {
            let (x, y) = (random(288, seed), random(288, seed + 100));
            let (from_x, from_y) = (multigrid.precondition(&x), multigrid.precondition(&y));
            let (a, b) = (dot(&from_x, &y), dot(&x, &from_y));
            assert!((a - b).abs() < 1e-10 * dot(&x, &from_x), "{a} {b}");
            assert!(dot(&x, &from_x) > 0.0 && dot(&y, &from_y) > 0.0);
        }
    }

    #[test]
    fn a_few_steps_remove_most_of_a_smooth_error() {
        // The error is 1 everywhere. Smoothing alone hardly changes it.
        let multigrid = Multigrid::new(sheet(41));
        let system = multigrid.system();
        let right = system.times(&vec![Tensor([1.0; 5]); system.len()]);
        let remaining = |step: &dyn Fn(&mut Vec<Tensor>)| {
            let mut x = vec![Tensor::ZERO; system.len()];
            (0..30).for_each(|_| step(&mut x));
            x.iter().map(|x| (1.0 - x.0[0]).abs()).sum::<f64>() / x.len() as f64
        };
        let with_groups = remaining(&|x| {
            let image = system.times(x);
            let residual: Vec<Tensor> = right.iter().zip(&image).map(|(&r, &image)| r - image).collect();
            x.iter_mut().zip(multigrid.precondition(&residual)).for_each(|(x, correction)| *x += correction);
        });
        let without = remaining(&|x| multigrid.smooth(x, &right));
        assert!(with_groups < 0.7 && without > 0.99, "{with_groups} {without}");
    }
}
