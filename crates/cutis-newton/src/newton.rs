//! Newton's method with a line search. Where the Hessian is not positive definite, it is modified.

use nalgebra::Point3;

use crate::hessian::assemble;
use crate::objective::{Objective, State};
use crate::pattern::{Factors, Pattern};
use crate::{NewtonError, Options};

/// Fraction of the decrease predicted by the slope that a step must reach (Armijo).
const DECREASE: f64 = 1e-4;
/// Shortest step length. The line search ends without a result below it.
const SHORTEST: f64 = 1e-9;
/// The least fraction of the negative curvature that is flipped.
const LEAST_FLIPPED: f64 = 1e-3;
/// The first shift of the Hessian, as a fraction of its diagonal.
const FIRST_SHIFT: f64 = 1e-6;
/// The largest shift. It makes every matrix with a positive diagonal definite.
const LARGEST_SHIFT: f64 = 1e6;

/// The result of a minimization.
pub(crate) struct Found {
    pub state: State,
    /// Relative gradient.
    pub gradient: f64,
    pub iterations: usize,
    pub definite: bool,
}

/// Minimizes `objective` from `start`.
pub(crate) fn minimize(
    objective: &Objective<'_>,
    start: Vec<Point3<f64>>,
    options: &Options,
) -> Result<Found, NewtonError> {
    let pattern = objective.problem.pattern()?;
    let mut search =
        Search { objective, pattern, factors: pattern.factors()?, flipped: 1.0, shift: 0.0, definite: None };
    let mut state = objective.at(start);
    if let Some(n) = state.gradient.iter().position(|g| !g.is_finite()) {
        let (vertex, what) = (objective.problem.free[n / 3] as usize, "the force at the start");
        return Err(NewtonError::NotFinite { vertex, what });
    }
    let mut scale = 0.0_f64;
    for iterations in 0.. {
        scale = scale.max(state.scale);
        let gradient = if state.norm > 0.0 { state.norm / scale } else { 0.0 };
        if state.norm <= (options.tolerance * scale).max(state.floor) {
            let definite = match search.definite {
                Some(definite) => definite,
                None => search.factorize(&state, 0.0, 0.0),
            };
            return Ok(Found { state, gradient, iterations, definite });
        }
        let next = if iterations < options.max_iterations { search.step(&state) } else { None };
        let tolerance = options.tolerance;
        state = next.ok_or(NewtonError::NotConverged { iterations, gradient, tolerance })?;
    }
    unreachable!("the iterations end by a return")
}

struct Search<'a> {
    objective: &'a Objective<'a>,
    pattern: &'a Pattern,
    factors: Factors<'a>,
    /// Fraction of the elements' negative curvature that is flipped where the Hessian is not
    /// definite.
    flipped: f64,
    /// Addition to the diagonal of the Hessian, as a fraction of it. Zero near a minimum.
    shift: f64,
    /// Whether the unmodified Hessian was positive definite at the last factorization.
    definite: Option<bool>,
}

impl Search<'_> {
    /// Returns the next state, which is lower than `state`; `None` if no step lowers it.
    fn step(&mut self, state: &State) -> Option<State> {
        let plain = self.factorize(state, 0.0, 0.0);
        self.definite = Some(plain);
        if plain && let Some((next, _)) = self.along_direction(state) {
            self.shift = 0.0;
            return Some(next);
        }
        // The Hessian is indefinite. Flip only as much of the negative curvature as makes it
        // definite. Near a saddle, where positive and negative curvature of the elements almost
        // cancel, flipping more would make the steps short.
        while self.shift <= LARGEST_SHIFT {
            if self.factorize(state, self.flipped, self.shift)
                && let Some((next, length)) = self.along_direction(state)
            {
                match length {
                    1.0 => self.modify_less(),
                    length if length < 0.1 => self.modify_more(),
                    _ => (),
                }
                return Some(next);
            }
            self.modify_more();
        }
        None
    }

    fn modify_more(&mut self) {
        if self.flipped < 1.0 {
            self.flipped = (4.0 * self.flipped).min(1.0);
        } else {
            self.shift = (10.0 * self.shift).max(FIRST_SHIFT);
        }
    }

    fn modify_less(&mut self) {
        if self.shift > 0.0 {
            self.shift = if self.shift <= FIRST_SHIFT { 0.0 } else { self.shift / 10.0 };
        } else {
            self.flipped = (0.5 * self.flipped).max(LEAST_FLIPPED);
        }
    }

    fn factorize(&mut self, state: &State, flipped: f64, shift: f64) -> bool {
        assemble(self.objective, state, &self.pattern.places, flipped, &mut self.factors);
        if shift > 0.0 {
            let diagonal: Vec<usize> = (0..state.gradient.len()).map(|n| self.factors.diagonal(n)).collect();
            let mean = diagonal.iter().map(|&n| self.factors.values[n]).sum::<f64>() / diagonal.len() as f64;
            for n in diagonal {
                self.factors.values[n] += shift * (self.factors.values[n] + mean);
            }
        }
        self.factors.factorize()
    }

    /// Returns a step along the direction that the factors give, and its length relative to the
    /// full step.
    fn along_direction(&mut self, state: &State) -> Option<(State, f64)> {
        let descent: Vec<f64> = state.gradient.iter().map(|g| -g).collect();
        let direction = self.factors.solve(&descent);
        let slope = dot(&state.gradient, &direction);
        if !(slope < 0.0 && slope.is_finite()) {
            return None;
        }
        let mut length = 1.0;
        while length >= SHORTEST {
            let next = self.objective.moved(state, &direction, length);
            let change = self.objective.difference(state, &next);
            if decreases(change, slope, length, state.noise + next.noise, dot(&next.gradient, &direction)) {
                return Some((next, length));
            }
            // The minimum of the parabola through the known values, within bounds.
            let parabola = -0.5 * slope * length * length / (change - slope * length);
            let within = (0.1 * length)..=(0.5 * length);
            length = if within.contains(&parabola) { parabola } else { 0.3 * length };
        }
        None
    }
}

/// Returns whether a step of `length` lowers the objective enough. Where the change of the energy
/// is below the rounding `noise`, the slope at the end decides, which is equivalent for a parabola
/// (Hager and Zhang, *A new conjugate gradient method with guaranteed descent*, SIAM J. Optim. 16
/// (2005), eq. 4.1).
fn decreases(change: f64, slope: f64, length: f64, noise: f64, end_slope: f64) -> bool {
    if !(change.is_finite() && end_slope.is_finite()) {
        return false;
    }
    let hidden = change.abs() <= noise && end_slope <= (2.0 * DECREASE - 1.0) * slope;
    change <= DECREASE * length * slope && change < -noise || hidden
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
