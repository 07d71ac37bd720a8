//! Propagation as a wave: whoever moved makes its neighbors keep within their bounds, until all do. The theory is in the
//! documentation of the crate.

use rayon::prelude::*;

use crate::ChainError;
use crate::chain::Chain;
use crate::limits::Bounds;
use crate::links::Neighbor;
use crate::pass::{Pass, Passed};
use crate::units::{from_steps, to_steps};

/// Where an element is told to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// The element.
    pub element: u32,
    /// Its new position, in steps of the grid; rounded to the nearest unit.
    pub to: [f64; 3],
}

/// In which order elements are looked at; the outcome is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// First in, first out; the three coordinates side by side.
    #[default]
    Fifo,
    /// The same within each of many slabs of the grid, side by side on the threads of rayon; what one asks of the next is handed over when
    /// none has anything left to do.
    Slabs,
}

/// Slabs that a grid is divided into at the most.
const SLABS: usize = 16;

/// What a drag did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moved {
    /// Elements that moved; after a drag with contradictions some may have come back.
    pub elements: usize,
    /// Times that an element was looked at, in all three coordinates.
    pub visits: u64,
    /// Where a bound would have moved what must not move. Their links are violated, and no others.
    pub contradictions: Vec<Contradiction>,
}

/// A link that cannot hold: one end was told where to be or is fixed, and the other end had to move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contradiction {
    /// The end that must not move.
    pub held: u32,
    /// Whether it is fixed; else it is grabbed.
    pub fixed: bool,
    /// The other end.
    pub other: u32,
    /// The coordinate.
    pub axis: usize,
    /// By how much the bound is missed, in steps.
    pub excess: f64,
}

impl Chain {
    /// Moves elements exactly where they are told, and others as little as their links allow. What was grabbed by a drag before this one
    /// is free again.
    ///
    /// # Errors
    /// [`ChainError::NoSuchElement`], [`ChainError::TooFar`], [`ChainError::NotFree`]; then nothing moves.
    pub fn drag(&mut self, drags: &[Drag], order: Order) -> Result<Moved, ChainError> {
        let targets = self.targets(drags)?;
        targets.iter().for_each(|&(element, _)| self.body.links.set_grabbed(element, true));
        let strained = std::mem::take(&mut self.strained);
        let slabs = match order {
            Order::Fifo => 1,
            Order::Slabs => SLABS,
        };
        let Self { body, positions, flags, .. } = self;
        let coordinates = positions.par_iter_mut().zip(flags).enumerate();
        let passes: Vec<Passed> = coordinates
            .map(|(coordinate, (x, flags))| {
                Pass { body, coordinate, x, flags, slabs }.run(&targets, &strained)
            })
            .collect();
        let mut moved = Moved::default();
        let mut elements = Vec::new();
        let mut held = Vec::new();
        for pass in passes {
            moved.visits += pass.visits;
            elements.extend(pass.touched);
            held.extend(pass.blocked);
        }
        elements.par_sort_unstable();
        elements.dedup();
        moved.elements = elements.len();
        elements.iter().for_each(|&element| self.mark_changed(element));
        held.sort_unstable();
        held.dedup();
        moved.contradictions = held.iter().flat_map(|&element| self.contradictions(element)).collect();
        self.strained = moved.contradictions.iter().map(|found| found.held).collect();
        self.strained.dedup();
        targets.iter().for_each(|&(element, _)| self.body.links.set_grabbed(element, false));
        Ok(moved)
    }

    /// Elements and where they go, in units.
    fn targets(&self, drags: &[Drag]) -> Result<Vec<(u32, [i32; 3])>, ChainError> {
        let mut targets = Vec::with_capacity(drags.len());
        for &Drag { element, to } in drags {
            self.check_element(element)?;
            let [Some(x), Some(y), Some(z)] = to.map(from_steps) else {
                return Err(ChainError::TooFar { element, to });
            };
            let to = [x, y, z];
            if self.body.links.is_fixed(element) && to != self.units(element) {
                return Err(ChainError::NotFree { element, why: "it is fixed, and told to go elsewhere" });
            }
            targets.push((element, to));
        }
        targets.sort_unstable();
        targets.dedup();
        match targets.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => {
                Err(ChainError::NotFree { element: pair[0].0, why: "it is told to go to two places at once" })
            }
            None => Ok(targets),
        }
    }

    /// The links of an element that are beyond their bounds.
    fn contradictions(&self, held: u32) -> Vec<Contradiction> {
        let fixed = self.body.links.is_fixed(held);
        let mut found = Vec::new();
        for neighbor in self.body.links.of(held) {
            for axis in 0..3 {
                let excess = self.excess(held, neighbor, axis);
                if excess > 0 {
                    let other = neighbor.element;
                    found.push(Contradiction { held, fixed, other, axis, excess: to_steps(excess) });
                }
            }
        }
        found
    }

    /// How far a link is beyond its bounds in a coordinate, in units; 0 within them.
    pub(crate) fn excess(&self, element: u32, neighbor: Neighbor, coordinate: usize) -> i32 {
        let Bounds { lo, hi } = self.body.bounds(element, neighbor, coordinate);
        let x = |element: u32| self.positions[coordinate][element as usize];
        let apart = x(neighbor.element) - x(element);
        let apart = if neighbor.next { apart } else { -apart };
        (lo - apart).max(apart - hi).max(0)
    }
}
