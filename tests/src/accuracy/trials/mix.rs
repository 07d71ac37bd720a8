//! What is done with an iterate between two sweeps: nothing, Chebyshev's weights, or Anderson's.

use nalgebra::{DMatrix, DVector, Point3};

use super::step::Iterate;

/// A way to accelerate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mixing {
    /// None.
    Plain,
    /// Chebyshev's semi-iterative weights for a spectral radius (Wang, *A Chebyshev Semi-Iterative Approach for Accelerating Projective
    /// and Position-Based Dynamics*, ACM Trans. Graph. 34 (2015), eq. 8).
    Chebyshev(f64),
    /// The combination of this many iterates and the present one whose last changes cancel best (Walker and Ni, *Anderson
    /// Acceleration for Fixed-Point Iterations*, SIAM J. Numer. Anal. 49 (2011)).
    Anderson(usize),
}

/// What it remembers.
pub struct Mixer {
    mixing: Mixing,
    /// The last iterates, with what the sweep before each had changed.
    past: Vec<(Iterate, Vec<f64>)>,
    weight: f64,
}

impl Mixer {
    /// At the first sweep.
    pub fn new(mixing: Mixing) -> Self {
        Self { mixing, past: Vec::new(), weight: 1.0 }
    }

    /// The iterate from which the next sweep starts; `before` is that from which the last one did, `swept` its result.
    pub fn next(&mut self, before: &Iterate, swept: Iterate) -> Iterate {
        match self.mixing {
            Mixing::Plain => swept,
            Mixing::Chebyshev(radius) => self.chebyshev(radius, before, swept),
            Mixing::Anderson(depth) => self.anderson(depth, before, swept),
        }
    }

    fn chebyshev(&mut self, radius: f64, before: &Iterate, swept: Iterate) -> Iterate {
        let squared = radius * radius;
        let older = self.past.pop();
        self.past.push((before.clone(), Vec::new()));
        let Some((older, _)) = older else { return swept };
        self.weight =
            if self.weight == 1.0 { 2.0 / (2.0 - squared) } else { 4.0 / (4.0 - squared * self.weight) };
        combined(&[(&swept, self.weight), (&older, 1.0 - self.weight)])
    }

    fn anderson(&mut self, depth: usize, before: &Iterate, swept: Iterate) -> Iterate {
        let change: Vec<f64> =
            swept.x.iter().zip(&before.x).flat_map(|(a, b)| <[f64; 3]>::from(a - b)).collect();
        self.past.push((swept, change));
        if self.past.len() > depth + 1 {
            self.past.remove(0);
        }
        let last = self.past.len() - 1;
        let difference = |n: usize| -> Vec<f64> {
            self.past[last].1.iter().zip(&self.past[n].1).map(|(a, b)| a - b).collect()
        };
        let differences: Vec<Vec<f64>> = (0..last).map(difference).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut gram = DMatrix::from_fn(last, last, |a, b| dot(&differences[a], &differences[b]));
        let right = DVector::from_fn(last, |a, _| dot(&differences[a], &self.past[last].1));
        let guard = 1e-12 * gram.trace();
        (0..last).for_each(|n| gram[(n, n)] += guard);
        let Some(shares) = gram.cholesky().map(|factors| factors.solve(&right)) else {
            return self.past[last].0.clone();
        };
        let mut parts: Vec<(&Iterate, f64)> = (0..last).map(|n| (&self.past[n].0, shares[n])).collect();
        parts.push((&self.past[last].0, 1.0 - shares.sum()));
        combined(&parts)
    }
}

/// The sum of iterates with weights that add up to 1.
fn combined(parts: &[(&Iterate, f64)]) -> Iterate {
    let (first, _) = parts[0];
    let sum =
        |of: &dyn Fn(&Iterate) -> f64| parts.iter().map(|(part, weight)| weight * of(part)).sum::<f64>();
    Iterate {
        x: (0..first.x.len())
            .map(|v| Point3::from([0, 1, 2].map(|axis| sum(&|part: &Iterate| part.x[v][axis]))))
            .collect(),
        multipliers: (0..first.multipliers.len())
            .map(|n| sum(&|part: &Iterate| part.multipliers[n]))
            .collect(),
    }
}
