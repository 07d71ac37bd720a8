//! How far a search moves along a direction.
//!
//! A full Newton step changes volumes to second order, which a nearly incompressible body resists:
//! the energy may rise. Local relaxation or the next step mends that at small cost, while a shorter
//! step would lose most of the way. So a full step may raise the energy, and is taken back if
//! neither makes up for it (the watchdog of Chamberlain, Powell, Lemarechal and Pedersen, Math.
//! Program. Study 16, 1982).

use nalgebra::{Point3, Vector3};

use crate::Search;
use crate::energy::State;
use crate::settle::dot;

/// Share of the decrease that the slope predicts, which a step must reach (Armijo).
const DECREASE: f64 = 1e-4;
/// Rise of the energy in a full step, over the decrease that its slope predicts, up to which the
/// step may stay if the next one makes up for it.
const RISE: f64 = 10.0;
/// Shortest step relative to a full one.
const SHORTEST: f64 = 1e-4;

/// A placement along a direction.
pub(crate) struct Moved {
    pub state: State,
    /// Length relative to the full step.
    pub length: f64,
    /// Change of the energy in J.
    pub change: f64,
    /// Slope of the energy along the direction in J, at the start and here.
    pub slope: f64,
    pub end_slope: f64,
    /// Whether the energy rises.
    pub rises: bool,
}

/// A full step that raised the energy, also after local relaxation. It stays if the next step makes
/// up for it.
pub(crate) struct Pending {
    /// Positions of all vertices before the step.
    pub x: Vec<Point3<f64>>,
    pub direction: Vec<Vector3<f64>>,
    /// Slope of the energy along the direction in J, negative.
    pub slope: f64,
    /// Change of the energy in J.
    pub change: f64,
}

/// Whether a change of the energy is a large enough share of the one that a slope predicts.
pub(crate) fn is_enough(change: f64, predicted: f64) -> bool {
    change <= DECREASE * predicted
}

impl Search<'_> {
    /// Moves along a direction: by the full step if the energy falls, or if it may rise once, and
    /// otherwise by a part of it.
    pub(crate) fn advance(&mut self, direction: &[Vector3<f64>]) -> Option<Moved> {
        let slope = -dot(&self.state.forces, direction);
        if !(slope < 0.0 && slope.is_finite()) {
            return None;
        }
        let mut full = self.moved(direction, 1.0, slope);
        if let Some(pending) = &self.pending {
            return is_enough(pending.change + full.change, pending.slope).then_some(full);
        }
        if self.is_lower(&full) {
            return Some(full);
        }
        full.rises = true;
        let may_rise = self.relaxed && full.change <= -RISE * slope;
        if may_rise { Some(full) } else { self.line_search(direction, full) }
    }

    /// Takes a full step back that raised the energy, and makes a shorter one. Returns its
    /// direction.
    pub(crate) fn undo(&mut self) -> Option<(Vec<Vector3<f64>>, Moved)> {
        let Pending { x, direction, slope, change } = self.pending.take()?;
        self.state = self.body.at(x);
        self.energy_change_j -= change;
        self.relaxed = false;
        if let Some(step) = self.steps.last_mut() {
            step.length = 0.0;
        }
        let full = self.moved(&direction, 1.0, slope);
        let moved = self.line_search(&direction, full)?;
        Some((direction, moved))
    }

    /// The first placement along a direction that is low enough. `tried` is not.
    fn line_search(&mut self, direction: &[Vector3<f64>], mut tried: Moved) -> Option<Moved> {
        while tried.length >= SHORTEST {
            let Moved { length, change, slope, .. } = tried;
            // The minimum of the parabola through the known values, within bounds.
            let parabola = -0.5 * slope * length * length / (change - slope * length);
            let within = (0.1 * length)..=(0.5 * length);
            let length = if within.contains(&parabola) { parabola } else { 0.3 * length };
            self.spare = tried.state;
            tried = self.moved(direction, length, slope);
            if self.is_lower(&tried) {
                return Some(tried);
            }
        }
        None
    }

    fn moved(&mut self, direction: &[Vector3<f64>], length: f64, slope: f64) -> Moved {
        let memory = std::mem::take(&mut self.spare);
        let state = self.body.moved(&self.state, direction, length, memory);
        let change = self.body.difference(&self.state, &state);
        let end_slope = -dot(&state.forces, direction);
        Moved { state, length, change, slope, end_slope, rises: false }
    }

    /// Whether the energy of a placement is low enough.
    fn is_lower(&self, to: &Moved) -> bool {
        let Moved { length, change, slope, end_slope, .. } = *to;
        let noise = self.state.noise + to.state.noise;
        // Where the change of the energy is below its rounding, the slope decides (Hager and
        // Zhang, SIAM J. Optim. 16, 2005).
        let hidden = change.abs() <= noise && end_slope <= (2.0 * DECREASE - 1.0) * slope;
        let lower = is_enough(change, length * slope) && change < -noise;
        change.is_finite() && end_slope.is_finite() && (lower || hidden)
    }
}
