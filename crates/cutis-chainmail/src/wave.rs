//! Propagation of a drag. Each element that moves makes its neighbors keep within their bounds,
//! until all links do. The documentation of the crate has the theory.

use rayon::prelude::*;

use crate::ChainError;
use crate::chain::Chain;
use crate::limits::Bounds;
use crate::links::Neighbor;
use crate::pass::{Pass, PassResult};
use crate::units::{from_steps, to_steps};

/// The target of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// The element.
    pub element: u32,
    /// Its new position in steps of the grid. It is rounded to the nearest unit.
    pub to: [f64; 3],
}

/// The order in which a drag visits elements. The result is the same for both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// First in, first out. The three coordinates are processed in parallel.
    #[default]
    Fifo,
    /// One queue for each slab of the grid, in parallel on the threads of rayon. Bounds that reach
    /// another slab are handed over when all queues are empty.
    Slabs,
}

/// Largest number of slabs.
const SLABS: usize = 16;

/// The effect of a drag.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DragReport {
    /// Number of elements that moved. After a drag with contradictions some of them may have moved
    /// back.
    pub elements: usize,
    /// Number of visits of elements in all three coordinates.
    pub visits: u64,
    /// Links that would have moved a fixed or grabbed element. These links are violated, and no
    /// others.
    pub contradictions: Vec<Contradiction>,
}

/// A link that cannot hold, because one end is fixed or grabbed and the other end had to move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contradiction {
    /// The end that must not move.
    pub held: u32,
    /// True if this end is fixed, false if it is grabbed.
    pub fixed: bool,
    /// The other end.
    pub other: u32,
    /// The violated coordinate.
    pub axis: usize,
    /// Size of the violation in steps.
    pub excess: f64,
}

impl Chain {
    /// Moves elements exactly to their targets, and others as little as their links allow. Elements
    /// that an earlier drag grabbed are free again.
    ///
    /// # Errors
    /// [`ChainError::NoSuchElement`], [`ChainError::TooFar`], [`ChainError::NotFree`]; then nothing
    /// moves.
    pub fn drag(&mut self, drags: &[Drag], order: Order) -> Result<DragReport, ChainError> {
        let targets = self.targets(drags)?;
        targets.iter().for_each(|&(element, _)| self.structure.links.set_grabbed(element, true));
        let strained = std::mem::take(&mut self.strained);
        let slabs = match order {
            Order::Fifo => 1,
            Order::Slabs => SLABS,
        };
        let Self { structure, positions, flags, .. } = self;
        let coordinates = positions.par_iter_mut().zip(flags).enumerate();
        let passes: Vec<PassResult> = coordinates
            .map(|(coordinate, (x, flags))| {
                Pass { structure, coordinate, x, flags, slabs }.run(&targets, &strained)
            })
            .collect();
        let mut moved = DragReport::default();
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
        targets.iter().for_each(|&(element, _)| self.structure.links.set_grabbed(element, false));
        Ok(moved)
    }

    /// Validates the targets and converts them to units.
    fn targets(&self, drags: &[Drag]) -> Result<Vec<(u32, [i32; 3])>, ChainError> {
        let mut targets = Vec::with_capacity(drags.len());
        for &Drag { element, to } in drags {
            self.check_element(element)?;
            let [Some(x), Some(y), Some(z)] = to.map(from_steps) else {
                return Err(ChainError::TooFar { element, to });
            };
            let to = [x, y, z];
            if self.structure.links.is_fixed(element) && to != self.units(element) {
                return Err(ChainError::NotFree { element, why: "it is fixed, and its target is elsewhere" });
            }
            targets.push((element, to));
        }
        targets.sort_unstable();
        targets.dedup();
        match targets.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => {
                Err(ChainError::NotFree { element: pair[0].0, why: "it has two different targets" })
            }
            None => Ok(targets),
        }
    }

    /// The links of an element that are beyond their bounds.
    fn contradictions(&self, held: u32) -> Vec<Contradiction> {
        let fixed = self.structure.links.is_fixed(held);
        let mut found = Vec::new();
        for neighbor in self.structure.links.of(held) {
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

    /// Violation of a link in one coordinate, in units; 0 if it is within its bounds.
    pub(crate) fn excess(&self, element: u32, neighbor: Neighbor, coordinate: usize) -> i32 {
        let Bounds { lo, hi } = self.structure.bounds(element, neighbor, coordinate);
        let x = |element: u32| self.positions[coordinate][element as usize];
        let apart = x(neighbor.element) - x(element);
        let apart = if neighbor.next { apart } else { -apart };
        (lo - apart).max(apart - hi).max(0)
    }
}
