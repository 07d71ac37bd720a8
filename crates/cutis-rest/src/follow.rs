//! The first placement after fixed vertices moved, such as those that a hook holds.
//!
//! Elements between a vertex that moved far and one that did not would be torn or turned inside
//! out. So the body follows first: `H u = −∇U − K d`, where `d` moves the fixed vertices and `K d`
//! is the change of the forces that it causes, to first order. The search starts at `x + d + u`.

use nalgebra::{Point3, Vector3};

use crate::curvature::Curvature;
use crate::settle::diagonal;
use crate::{Body, Options, Rest, RestError, Search, Step};

/// Displacement for the change of the forces, over the diagonal of the body.
const SMALL: f64 = 1e-8;

impl Body {
    /// As [`Body::settle`], after the fixed vertices came to their present places. `before` has the
    /// positions of all vertices in m, in the caller's coordinates, before they moved.
    ///
    /// # Errors
    /// [`RestError::Length`], and the errors of [`Body::settle`].
    pub fn settle_after(
        &self,
        before: &[Point3<f64>],
        options: &Options,
        progress: &mut dyn FnMut(&Step),
    ) -> Result<Rest, RestError> {
        let x = self.local(before)?;
        let moves: Vec<Vector3<f64>> = self.start.iter().zip(&x).map(|(to, from)| to - from).collect();
        let mut search = Search::at(self, x, options)?;
        search.follow(&moves)?;
        self.finish(search, progress)
    }
}

impl Search<'_> {
    /// Moves the fixed vertices, and the body with them. `moves` counts at fixed vertices only.
    fn follow(&mut self, moves: &[Vector3<f64>]) -> Result<(), RestError> {
        let body = self.body;
        let fixed = || (0..moves.len()).filter(|&v| body.is_fixed(v));
        let longest = fixed().map(|v| moves[v].norm()).fold(0.0, f64::max);
        if longest == 0.0 {
            return Ok(());
        }
        let before = self.state.x.clone();
        let placed = |length: f64| {
            let mut x = before.clone();
            fixed().for_each(|v| x[v] += moves[v] * length);
            x
        };
        let small = SMALL * diagonal(&before) / longest;
        let ahead = body.at(placed(small));
        let pairs = self.state.forces.iter().zip(&ahead.forces);
        let forces: Vec<Vector3<f64>> = pairs.map(|(force, ahead)| force + (ahead - force) / small).collect();
        let mut x = placed(1.0);
        let mut solution = self.solve(&forces, Curvature::Stretched)?;
        self.shorten(&mut solution);
        for (&v, step) in body.free.iter().zip(&solution.x) {
            x[v as usize] += step;
        }
        let followed = body.at(x);
        self.begin_at(if followed.is_finite() { followed } else { body.at(placed(1.0)) });
        Ok(())
    }
}
