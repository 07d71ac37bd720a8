//! The passes over one coordinate: one that raises, one that lowers.

use std::collections::VecDeque;

use rayon::prelude::*;

use crate::chain::Body;
use crate::limits::Bounds;

/// The element waits to be looked at.
const QUEUED: u8 = 1;
/// The element has moved in this drag.
const TOUCHED: u8 = 2;

/// A coordinate of all elements, while it is changed.
pub(crate) struct Pass<'a> {
    pub(crate) body: &'a Body,
    pub(crate) coordinate: usize,
    pub(crate) x: &'a mut [i32],
    /// All 0 between drags.
    pub(crate) flags: &'a mut [u8],
    /// How many slabs to divide the grid into at the most.
    pub(crate) slabs: usize,
}

/// What the passes did.
#[derive(Default)]
pub(crate) struct Passed {
    pub(crate) visits: u64,
    /// Elements that moved.
    pub(crate) touched: Vec<u32>,
    /// Elements that would have had to, and must not.
    pub(crate) blocked: Vec<u32>,
}

impl Pass<'_> {
    /// Raises what has to be raised, then lowers what has to be lowered.
    pub(crate) fn run(mut self, targets: &[(u32, [i32; 3])], strained: &[u32]) -> Passed {
        let mut passed = Passed::default();
        let mut told: Vec<(u32, i32)> =
            targets.iter().map(|&(element, to)| (element, to[self.coordinate])).collect();
        if !strained.is_empty() {
            told.extend(self.close(strained, &mut passed));
        }
        told.retain(|&(element, to)| {
            let place = element as usize;
            let moves = std::mem::replace(&mut self.x[place], to) != to;
            if moves && self.flags[place] & TOUCHED == 0 {
                self.flags[place] |= TOUCHED;
                passed.touched.push(element);
            }
            moves
        });
        let waiting: Vec<u32> = told.iter().map(|&(element, _)| element).collect();
        self.propagate::<true, true>(&waiting, &mut passed);
        self.propagate::<false, true>(&waiting, &mut passed);
        passed.touched.iter().for_each(|&element| self.flags[element as usize] = 0);
        passed
    }

    /// Brings the links at `strained` within their bounds, as if nothing were held; the fixed elements that moved, and where they belong.
    /// The state between is one from which a drag finds a way if there is any.
    fn close(&mut self, strained: &[u32], passed: &mut Passed) -> Vec<(u32, i32)> {
        let links = &self.body.links;
        let fixed = (0..links.len() as u32).filter(|&element| links.is_fixed(element));
        let mut fixed: Vec<(u32, i32)> = fixed.map(|element| (element, self.x[element as usize])).collect();
        let ends = strained.iter().flat_map(|&element| links.of(element)).map(|n| n.element);
        let waiting: Vec<u32> = strained.iter().copied().chain(ends).collect();
        self.propagate::<true, false>(&waiting, passed);
        fixed.retain(|&(element, at)| self.x[element as usize] != at);
        fixed
    }

    /// Visits whatever waits, until nothing does. `UP`: coordinates are raised, else lowered; `HOLD`: what is held stays.
    fn propagate<const UP: bool, const HOLD: bool>(&mut self, waiting: &[u32], passed: &mut Passed) {
        if waiting.is_empty() {
            return;
        }
        let (body, coordinate) = (self.body, self.coordinate);
        let [nx, ny, nz] = body.links.shape();
        let planes = nz.div_ceil(self.slabs.min(nz));
        let size = nx * ny * planes;
        let parts = self.x.chunks_mut(size).zip(self.flags.chunks_mut(size)).enumerate();
        let mut slabs: Vec<Slab<'_>> = parts
            .map(|(number, (x, flags))| {
                let first = (number * size) as u32;
                Slab {
                    body,
                    coordinate,
                    first,
                    x,
                    flags,
                    queue: VecDeque::new(),
                    asked: Default::default(),
                    passed: Passed::default(),
                }
            })
            .collect();
        waiting.iter().for_each(|&element| slabs[element as usize / size].queue.push_back(element));
        while slabs.iter().any(|slab| !slab.queue.is_empty()) {
            slabs.par_iter_mut().for_each(Slab::empty_queue::<UP, HOLD>);
            for number in 0..slabs.len() {
                let [before, after] = std::mem::take(&mut slabs[number].asked);
                for (to, asked) in [(number.wrapping_sub(1), before), (number + 1, after)] {
                    asked.into_iter().for_each(|(element, bound)| slabs[to].ask::<UP, HOLD>(element, bound));
                }
            }
        }
        for slab in slabs {
            passed.visits += slab.passed.visits;
            passed.touched.extend(slab.passed.touched);
            passed.blocked.extend(slab.passed.blocked);
        }
    }
}

/// Some planes of the grid.
struct Slab<'a> {
    body: &'a Body,
    coordinate: usize,
    /// Its first element.
    first: u32,
    x: &'a mut [i32],
    flags: &'a mut [u8],
    queue: VecDeque<u32>,
    /// What is asked of elements of the slabs before and after.
    asked: [Vec<(u32, i32)>; 2],
    passed: Passed,
}

impl Slab<'_> {
    /// Makes the neighbors of whatever waits keep within their bounds.
    fn empty_queue<const UP: bool, const HOLD: bool>(&mut self) {
        let body = self.body;
        while let Some(sponsor) = self.queue.pop_front() {
            let place = (sponsor - self.first) as usize;
            self.flags[place] &= !QUEUED;
            self.passed.visits += 1;
            let x = self.x[place];
            for neighbor in body.links.of(sponsor) {
                let Bounds { lo, hi } = body.bounds(sponsor, neighbor, self.coordinate);
                let bound = match (UP, neighbor.next) {
                    (true, true) => x + lo,
                    (true, false) => x - hi,
                    (false, true) => x + hi,
                    (false, false) => x - lo,
                };
                let element = neighbor.element;
                if (element.wrapping_sub(self.first) as usize) < self.x.len() {
                    self.ask::<UP, HOLD>(element, bound);
                } else {
                    self.asked[usize::from(element > sponsor)].push((element, bound));
                }
            }
        }
    }

    /// Moves an element to a bound unless it is within it; then it waits.
    #[inline]
    fn ask<const UP: bool, const HOLD: bool>(&mut self, element: u32, bound: i32) {
        let place = (element - self.first) as usize;
        let x = &mut self.x[place];
        if if UP { *x >= bound } else { *x <= bound } {
            return;
        }
        if HOLD && self.body.links.is_held(element) {
            self.passed.blocked.push(element);
            return;
        }
        *x = bound;
        let flags = std::mem::replace(&mut self.flags[place], QUEUED | TOUCHED);
        if flags & TOUCHED == 0 {
            self.passed.touched.push(element);
        }
        if flags & QUEUED == 0 {
            self.queue.push_back(element);
        }
    }
}
