//! Elastic relaxation: each element towards where its neighbors ask it to be.
//!
//! A neighbor asks an element to be where it rests to that neighbor. The mean of what all ask is where the element has the least
//! energy; it goes there, as far as its links' bounds allow, unless it is nearer than its material's `k` in that coordinate.
//! Elements whose `i + j + k` is even have only odd neighbors, so that all of one kind can move at once: each sweep moves the
//! even ones, then the odd ones, with the same bits on any number of threads.
//!
//! An element that moves comes nearer to the one minimum of a parabola without passing it, so that every move lowers the energy, and
//! relaxation ends: coordinates are integers, and there is no endless descent among them.
//!
//! An element that was looked at moves again only if a neighbor moved in between. So of each row of elements it is noted whether
//! something in it changed, and rows that have nothing to answer to are passed by: relaxing after a local drag costs what moves.

use rayon::prelude::*;

use crate::census::{Census, STILL};
use crate::chain::Chain;
use crate::plane::Plane;

/// What relaxation did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Relaxation {
    /// Sweeps over all elements.
    pub sweeps: u32,
    /// Times that a coordinate of an element changed.
    pub moves: u64,
    /// Whether nothing moves any more.
    pub settled: bool,
}

impl Chain {
    /// Sweeps until nothing moves, or `most` times. Fixed elements and those in `held` stay.
    ///
    /// The first time it looks up which elements are alike, also for no sweep at all: whoever waits for frames can have that
    /// done before the first of them.
    pub fn relax(&mut self, most: u32, held: &[u32]) -> Relaxation {
        let held: Vec<u32> = held.iter().copied().filter(|&element| self.is_there(element)).collect();
        let mut census = std::mem::take(&mut self.census);
        if census.of.is_empty() {
            census = Census::new(&self.body);
        }
        let free: Vec<u8> = held.iter().map(|&element| census.of[element as usize]).collect();
        held.iter().for_each(|&element| census.of[element as usize] = STILL);
        let mut done = Relaxation::default();
        let [_, ny, nz] = self.shape();
        let rows = || [0, 1, 2].map(|_| vec![false; ny * nz]);
        let (mut even, mut odd) = (rows(), [0, 1, 2].map(|_| self.changed.clone()));
        while !done.settled && done.sweeps < most {
            let mut moves = self.sweep_half(0, &census, &odd, &mut even);
            if done.sweeps == 0 {
                let before = even.iter_mut().map(|rows| rows.iter_mut().zip(&self.changed));
                before.flatten().for_each(|(row, changed)| *row |= changed);
            }
            moves += self.sweep_half(1, &census, &even, &mut odd);
            done.sweeps += 1;
            done.moves += moves;
            done.settled = moves == 0;
        }
        if done.sweeps > 0 {
            let moved = |row: usize| odd.iter().any(|rows| rows[row]);
            self.changed = (0..ny * nz).map(moved).collect();
        }
        held.iter().zip(&free).rev().for_each(|(&element, &state)| census.of[element as usize] = state);
        self.mark_held(&held);
        self.census = census;
        done
    }

    /// Notes what was held by a relaxation: once it is let go, it may move.
    pub(crate) fn mark_held(&mut self, held: &[u32]) {
        held.iter().for_each(|&element| self.mark_changed(element));
    }

    /// Moves the elements whose `i + j + k` is even, or odd: first those of every second plane, which see the planes between as they are,
    /// then those of the planes between. By coordinate and row of the grid: what changed before, what moves now.
    fn sweep_half(
        &mut self,
        odd: usize,
        census: &Census,
        changed: &[Vec<bool>; 3],
        moved: &mut [Vec<bool>; 3],
    ) -> u64 {
        let Self { body, positions, width, .. } = self;
        let [nx, ny, nz] = body.links.shape();
        let mut moves = 0;
        for second in 0..2 {
            let mut planes = Vec::with_capacity(3 * nz.div_ceil(2));
            for (coordinate, (positions, moved)) in positions.iter_mut().zip(&mut *moved).enumerate() {
                let changed = &changed[coordinate];
                let mut between: Vec<&[i32]> = Vec::with_capacity(nz.div_ceil(2));
                let first = planes.len();
                let rows = moved.chunks_mut(ny);
                for ((k, x), moved) in positions.chunks_mut(nx * ny).enumerate().zip(rows) {
                    if k % 2 == second {
                        let (below, above) = (&[][..], &[][..]);
                        planes.push(Plane { body, census, coordinate, k, x, below, above, changed, moved });
                    } else {
                        between.push(x);
                    }
                }
                for plane in &mut planes[first..] {
                    let at = |k: usize| between.get(k / 2).copied().unwrap_or_default();
                    plane.below = plane.k.checked_sub(1).map(at).unwrap_or_default();
                    plane.above = at(plane.k + 1);
                }
            }
            let moved: Vec<u64> =
                planes.into_par_iter().map(|mut plane| width.relax(&mut plane, odd)).collect();
            moves += moved.iter().sum::<u64>();
        }
        moves
    }
}
