//! Newton's method for the state of rest.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::advance::{Moved, Pending, is_enough};
use crate::blocks::ROWS;
use crate::conjugate::Solution;
use crate::curvature::Curvature;
use crate::energy::State;
use crate::local::Relaxed;
use crate::matrix::Matrix;
use crate::multigrid::Multigrid;
use crate::place::Place;
use crate::trial::Trial;
use crate::vectors::sum;
use crate::{Body, Options, Rest, RestError, Step};

/// Accuracy of the equations of the first step, of which a rough solution would leave the largest
/// part of the way.
const FIRST_TOLERANCE: f64 = 0.07;
/// Accuracy of the equations of a later step without the exact second derivatives, and with them.
const TOLERANCES: [f64; 2] = [0.2, 0.14];
/// Relative error of a displacement over the tolerance of its equations.
const SOLVED: f64 = 2.2;
/// Length of a step over the displacement from the start, below which the next step uses the exact
/// second derivatives.
const NEAR: f64 = 0.003;
/// The levels are built again if a step needs this many times the cycles of the step for which they
/// were built.
const STALE: f64 = 3.0;
/// A search for the state of rest of a body, step by step.
pub struct Search<'a> {
    pub(crate) body: &'a Body,
    options: Options,
    /// Positions of the free vertices at the start, relative to the origin, in m.
    start: Vec<Point3<f64>>,
    pub(crate) state: State,
    /// An earlier state, whose memory is used again.
    pub(crate) spare: State,
    /// Estimate of the distance from rest, relative to the displacement from the start.
    error: f64,
    pub(crate) steps: Vec<Step>,
    pub(crate) energy_change_j: f64,
    pub(crate) levels: Option<Levels>,
    /// The matrix of the present step.
    matrix: Matrix,
    /// Where the equations are solved.
    place: Place,
    /// See [`Rest::complexity`].
    complexity: f64,
    /// Length of a step in m below which the exact second derivatives are tried, and whether the
    /// last step was below.
    pub(crate) near_m: f64,
    pub(crate) near: bool,
    /// Shift of the matrix, see [`Body::fill`].
    pub(crate) shift: f64,
    /// The longest move of a vertex in a step, in m.
    pub(crate) reach_m: f64,
    /// The state before a full step that raised the energy.
    pub(crate) pending: Option<Pending>,
    /// Whether full steps may raise the energy.
    pub(crate) relaxed: bool,
}

/// A preconditioner that is kept for several steps.
pub(crate) struct Levels {
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
        let from = self.local(positions)?;
        let mut x = self.start.clone();
        for &v in &self.free {
            x[v as usize] = from[v as usize];
        }
        self.finish(Search::at(self, x, options)?, progress)
    }

    /// Positions of all vertices relative to the origin.
    pub(crate) fn local(&self, positions: &[Point3<f64>]) -> Result<Vec<Point3<f64>>, RestError> {
        let (found, expected) = (positions.len(), self.start.len());
        if found != expected {
            return Err(RestError::Length { found, expected });
        }
        Ok(positions.iter().map(|position| position - self.origin).collect())
    }

    pub(crate) fn finish(
        &self,
        mut search: Search<'_>,
        progress: &mut dyn FnMut(&Step),
    ) -> Result<Rest, RestError> {
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
    /// [`RestError::Value`] for an option out of range, [`RestError::NotFinite`], `RestError::Gpu`.
    pub fn new(body: &'a Body, options: &Options) -> Result<Self, RestError> {
        Self::at(body, body.start.clone(), options)
    }

    pub(crate) fn at(body: &'a Body, x: Vec<Point3<f64>>, options: &Options) -> Result<Self, RestError> {
        for (what, value) in [("error", options.error), ("force", options.force)] {
            if !(0.0..=1.0).contains(&value) {
                return Err(RestError::Value { what, value, expected: "a number from 0 to 1" });
            }
        }
        let state = body.at(x);
        if let Some(place) = state.forces.iter().position(|force| !force.iter().all(|f| f.is_finite())) {
            return Err(RestError::NotFinite { vertex: body.free[place] as usize });
        }
        let mut search = Self {
            body,
            options: *options,
            start: body.places(&state),
            state,
            spare: State::default(),
            error: f64::INFINITY,
            steps: Vec::new(),
            energy_change_j: 0.0,
            levels: None,
            matrix: body.empty_matrix(),
            place: body.place()?,
            complexity: 1.0,
            near_m: f64::INFINITY,
            near: false,
            shift: 0.0,
            reach_m: body.reach_m,
            pending: None,
            relaxed: true,
        };
        if search.is_balanced() {
            search.error = 0.0;
        }
        Ok(search)
    }

    /// Goes on from a placement whose fixed vertices are elsewhere.
    pub(crate) fn begin_at(&mut self, state: State) {
        self.state = state;
        self.error = if self.is_balanced() { 0.0 } else { f64::INFINITY };
    }

    /// Whether the estimated error is small enough, or the forces are rounding. Without an estimate
    /// balanced forces are enough.
    pub fn is_at_rest(&self) -> bool {
        let is_rounding = self.state.norm <= self.state.floor;
        let is_balanced = self.error.is_infinite() && self.is_balanced();
        self.pending.is_none() && (self.error <= self.options.error || is_rounding || is_balanced)
    }

    /// Whether the forces cancel as far as wanted, or to rounding.
    fn is_balanced(&self) -> bool {
        self.state.norm <= (self.options.force * self.state.scale).max(self.state.floor)
    }

    /// Relative force, see [`Rest::force`].
    pub fn force(&self) -> f64 {
        if self.state.norm > 0.0 { self.state.norm / self.state.scale } else { 0.0 }
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
        self.state.x.par_iter().with_min_len(ROWS).map(|x| x + self.body.origin).collect()
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
    /// `RestError::Gpu` if the equations are solved on a GPU and do not fit it, or if it is lost.
    pub fn step(&mut self) -> Result<&Step, RestError> {
        let force = self.force();
        let failed = RestError::NotAtRest { steps: self.steps.len(), force, tolerance: self.options.force };
        if self.steps.len() >= self.options.most_steps {
            return Err(failed);
        }
        let Trial { solution, exact, moved, too_long } = self.try_step()?.ok_or(failed)?;
        let Moved { state, length, change, slope, rises, .. } = moved;
        let moved_m = (dot(&solution.x, &solution.x) / solution.x.len() as f64).sqrt() * length;
        let way = self.way(&state);
        let mut step =
            Step { force: self.force(), moved_m, cycles: solution.cycles, length, error: f64::INFINITY };
        // A shift shortens steps, so that they do not tell the distance.
        if !rises && self.shift == 0.0 {
            step.error = self.estimate(&step, exact, way);
        }
        self.error = step.error;
        let shorter = length == 1.0 && moved_m < self.near_m.min(NEAR * way);
        self.near = !rises && shorter && state.norm < self.state.norm;
        self.shift = self.next_shift(length, rises, too_long);
        self.energy_change_j += change;
        let before = std::mem::replace(&mut self.state, state);
        let start = rises.then(|| before.x.clone());
        self.spare = before;
        self.pending = None;
        // After the last step it would only cost time.
        let relaxed = if length == 1.0 && !self.is_at_rest() { self.relax(&solution.x) } else { 0.0 };
        if let Some(x) = start
            && !is_enough(change + relaxed, slope)
        {
            self.pending = Some(Pending { x, direction: solution.x, slope, change: change + relaxed });
        }
        self.steps.push(step);
        Ok(&self.steps[self.steps.len() - 1])
    }

    /// Brings the vertices to rest that moved much farther than the others in a step. Returns the
    /// change of the energy in J.
    fn relax(&mut self, step: &[Vector3<f64>]) -> f64 {
        let Some(Relaxed { places, x: moved }) = self.body.relaxed(&self.state.x, step) else { return 0.0 };
        let mut x = std::mem::take(&mut self.spare.x);
        x.clone_from(&self.state.x);
        for (&place, moved) in places.iter().zip(moved) {
            x[self.body.free[place as usize] as usize] = moved;
        }
        let relaxed = self.body.with_moved(&self.state, x, &places);
        let change = self.body.difference(&self.state, &relaxed);
        let change = if relaxed.is_finite() { change.min(0.0) } else { 0.0 };
        if change < 0.0 {
            self.energy_change_j += change;
            self.spare.x = std::mem::replace(&mut self.state, relaxed).x;
        } else {
            self.spare.x = relaxed.x;
        }
        change
    }

    /// Solves the equations of a step under these forces, with the second derivatives of some
    /// constraints. Builds the levels if there are none.
    pub(crate) fn solve(
        &mut self,
        forces: &[Vector3<f64>],
        curvature: Curvature,
    ) -> Result<Solution, RestError> {
        let tolerance = match curvature {
            Curvature::Stretched if self.steps.is_empty() => FIRST_TOLERANCE,
            _ => TOLERANCES[usize::from(curvature == Curvature::All)],
        };
        let (body, x) = (self.body, &self.state.x);
        let matrix = &mut self.matrix;
        let levels = match &mut self.levels {
            Some(levels) => {
                body.fill(matrix, x, curvature, self.shift);
                levels.multigrid.update(matrix);
                levels
            }
            none => {
                self.place.drop_levels();
                // Levels need a matrix that is never negative.
                body.fill(matrix, x, Curvature::Stretched, self.shift);
                let mut multigrid = Multigrid::new(matrix, &body.places(&self.state));
                if curvature == Curvature::All {
                    body.fill(matrix, x, curvature, self.shift);
                    multigrid.update(matrix);
                }
                none.insert(Levels { multigrid, cost: None })
            }
        };
        self.complexity = levels.multigrid.complexity(matrix);
        let most = self.options.most_cycles;
        let multigrid = &mut levels.multigrid;
        let solution = self.place.solve(matrix, multigrid, forces, tolerance, most)?;
        let cost = solution.cycles as f64 / -tolerance.log10();
        if cost > STALE * *levels.cost.get_or_insert(cost) {
            self.levels = None;
        }
        Ok(solution)
    }

    /// Displacement from the start to a state in m, as a root of the mean square.
    fn way(&self, state: &State) -> f64 {
        let free = &self.body.free;
        let square = |n: usize| (state.x[free[n] as usize] - self.start[n]).norm_squared();
        (sum(free.len(), square) / free.len() as f64).sqrt()
    }

    /// Estimate of the distance from rest after a step, relative to the displacement `way` from the
    /// start. The steps shrink by a ratio `q`, so that `q/(1 − q)` of the last one is left. The
    /// largest counts of the last two ratios, the next one if they grow, and the error of the
    /// equations of a step.
    fn estimate(&self, step: &Step, exact: bool, way: f64) -> f64 {
        let [.., before] = self.steps[..] else { return f64::INFINITY };
        // A shortened step, or one whose equations were not solved, does not tell the distance.
        if step.length < 1.0 || step.cycles >= self.options.most_cycles {
            return f64::INFINITY;
        }
        let solved = SOLVED * TOLERANCES[usize::from(exact)];
        let mut ratio = (step.moved_m / before.moved_m).max(solved);
        if let [.., earlier, before] = self.steps[..] {
            let (last, earlier) = (step.moved_m / before.moved_m, before.moved_m / earlier.moved_m);
            // Ratios that grow will grow on, but steps that shrink still shrink.
            ratio = ratio.max(earlier).max((2.0 * last - earlier).min(0.5 + 0.5 * last));
        }
        if way > 0.0 && ratio < 1.0 { ratio / (1.0 - ratio) * step.moved_m / way } else { f64::INFINITY }
    }
}

/// Diagonal of the box around some places.
pub(crate) fn diagonal(places: &[Point3<f64>]) -> f64 {
    let first = places.first().copied().unwrap_or_default();
    let (low, high) =
        places.iter().fold((first, first), |(low, high), place| (low.inf(place), high.sup(place)));
    (high - low).norm()
}

/// The inner product of two vectors.
pub(crate) fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    sum(a.len(), |n| a[n].dot(&b[n]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::springs::block;

    /// An edge is pulled in two directions, so that nearly incompressible tissue turns there. The
    /// full step raises the energy, and the vertices that moved far mend that by themselves.
    #[test]
    fn a_step_that_raises_the_energy_is_mended_where_vertices_moved_far() {
        let mut body = Body::of(&block(), [0.0; 3]).unwrap();
        for (weight, &v) in body.weights.iter_mut().zip(&body.free) {
            for (z, force_n) in [(0.28, 10.0), (0.3, -20.0), (0.32, 10.0)] {
                let place = Point3::new(0.0, 0.0, z) - body.origin;
                if (body.start[v as usize] - place).norm() < 0.005 {
                    weight.x = force_n;
                }
            }
        }
        let mut search = Search::new(&body, &Options::default()).unwrap();
        let forces = search.state.forces.clone();
        let step = search.solve(&forces, Curvature::Stretched).unwrap().x;
        let full = body.moved(&search.state, &step, 1.0, State::default());
        let change = body.difference(&search.state, &full);
        assert!(change > 0.0, "{change:e} J");
        let far = body.relaxed(&full.x, &step).unwrap().places;
        assert!(far.len() < body.free.len() / 5, "{} of {}", far.len(), body.free.len());
        let mut search = Search::new(&body, &Options::default()).unwrap();
        assert_eq!(search.step().unwrap().length, 1.0);
        assert!(search.pending.is_none() && search.energy_change_j < 0.0, "{:e} J", search.energy_change_j);
        let from_start = body.difference(&body.at(body.start.clone()), &search.state);
        assert!((search.energy_change_j / from_start - 1.0).abs() < 1e-9, "{from_start:e} J");
    }
}
