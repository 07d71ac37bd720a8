//! Gibson's original propagation: candidates wait in one queue per direction, and each candidate is
//! compared with its sponsor only.
//!
//! It serves as a baseline. In a convex body of one material it keeps all links within their bounds
//! and visits each element about once. With several materials, or with missing links, it leaves
//! links beyond their bounds: a candidate that moved is compared only with the neighbors that come
//! later in the order of directions.

use std::collections::VecDeque;

use crate::chain::Chain;
use crate::links::Neighbor;
use crate::units::from_steps;
use crate::{ChainError, Drag};

/// The directions in the order of their queues: right, left, top, bottom, front, back.
const DIRECTIONS: [(usize, bool); 6] = [(0, true), (0, false), (1, true), (1, false), (2, true), (2, false)];

/// The effect of a classic drag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClassicDragReport {
    /// Number of moves; an element that moved twice counts twice.
    pub moves: u64,
    /// Number of candidates that were visited.
    pub visits: u64,
}

impl Chain {
    /// Moves one element, and others in the order of Gibson's queues. Fixed elements stay.
    ///
    /// # Errors
    /// The errors of [`Chain::drag`].
    pub fn drag_classic(&mut self, drag: Drag) -> Result<ClassicDragReport, ChainError> {
        self.check_element(drag.element)?;
        let [Some(x), Some(y), Some(z)] = drag.to.map(from_steps) else {
            return Err(ChainError::TooFar { element: drag.element, to: drag.to });
        };
        if self.structure.links.is_fixed(drag.element) {
            return Err(ChainError::NotFree { element: drag.element, why: "it is fixed" });
        }
        for (axis, to) in [x, y, z].into_iter().enumerate() {
            self.positions[axis][drag.element as usize] = to;
        }
        self.changed.fill(true);
        let mut moved = ClassicDragReport { moves: 1, visits: 0 };
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

    /// Puts neighbors of a moved element into the queues. For the dragged element these are all
    /// neighbors, for a candidate those in its own direction and along later axes.
    fn offer(&self, element: u32, came: Option<usize>, queues: &mut [VecDeque<(u32, u32)>; 6]) {
        for neighbor in self.structure.links.of(element) {
            let direction = DIRECTIONS
                .iter()
                .position(|&(axis, next)| axis == neighbor.axis && next == neighbor.next)
                .unwrap_or_default();
            if came.is_none_or(|came| direction == came || neighbor.axis > DIRECTIONS[came].0) {
                queues[direction].push_back((element, neighbor.element));
            }
        }
    }

    /// Moves a candidate as little as the link to its sponsor requires. Returns true if it moved.
    fn follow(&mut self, sponsor: u32, candidate: u32, direction: usize) -> bool {
        if self.structure.links.is_fixed(candidate) {
            return false;
        }
        let (axis, next) = DIRECTIONS[direction];
        let link = Neighbor { element: candidate, axis, next };
        let mut moved = false;
        for coordinate in 0..3 {
            let bounds = self.structure.bounds(sponsor, link, coordinate);
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
