//! Propagation as Gibson described it: candidates wait in a queue for each direction, and each is compared with its sponsor only.
//!
//! It is here as the baseline that it is. In a convex body of one material it keeps all links within their bounds and looks at
//! each element about once. With several materials in a body, or with links missing, it leaves links beyond their bounds:
//! a candidate that moved is compared with its other neighbors only if they come after it in the order of directions.

use std::collections::VecDeque;

use crate::chain::Chain;
use crate::links::Neighbor;
use crate::units::from_steps;
use crate::{ChainError, Drag};

/// The directions in the order in which their queues are emptied: right, left, top, bottom, front, back.
const DIRECTIONS: [(usize, bool); 6] = [(0, true), (0, false), (1, true), (1, false), (2, true), (2, false)];

/// What a classic drag did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClassicMoved {
    /// Elements that moved, one that moved twice counted twice.
    pub moves: u64,
    /// Candidates that were looked at.
    pub visits: u64,
}

impl Chain {
    /// Moves one element, and others as Gibson's queues have it. What is fixed is left where it is.
    ///
    /// # Errors
    /// As [`Chain::drag`].
    pub fn drag_classic(&mut self, drag: Drag) -> Result<ClassicMoved, ChainError> {
        self.check_element(drag.element)?;
        let [Some(x), Some(y), Some(z)] = drag.to.map(from_steps) else {
            return Err(ChainError::TooFar { element: drag.element, to: drag.to });
        };
        if self.body.links.is_fixed(drag.element) {
            return Err(ChainError::NotFree { element: drag.element, why: "it is fixed" });
        }
        for (axis, to) in [x, y, z].into_iter().enumerate() {
            self.positions[axis][drag.element as usize] = to;
        }
        self.changed.fill(true);
        let mut moved = ClassicMoved { moves: 1, visits: 0 };
        let mut queues: [VecDeque<(u32, u32)>; 6] = Default::default();
        self.offer(drag.element, None, &mut queues);
        for direction in 0..6 {
            while let Some((sponsor, candidate)) = queues[direction].pop_front() {
                moved.visits += 1;
                if candidate != drag.element && self.follow(sponsor, candidate, direction) {
                    moved.moves += 1;
                    self.offer(candidate, Some(direction), &mut queues);
                }
            }
        }
        Ok(moved)
    }

    /// Puts the neighbors of what moved into the queues: all of what was dragged; of a candidate those in its own direction and along
    /// the axes that come later.
    fn offer(&self, element: u32, came: Option<usize>, queues: &mut [VecDeque<(u32, u32)>; 6]) {
        for neighbor in self.body.links.of(element) {
            let direction = DIRECTIONS
                .iter()
                .position(|&(axis, next)| axis == neighbor.axis && next == neighbor.next)
                .unwrap_or_default();
            if came.is_none_or(|came| direction == came || neighbor.axis > DIRECTIONS[came].0) {
                queues[direction].push_back((element, neighbor.element));
            }
        }
    }

    /// Moves a candidate by the least that its sponsor's link asks for; whether it moved.
    fn follow(&mut self, sponsor: u32, candidate: u32, direction: usize) -> bool {
        if self.body.links.is_fixed(candidate) {
            return false;
        }
        let (axis, next) = DIRECTIONS[direction];
        let link = Neighbor { element: candidate, axis, next };
        let mut moved = false;
        for coordinate in 0..3 {
            let bounds = self.body.bounds(sponsor, link, coordinate);
            let (lo, hi) = if next { (bounds.lo, bounds.hi) } else { (-bounds.hi, -bounds.lo) };
            let positions = &mut self.positions[coordinate];
            let from = positions[sponsor as usize];
            let x = &mut positions[candidate as usize];
            let to = (*x).clamp(from + lo, from + hi);
            moved |= std::mem::replace(x, to) != to;
        }
        moved
    }
}
