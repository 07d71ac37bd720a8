//! Newton's method for the state of rest.

use nalgebra::{Point3, Vector3};

use crate::blocks::{Blocks, dot};
use crate::conjugate::{self, Solution};
use crate::energy::State;
use crate::hessian::Curvature;
use crate::multigrid::Multigrid;
use crate::{Body, Options, Rest, RestError, Step};

/// Share of the decrease that the slope predicts, which a step must reach (Armijo).
const DECREASE: f64 = 1e-4;
/// Shortest step relative to a full one.
const SHORTEST: f64 = 1e-9;
/// Accuracy of the equations of a step, far from rest and near it.
const TOLERANCES: [f64; 2] = [0.1, 0.01];
/// Relative error of a displacement over the tolerance of its equations. With the springs of the
/// demo it is up to 2.8.
const SOLVED: f64 = 3.0;
/// Length of a step over the displacement from the start, below which the next step uses the exact
/// second derivatives.
const NEAR: f64 = 0.2;
/// The levels are built again if a step needs this many times the cycles of the step for which they
/// were built.
const STALE: f64 = 1.5;

/// A search for the state of rest of a body, step by step.
pub struct Search<'a> {
    body: &'a Body,
    options: Options,
    /// Positions of all vertices at the start, relative to the origin, in m.
    start: Vec<Point3<f64>>,
    state: State,
    /// Largest scale of the forces so far, in N.
    scale: f64,
    /// Estimate of the distance from rest, relative to the displacement from the start.
    error: f64,
    steps: Vec<Step>,
    energy_change_j: f64,
    levels: Option<Levels>,
    /// See [`Rest::complexity`].
    complexity: f64,
    /// Longest displacement of a vertex in a step: half of the diagonal of the body, in m.
    reach: f64,
    /// Whether the last steps suggest that rest is near.
    near: bool,
}

/// A preconditioner that is kept for several steps.
struct Levels {
    multigrid: Multigrid,
    /// Cycles per digit in the first step with it.
    cost: Option<f64>,
}

impl Body {
    /// Finds the state of rest, from the positions of the system. `progress` receives each step.
    ///
    /// # Errors
    /// The errors of [`Search::new`] and [`Search::step`].
    pub fn settle(&self, options: &Options, progress: &mut dyn FnMut(&Step)) -> Result<Rest, RestError> {
        self.finish(Search::new(self, options)?, progress)
    }

    /// As [`Body::settle`], from other positions in m, in the caller's coordinates. Fixed vertices
    /// stay where they are in the system.
    ///
    /// # Errors
    /// [`RestError::Length`], and the errors of [`Body::settle`].
    pub fn settle_from(
        &self,
        positions: &[Point3<f64>],
        options: &Options,
        progress: &mut dyn FnMut(&Step),
    ) -> Result<Rest, RestError> {
        let (found, expected) = (positions.len(), self.start.len());
        if found != expected {
            return Err(RestError::Length { found, expected });
        }
        let mut x = self.start.clone();
        for &v in &self.free {
            x[v as usize] = positions[v as usize] - self.origin;
        }
        self.finish(Search::at(self, x, options)?, progress)
    }

    fn finish(&self, mut search: Search<'_>, progress: &mut dyn FnMut(&Step)) -> Result<Rest, RestError> {
        while !search.is_at_rest() {
            progress(search.step()?);
        }
        Ok(search.rest())
    }
}

impl<'a> Search<'a> {
    /// Starts at the positions of the system.
    ///
    /// # Errors
    /// [`RestError::Value`] for an option out of range, [`RestError::NotFinite`].
    pub fn new(body: &'a Body, options: &Options) -> Result<Self, RestError> {
        Self::at(body, body.start.clone(), options)
    }

    fn at(body: &'a Body, x: Vec<Point3<f64>>, options: &Options) -> Result<Self, RestError> {
        for (what, value) in [("error", options.error), ("force", options.force)] {
            if !(0.0..1.0).contains(&value) {
                return Err(RestError::Value { what, value, expected: "a number from 0 to below 1" });
            }
        }
        let state = body.at(x.clone());
        if let Some(place) = state.forces.iter().position(|force| !force.iter().all(|f| f.is_finite())) {
            return Err(RestError::NotFinite { vertex: body.free[place] as usize });
        }
        let mut search = Self {
            body,
            options: *options,
            start: x,
            scale: state.scale,
            state,
            error: f64::INFINITY,
            steps: Vec::new(),
            energy_change_j: 0.0,
            levels: None,
            complexity: 1.0,
            reach: 0.5 * diagonal(&body.start),
            near: false,
        };
        if search.is_balanced() {
            search.error = 0.0;
        }
        Ok(search)
    }

    /// Whether the estimated error is small enough, or no force is left.
    pub fn is_at_rest(&self) -> bool {
        self.error <= self.options.error || self.is_balanced()
    }

    /// Whether the forces cancel as far as wanted, or to rounding.
    fn is_balanced(&self) -> bool {
        self.state.norm <= (self.options.force * self.scale).max(self.state.floor)
    }

    /// Relative force, see [`Rest::force`].
    pub fn force(&self) -> f64 {
        if self.state.norm > 0.0 { self.state.norm / self.scale } else { 0.0 }
    }

    /// Estimate of the distance from rest over the displacement from the start. Infinite before it
    /// is known.
    pub fn error(&self) -> f64 {
        match self.steps.first() {
            // Too few steps for an estimate: the share of the forces that is left.
            Some(first) if self.error.is_infinite() && self.is_balanced() => self.force() / first.force,
            _ => self.error,
        }
    }

    /// The present positions of all vertices in m, in the caller's coordinates.
    pub fn positions(&self) -> Vec<Point3<f64>> {
        self.state.x.iter().map(|x| x + self.body.origin).collect()
    }

    /// The present state.
    pub fn rest(&self) -> Rest {
        Rest {
            positions: self.positions(),
            force: self.force(),
            error: self.error(),
            steps: self.steps.clone(),
            energy_change_j: self.energy_change_j,
            complexity: self.complexity,
        }
    }

    /// Makes a step.
    ///
    /// # Errors
    /// [`RestError::NotAtRest`] if the allowed steps are made, or no step lowers the energy.
    pub fn step(&mut self) -> Result<&Step, RestError> {
        let force = self.force();
        let failed = RestError::NotAtRest { steps: self.steps.len(), force, tolerance: self.options.force };
        if self.steps.len() >= self.options.most_steps {
            return Err(failed);
        }
        let (solution, next, length, change) = self.try_step().ok_or(failed)?;
        self.energy_change_j += change;
        let moved_m = (dot(&solution.x, &solution.x) / solution.x.len() as f64).sqrt() * length;
        let step = Step { force, moved_m, cycles: solution.cycles, length };
        let way = self.way(&next);
        self.error = self.estimate(&step, way);
        self.near = length == 1.0 && moved_m < NEAR * way && next.norm < self.state.norm;
        self.scale = self.scale.max(next.scale);
        self.state = next;
        self.steps.push(step);
        Ok(&self.steps[self.steps.len() - 1])
    }

    /// Solves for a step, and searches along it.
    fn try_step(&mut self) -> Option<(Solution, State, f64, f64)> {
        if self.near {
            let matrix = self.body.matrix(&self.state, Curvature::All);
            let solution = self.solve(&matrix);
            if !solution.indefinite
                && let Some((next, length, change)) = self.line_search(&solution.x)
            {
                return Some((solution, next, length, change));
            }
            self.near = false;
        }
        let matrix = self.body.matrix(&self.state, Curvature::Stretched);
        loop {
            let fresh = self.levels.is_none();
            let solution = self.solve(&matrix);
            if let Some((next, length, change)) = self.line_search(&solution.x) {
                return Some((solution, next, length, change));
            }
            // The direction may come from levels that are too old.
            if fresh {
                return None;
            }
            self.levels = None;
        }
    }

    /// Solves the equations of a step with this matrix: near rest that of all second derivatives,
    /// far from it that of the stretched constraints. Builds the levels if there are none.
    fn solve(&mut self, matrix: &Blocks<f64, 3, 3>) -> Solution {
        let tolerance = TOLERANCES[usize::from(self.near)];
        let build = || {
            // Levels need a matrix that is never negative.
            let places = self.body.places(&self.state);
            let multigrid = if self.near {
                Multigrid::new(&self.body.matrix(&self.state, Curvature::Stretched), &places)
            } else {
                Multigrid::new(matrix, &places)
            };
            Levels { multigrid, cost: None }
        };
        let levels = self.levels.get_or_insert_with(build);
        self.complexity = levels.multigrid.complexity();
        let most = self.options.most_cycles;
        let mut solution = conjugate::solve(matrix, &levels.multigrid, &self.state.forces, tolerance, most);
        // Where nothing resists, the equations have no finite solution.
        let longest = solution.x.iter().map(Vector3::norm).fold(0.0, f64::max);
        if longest > self.reach && longest.is_finite() {
            solution.x.iter_mut().for_each(|x| *x *= self.reach / longest);
        }
        let cost = solution.cycles as f64 / -tolerance.log10();
        if cost > STALE * *levels.cost.get_or_insert(cost) {
            self.levels = None;
        }
        solution
    }

    /// Displacement from the start to a state in m, as a root of the mean square.
    fn way(&self, state: &State) -> f64 {
        let square = |&v: &u32| (state.x[v as usize] - self.start[v as usize]).norm_squared();
        let free = &self.body.free;
        (free.iter().map(square).sum::<f64>() / free.len() as f64).sqrt()
    }

    /// Estimate of the distance from rest after a step, relative to the displacement `way` from the
    /// start. The steps shrink by a ratio `q`, so that `q/(1 − q)` of the last one is left. The
    /// larger one of the last two ratios counts, and the error of the equations of a step.
    fn estimate(&self, step: &Step, way: f64) -> f64 {
        let [.., before] = self.steps[..] else { return f64::INFINITY };
        // A shortened step, or one whose equations were not solved, does not tell the distance.
        if step.length < 1.0 || step.cycles >= self.options.most_cycles {
            return f64::INFINITY;
        }
        let solved = SOLVED * TOLERANCES[usize::from(self.near)];
        let mut ratio = (step.moved_m / before.moved_m).max(solved);
        if let [.., earlier, before] = self.steps[..] {
            ratio = ratio.max(before.moved_m / earlier.moved_m);
        }
        if way > 0.0 && ratio < 1.0 { ratio / (1.0 - ratio) * step.moved_m / way } else { f64::INFINITY }
    }

    /// The first placement along a direction that is low enough, the length of the step, and the
    /// change of the energy.
    fn line_search(&self, direction: &[Vector3<f64>]) -> Option<(State, f64, f64)> {
        let state = &self.state;
        let slope = -dot(&state.forces, direction);
        if !(slope < 0.0 && slope.is_finite()) {
            return None;
        }
        let mut length = 1.0;
        while length >= SHORTEST {
            let next = self.body.moved(state, direction, length);
            let change = self.body.difference(state, &next);
            let end_slope = -dot(&next.forces, direction);
            let noise = state.noise + next.noise;
            // Where the change of the energy is below its rounding, the slope decides (Hager and
            // Zhang, SIAM J. Optim. 16, 2005).
            let hidden = change.abs() <= noise && end_slope <= (2.0 * DECREASE - 1.0) * slope;
            let lower = change <= DECREASE * length * slope && change < -noise;
            if change.is_finite() && end_slope.is_finite() && (lower || hidden) {
                return Some((next, length, change));
            }
            // The minimum of the parabola through the known values, within bounds.
            let parabola = -0.5 * slope * length * length / (change - slope * length);
            let within = (0.1 * length)..=(0.5 * length);
            length = if within.contains(&parabola) { parabola } else { 0.3 * length };
        }
        None
    }
}

/// Diagonal of the box around some places.
fn diagonal(places: &[Point3<f64>]) -> f64 {
    let first = places.first().copied().unwrap_or_default();
    let (low, high) =
        places.iter().fold((first, first), |(low, high), place| (low.inf(place), high.sup(place)));
    (high - low).norm()
}
