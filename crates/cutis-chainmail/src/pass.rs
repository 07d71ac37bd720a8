//! Propagation of one coordinate: a pass that raises elements, then a pass that lowers elements.

use std::collections::VecDeque;

use rayon::prelude::*;

use crate::chain::Structure;
use crate::limits::Bounds;

/// Flag of an element that is in a queue.
const QUEUED: u8 = 1;
/// Flag of an element that this drag has moved.
const TOUCHED: u8 = 2;

/// One coordinate of all elements during a drag.
pub(crate) struct Pass<'a> {
    pub(crate) structure: &'a Structure,
    pub(crate) coordinate: usize,
    pub(crate) x: &'a mut [i32],
    /// All 0 between drags.
    pub(crate) flags: &'a mut [u8],
    /// Largest number of slabs that the grid is divided into.
    pub(crate) slabs: usize,
}

/// The effect of both passes.
#[derive(Default)]
pub(crate) struct PassResult {
    pub(crate) visits: u64,
    /// Elements that moved.
    pub(crate) touched: Vec<u32>,
    /// Fixed or grabbed elements that a bound would have moved.
    pub(crate) blocked: Vec<u32>,
}

impl Pass<'_> {
    /// Sets the grabbed elements to their targets and propagates: first upwards, then downwards.
    pub(crate) fn run(mut self, targets: &[(u32, [i32; 3])], strained: &[u32]) -> PassResult {
        let mut result = PassResult::default();
        let mut sources: Vec<(u32, i32)> =
            targets.iter().map(|&(element, to)| (element, to[self.coordinate])).collect();
        if !strained.is_empty() {
            sources.extend(self.close(strained, &mut result));
        }
        sources.retain(|&(element, to)| {
            let place = element as usize;
            let moves = std::mem::replace(&mut self.x[place], to) != to;
            if moves && self.flags[place] & TOUCHED == 0 {
                self.flags[place] |= TOUCHED;
                result.touched.push(element);
            }
            moves
        });
        let waiting: Vec<u32> = sources.iter().map(|&(element, _)| element).collect();
        self.propagate::<true, true>(&waiting, &mut result);
        self.propagate::<false, true>(&waiting, &mut result);
        result.touched.iter().for_each(|&element| self.flags[element as usize] = 0);
        result
    }

    /// Brings the links at `strained` within their bounds as if no element were fixed. Returns the
    /// fixed elements that moved, with the coordinates to which they must return.
    ///
    /// From this state a drag finds a solution if one exists.
    fn close(&mut self, strained: &[u32], result: &mut PassResult) -> Vec<(u32, i32)> {
        let links = &self.structure.links;
        let fixed = (0..links.len() as u32).filter(|&element| links.is_fixed(element));
        let mut fixed: Vec<(u32, i32)> = fixed.map(|element| (element, self.x[element as usize])).collect();
        let ends = strained.iter().flat_map(|&element| links.of(element)).map(|n| n.element);
        let waiting: Vec<u32> = strained.iter().copied().chain(ends).collect();
        self.propagate::<true, false>(&waiting, result);
        fixed.retain(|&(element, at)| self.x[element as usize] != at);
        fixed
    }

    /// Visits the waiting elements, and those that move because of them, until no element waits.
    /// `UP`: coordinates are raised, else lowered. `HOLD`: fixed and grabbed elements stay.
    fn propagate<const UP: bool, const HOLD: bool>(&mut self, waiting: &[u32], result: &mut PassResult) {
        if waiting.is_empty() {
            return;
        }
        let (structure, coordinate) = (self.structure, self.coordinate);
        let [nx, ny, nz] = structure.links.shape();
        let planes = nz.div_ceil(self.slabs.min(nz));
        let size = nx * ny * planes;
        let parts = self.x.chunks_mut(size).zip(self.flags.chunks_mut(size)).enumerate();
        let mut slabs: Vec<Slab<'_>> = parts
            .map(|(number, (x, flags))| {
                let first = (number * size) as u32;
                Slab {
                    structure,
                    coordinate,
                    first,
                    x,
                    flags,
                    queue: VecDeque::new(),
                    outgoing: Default::default(),
                    result: PassResult::default(),
                }
            })
            .collect();
        waiting.iter().for_each(|&element| slabs[element as usize / size].queue.push_back(element));
        while slabs.iter().any(|slab| !slab.queue.is_empty()) {
            slabs.par_iter_mut().for_each(Slab::empty_queue::<UP, HOLD>);
            for number in 0..slabs.len() {
                let [before, after] = std::mem::take(&mut slabs[number].outgoing);
                for (to, bounds) in [(number.wrapping_sub(1), before), (number + 1, after)] {
                    bounds
                        .into_iter()
                        .for_each(|(element, bound)| slabs[to].enforce::<UP, HOLD>(element, bound));
                }
            }
        }
        for slab in slabs {
            result.visits += slab.result.visits;
            result.touched.extend(slab.result.touched);
            result.blocked.extend(slab.result.blocked);
        }
    }
}

/// Consecutive planes of the grid with a queue of their own.
struct Slab<'a> {
    structure: &'a Structure,
    coordinate: usize,
    /// Number of the slab's first element.
    first: u32,
    x: &'a mut [i32],
    flags: &'a mut [u8],
    queue: VecDeque<u32>,
    /// Bounds for elements of the previous and of the next slab.
    outgoing: [Vec<(u32, i32)>; 2],
    result: PassResult,
}

impl Slab<'_> {
    /// Enforces the bounds of the links of all waiting elements.
    fn empty_queue<const UP: bool, const HOLD: bool>(&mut self) {
        let structure = self.structure;
        while let Some(sponsor) = self.queue.pop_front() {
            let place = (sponsor - self.first) as usize;
            self.flags[place] &= !QUEUED;
            self.result.visits += 1;
            let x = self.x[place];
            for neighbor in structure.links.of(sponsor) {
                let Bounds { lo, hi } = structure.bounds(sponsor, neighbor, self.coordinate);
                let bound = match (UP, neighbor.next) {
                    (true, true) => x + lo,
                    (true, false) => x - hi,
                    (false, true) => x + hi,
                    (false, false) => x - lo,
                };
                let element = neighbor.element;
                if (element.wrapping_sub(self.first) as usize) < self.x.len() {
                    self.enforce::<UP, HOLD>(element, bound);
                } else {
                    self.outgoing[usize::from(element > sponsor)].push((element, bound));
                }
            }
        }
    }

    /// Moves an element to a bound if it violates the bound, and puts it into the queue.
    #[inline]
    fn enforce<const UP: bool, const HOLD: bool>(&mut self, element: u32, bound: i32) {
        let place = (element - self.first) as usize;
        let x = &mut self.x[place];
        if if UP { *x >= bound } else { *x <= bound } {
            return;
        }
        if HOLD && self.structure.links.is_held(element) {
            self.result.blocked.push(element);
            return;
        }
        *x = bound;
        let flags = std::mem::replace(&mut self.flags[place], QUEUED | TOUCHED);
        if flags & TOUCHED == 0 {
            self.result.touched.push(element);
        }
        if flags & QUEUED == 0 {
            self.queue.push_back(element);
        }
    }
}
