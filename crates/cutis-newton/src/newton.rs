//! Newton's method with a line search, and a shift of the Hessian where it is not positive definite.

use nalgebra::Point3;

use crate::hessian::assemble;
use crate::objective::{Objective, State};
use crate::pattern::{Factors, Pattern};
use crate::{NewtonError, Options};

/// Share of the decrease promised by the slope that a step must bring (Armijo).
const DECREASE: f64 = 1e-4;
/// Step lengths below this are given up.
const SHORTEST: f64 = 1e-9;
/// The least share of the negative curvature that is turned upwards.
const LEAST_TURNED: f64 = 1e-3;
/// The first shift of the Hessian, as a share of its diagonal.
const FIRST_SHIFT: f64 = 1e-6;
/// With so large a shift every matrix with a positive diagonal would be definite.
const LARGEST_SHIFT: f64 = 1e6;

/// The end of a minimization.
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
        Search { objective, pattern, factors: pattern.factors()?, turned: 1.0, shift: 0.0, definite: None };
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
    /// How much of the elements' negative curvature is turned upwards where the Hessian is not definite.
    turned: f64,
    /// What is added to the diagonal of the Hessian, as a share of it. Zero near a minimum.
    shift: f64,
    /// Whether the Hessian was positive definite as it is, when last looked at.
    definite: Option<bool>,
}

impl Search<'_> {
    /// The next state, lower than `state`; `None` if no step is.
    fn step(&mut self, state: &State) -> Option<State> {
        let plain = self.factorize(state, 0.0, 0.0);
        self.definite = Some(plain);
        if plain && let Some((next, _)) = self.along_direction(state) {
            self.shift = 0.0;
            return Some(next);
        }
        // Where the Hessian bends downwards: as little of that turned upwards as makes it definite. Beside a saddle, where elements that
        // bend upwards and downwards all but cancel, the steps would be short with more.
        while self.shift <= LARGEST_SHIFT {
            if self.factorize(state, self.turned, self.shift)
                && let Some((next, length)) = self.along_direction(state)
            {
                match length {
                    1.0 => self.loosen(),
                    length if length < 0.1 => self.tighten(),
                    _ => (),
                }
                return Some(next);
            }
            self.tighten();
        }
        None
    }

    fn tighten(&mut self) {
        if self.turned < 1.0 {
            self.turned = (4.0 * self.turned).min(1.0);
        } else {
            self.shift = (10.0 * self.shift).max(FIRST_SHIFT);
        }
    }

    fn loosen(&mut self) {
        if self.shift > 0.0 {
            self.shift = if self.shift <= FIRST_SHIFT { 0.0 } else { self.shift / 10.0 };
        } else {
            self.turned = (0.5 * self.turned).max(LEAST_TURNED);
        }
    }

    fn factorize(&mut self, state: &State, turned: f64, shift: f64) -> bool {
        assemble(self.objective, state, &self.pattern.places, turned, &mut self.factors);
        if shift > 0.0 {
            let diagonal: Vec<usize> = (0..state.gradient.len()).map(|n| self.factors.diagonal(n)).collect();
            let mean = diagonal.iter().map(|&n| self.factors.values[n]).sum::<f64>() / diagonal.len() as f64;
            for n in diagonal {
                self.factors.values[n] += shift * (self.factors.values[n] + mean);
            }
        }
        self.factors.factorize()
    }

    /// A step along the direction that the factors give, and its length as a share of the whole.
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
            // The minimum of the parabola through what is known, within bounds.
            let parabola = -0.5 * slope * length * length / (change - slope * length);
            let within = (0.1 * length)..=(0.5 * length);
            length = if within.contains(&parabola) { parabola } else { 0.3 * length };
        }
        None
    }
}

/// Whether a step of `length` brings enough: by the energy, or, where its change drowns in the rounding `noise`, by the slope at the
/// end, which for a parabola says the same (Hager and Zhang, *A new conjugate gradient method with guaranteed descent*, SIAM J.
/// Optim. 16 (2005), eq. 4.1).
fn decreases(change: f64, slope: f64, length: f64, noise: f64, slope_there: f64) -> bool {
    if !(change.is_finite() && slope_there.is_finite()) {
        return false;
    }
    let drowned = change.abs() <= noise && slope_there <= (2.0 * DECREASE - 1.0) * slope;
    change <= DECREASE * length * slope && change < -noise || drowned
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
