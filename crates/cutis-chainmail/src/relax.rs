//! Elastic relaxation: each element towards where its neighbours ask it to be.
//!
//! A neighbour asks an element to be where it rests to that neighbour. The mean of what all ask is where the element has the least
//! energy; it goes there, as far as its links' bounds allow, unless it is nearer than its material's `k` in that coordinate.
//! Elements whose `i + j + k` is even have only odd neighbours, so that all of one kind can move at once: each sweep moves the
//! even ones, then the odd ones, with the same bits on any number of threads.
//!
//! An element that moves comes nearer to the one minimum of a parabola without passing it, so that every move lowers the energy, and
//! relaxation ends: coordinates are integers, and there is no endless descent among them.

use rayon::prelude::*;

use crate::chain::{Chain, NO_MATERIAL};
use crate::plane::{self, Plane};

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
    pub fn relax(&mut self, most: u32, held: &[u32]) -> Relaxation {
        let held: Vec<u32> = held.iter().copied().filter(|&element| self.is_there(element)).collect();
        let mut uniform = std::mem::take(&mut self.uniform);
        if uniform.is_empty() {
            uniform = plane::uniform(&self.body);
        }
        let free: Vec<u8> = held.iter().map(|&element| uniform[element as usize]).collect();
        for &element in &held {
            self.body.links.set_grabbed(element, true);
            uniform[element as usize] = NO_MATERIAL;
        }
        let mut done = Relaxation::default();
        while !done.settled && done.sweeps < most {
            let moves = self.sweep_half(0, &uniform) + self.sweep_half(1, &uniform);
            done.sweeps += 1;
            done.moves += moves;
            done.settled = moves == 0;
        }
        for (&element, &material) in held.iter().zip(&free).rev() {
            self.body.links.set_grabbed(element, false);
            uniform[element as usize] = material;
        }
        self.uniform = uniform;
        done
    }

    /// Moves the elements whose `i + j + k` is even, or odd: first those of every second plane, which see the planes between as they are,
    /// then those of the planes between.
    fn sweep_half(&mut self, odd: usize, uniform: &[u8]) -> u64 {
        let Self { body, positions, .. } = self;
        let [nx, ny, nz] = body.links.shape();
        let mut moves = 0;
        for second in 0..2 {
            let mut planes = Vec::with_capacity(3 * nz.div_ceil(2));
            for (coordinate, positions) in positions.iter_mut().enumerate() {
                let mut between: Vec<&[i32]> = Vec::with_capacity(nz.div_ceil(2));
                let first = planes.len();
                for (k, x) in positions.chunks_mut(nx * ny).enumerate() {
                    if k % 2 == second {
                        planes.push(Plane { body, uniform, coordinate, k, x, below: &[], above: &[] });
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
            let moved: Vec<u64> = planes.into_par_iter().map(|mut plane| plane.relax(odd)).collect();
            moves += moved.iter().sum::<u64>();
        }
        moves
    }
}
