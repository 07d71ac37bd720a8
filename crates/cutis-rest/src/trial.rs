//! A step of a search before it is made: its direction, and how far it may go.
//!
//! The direction comes from the equations of the step. It is tried again with a shift of the matrix
//! (Levenberg and Marquardt) where no step along it lowers the energy, and where it is longer than
//! the reach of the search, as in a body that nothing holds. A direction that is still longer is
//! shortened to the reach, which grows while such steps succeed (a trust region: Conn, Gould and
//! Toint, Trust-Region Methods, SIAM, 2000). A body that starts in a crumpled heap needs that.

use nalgebra::Vector3;

use crate::advance::Moved;
use crate::conjugate::Solution;
use crate::curvature::Curvature;
use crate::{RestError, Search};

/// Length of a step below which the next one has a larger shift.
const SHORT: f64 = 0.1;
/// The first shift, the smallest one, and the largest one.
const FIRST_SHIFT: f64 = 1e-4;
const LEAST_SHIFT: f64 = 1e-7;
const MOST_SHIFT: f64 = 1e6;
/// After so many steps the exact second derivatives are tried far from rest, too, and the largest
/// shift with which they are.
const PATIENCE: usize = 30;
const MOST_EXACT: f64 = 1.0;
/// Growth of the reach after a full step of this length, and the most by which it shrinks.
const GROWTH: f64 = 2.0;
const SHRINKAGE: f64 = 0.25;

/// A step before it is made.
pub(crate) struct Trial {
    pub solution: Solution,
    /// Whether the equations have the exact second derivatives.
    pub exact: bool,
    pub moved: Moved,
    /// Whether the solution was longer than the reach.
    pub too_long: bool,
}

impl Search<'_> {
    /// Solves for a step, and searches along it. `None` if there is none.
    ///
    /// # Errors
    /// `RestError::Gpu`.
    pub(crate) fn try_step(&mut self) -> Result<Option<Trial>, RestError> {
        let mut wasted = 0;
        let shift = self.shift;
        let mut impatient = self.steps.len() >= PATIENCE;
        loop {
            let exact = self.near || impatient;
            let fresh = self.levels.is_none();
            let curvature = if exact { Curvature::All } else { Curvature::Stretched };
            let forces = std::mem::take(&mut self.state.forces);
            let solution = self.solve(&forces, curvature);
            self.state.forces = forces;
            let mut solution = solution?;
            wasted += solution.cycles;
            let too_long = self.is_too_long(&solution);
            if too_long && self.shift < FIRST_SHIFT {
                // Where nothing resists, rounding decides how far vertices move.
                self.shift = FIRST_SHIFT;
                continue;
            }
            self.shorten(&mut solution);
            if !(exact && solution.indefinite) {
                if let Some(moved) = self.advance(&solution.x) {
                    solution.cycles = wasted;
                    if too_long && !moved.rises {
                        self.reach_m *=
                            if moved.length == 1.0 { GROWTH } else { moved.length.max(SHRINKAGE) };
                    }
                    return Ok(Some(Trial { solution, exact, moved, too_long }));
                }
                if let Some((direction, moved)) = self.undo() {
                    let solution = Solution { x: direction, cycles: wasted, indefinite: false };
                    return Ok(Some(Trial { solution, exact: false, moved, too_long: false }));
                }
            }
            if self.near {
                // Not near enough. Wait until the steps are half as long.
                self.near_m = 0.5 * self.steps.last().map_or(0.0, |step| step.moved_m);
                self.near = false;
            } else if impatient && self.shift >= MOST_EXACT {
                (impatient, self.shift) = (false, shift);
            } else if !fresh {
                // The direction may come from levels that are too old.
                self.levels = None;
            } else if self.shift < MOST_SHIFT {
                self.shift = self.raised_shift();
            } else {
                return Ok(None);
            }
        }
    }

    /// Whether a vertex moves farther than the reach.
    fn is_too_long(&self, solution: &Solution) -> bool {
        let longest = solution.longest();
        longest > self.reach_m && longest.is_finite()
    }

    /// Shortens a solution to the reach.
    pub(crate) fn shorten(&self, solution: &mut Solution) {
        if self.is_too_long(solution) {
            let share = self.reach_m / solution.longest();
            solution.x.iter_mut().for_each(|x| *x *= share);
        }
    }

    /// The shift after a step of this length. A step that the reach shortened says nothing about
    /// the matrix.
    pub(crate) fn next_shift(&self, length: f64, rises: bool, too_long: bool) -> f64 {
        match length {
            1.0 if rises => self.shift,
            1.0 if self.shift > LEAST_SHIFT => 0.1 * self.shift,
            1.0 => 0.0,
            length if length < SHORT && !too_long => self.raised_shift(),
            _ => self.shift,
        }
    }

    /// The next larger shift.
    fn raised_shift(&self) -> f64 {
        (10.0 * self.shift).max(FIRST_SHIFT)
    }
}

impl Solution {
    /// The longest move of a vertex in m.
    fn longest(&self) -> f64 {
        self.x.iter().map(Vector3::norm).fold(0.0, f64::max)
    }
}
