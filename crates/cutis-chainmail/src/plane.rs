//! Relaxation of the elements of a plane: one by one, and side by side where many of a row are of one kind.

use crate::census::{Census, Kind, MIXED, STILL};
use crate::chain::Body;
use crate::limits::Bounds;
use crate::links::{BEFORE, NEXT};
use crate::units::UNITS_PER_STEP;

/// Elements of a row that are looked at side by side; half of them, of one color of the checkerboard, may move.
const BLOCK: usize = 64;
/// Coordinates in the widest vector that there is.
const VECTOR: usize = 16;
/// Of a kind that has no more in a block, elements are relaxed one by one: that takes no longer.
const FEW: usize = 4;

/// A coordinate of the elements of a plane, and of the planes beside it.
pub(crate) struct Plane<'a> {
    pub(crate) body: &'a Body,
    /// Of all elements.
    pub(crate) census: &'a Census,
    pub(crate) coordinate: usize,
    pub(crate) k: usize,
    pub(crate) x: &'a mut [i32],
    pub(crate) below: &'a [i32],
    pub(crate) above: &'a [i32],
    /// By row of the grid: something in it has changed since elements of this color were last relaxed.
    pub(crate) changed: &'a [bool],
    /// By row of the plane: something in it moves now.
    pub(crate) moved: &'a mut [bool],
}

impl Plane<'_> {
    /// Moves the elements whose `i + j + k` is even, or odd; how many moved. Where nothing around a row has changed, nothing moves.
    #[inline(always)]
    pub(crate) fn relax(&mut self, odd: usize) -> u64 {
        let rows = self.moved.len();
        let mut moves = 0;
        for j in 0..rows {
            let row_moves = if self.has_cause(j) { self.relax_row(j, (odd + j + self.k) % 2) } else { 0 };
            self.moved[j] = row_moves > 0;
            moves += row_moves;
        }
        moves
    }

    /// Whether a row or one beside it has changed.
    fn has_cause(&self, j: usize) -> bool {
        let (rows, at) = (self.moved.len(), |row: usize| self.changed.get(row).copied().unwrap_or_default());
        let row = self.k * rows + j;
        at(row)
            || at(row + rows)
            || row.checked_sub(rows).is_some_and(at)
            || (j > 0 && at(row - 1))
            || (j + 1 < rows && at(row + 1))
    }

    /// Moves the elements of a row whose `i` is even, or odd.
    #[inline(always)]
    fn relax_row(&mut self, j: usize, odd: usize) -> u64 {
        let nx = self.body.links.shape()[0];
        let (row, first) = (j * nx, self.k * self.x.len() + j * nx);
        let census = &self.census.of[first..first + nx];
        let mut moves = 0;
        for (part, i) in census.chunks(BLOCK).zip((0..).step_by(BLOCK)) {
            let (place, odd) = (row + i, (odd + i) % 2);
            if part.iter().fold(STILL, |all, state| all & state) == STILL {
                continue;
            }
            let mut states = [STILL; BLOCK];
            states[..part.len()].copy_from_slice(part);
            // A bit for each kind.
            let mut there =
                states.iter().filter(|&&state| state < MIXED).fold(0_u64, |all, state| all | 1 << state);
            while there != 0 {
                let kind = there.trailing_zeros() as u8;
                there &= there - 1;
                if states.iter().filter(|&&state| state == kind).count() > FEW {
                    moves += self.relax_alike(place, part.len(), &states, kind, odd);
                } else {
                    states.iter_mut().filter(|state| **state == kind).for_each(|state| *state = MIXED);
                }
            }
            for (eight, lanes) in states.as_chunks::<8>().0.iter().zip((0..).step_by(8)) {
                if eight.iter().fold(false, |any, &state| any | (state == MIXED)) {
                    for lane in (odd..8).step_by(2).filter(|&lane| eight[lane] == MIXED) {
                        moves += u64::from(self.relax_one(place + lanes + lane));
                    }
                }
            }
        }
        moves
    }

    /// Moves those of `count` elements from a place on that are of a kind, by their `states`. They have six links, so that there are
    /// elements on all sides.
    #[inline(always)]
    fn relax_alike(
        &mut self,
        place: usize,
        count: usize,
        states: &[u8; BLOCK],
        number: u8,
        odd: usize,
    ) -> u64 {
        let nx = self.body.links.shape()[0];
        // Whole vectors are faster; where they reach beyond the block, nothing moves.
        let count = count.next_multiple_of(VECTOR).min(self.x.len() - place - nx);
        let Kind { bounds, k } = &self.census.kinds[usize::from(number)];
        let (bounds, k) = (bounds[self.coordinate], *k);
        let mut around = [0; BLOCK + 2];
        around[..count + 2].copy_from_slice(&self.x[place - 1..place + count + 1]);
        let (before, at, after) = (&around[..count], &around[1..=count], &around[2..count + 2]);
        let (left, right) = (&self.x[place - nx..][..count], &self.x[place + nx..][..count]);
        let (below, above) = (&self.below[place..][..count], &self.above[place..][..count]);
        let mut to = [0; BLOCK];
        let to = &mut to[..count];
        let mut moves = 0_u32;
        for lane in 0..count {
            let x = at[lane];
            let pairs = [[before[lane], after[lane]], [left[lane], right[lane]], [below[lane], above[lane]]];
            // The rest lengths before and after cancel in the sum.
            let (mut sum, mut lowest, mut highest) = (0_i32, i32::MIN, i32::MAX);
            for ([before, after], [back, ahead]) in pairs.into_iter().zip(bounds) {
                sum = sum.wrapping_add(before).wrapping_add(after);
                lowest = lowest.max(before + back.lo).max(after - ahead.hi);
                highest = highest.min(before + back.hi).min(after - ahead.lo);
            }
            let sum = sum.wrapping_sub(x.wrapping_mul(6));
            let (lowest, highest) = (lowest - x, highest - x);
            let size = ((2 * sum.unsigned_abs().min(MOST_ASKED) + 5) / 12) as i32;
            let asked = if sum < 0 { -size } else { size };
            let moves_here =
                (states[lane] == number) & (lane % 2 == odd) & (size >= k) & (lowest <= 0) & (highest >= 0);
            let by = if moves_here { asked.min(highest).max(lowest) } else { 0 };
            moves += u32::from(by != 0);
            to[lane] = x.wrapping_add(by);
        }
        self.x[place..place + count].copy_from_slice(to);
        u64::from(moves)
    }

    /// Whether the element moved, which is free.
    fn relax_one(&mut self, place: usize) -> bool {
        let (body, nx) = (self.body, self.body.links.shape()[0]);
        let element = self.k * self.x.len() + place;
        let (material, bits) = (body.materials[element], body.links.bits_of(element));
        let plane = self.x.len();
        let x = self.x[place];
        let (mut count, mut sum, mut lowest, mut highest) = (0_u32, 0_i32, i32::MIN, i32::MAX);
        let mut ask = |axis: usize, next: bool, element: usize, there: i32| {
            let apart = there - x;
            let Bounds { lo, hi } =
                body.limits.of(self.coordinate, body.limits.pair(material, body.materials[element]), axis);
            let rest = if axis == self.coordinate { UNITS_PER_STEP } else { 0 };
            let (asked, from, to) = if next {
                (apart - rest, apart - hi, apart - lo)
            } else {
                (apart + rest, apart + lo, apart + hi)
            };
            count += 1;
            sum = sum.wrapping_add(asked);
            (lowest, highest) = (lowest.max(from), highest.min(to));
        };
        for (axis, stride) in [1, nx].into_iter().enumerate() {
            if bits & NEXT[axis] != 0 {
                ask(axis, true, element + stride, self.x[place + stride]);
            }
            if bits & BEFORE[axis] != 0 {
                ask(axis, false, element - stride, self.x[place - stride]);
            }
        }
        if bits & NEXT[2] != 0 {
            ask(2, true, element + plane, self.above[place]);
        }
        if bits & BEFORE[2] != 0 {
            ask(2, false, element - plane, self.below[place]);
        }
        // An element of a link that is beyond its bounds stays: a way that keeps the others may not be there.
        if count == 0 || lowest > 0 || highest < 0 {
            return false;
        }
        let asked = mean(sum, count);
        let by = if asked.abs() < body.limits.k(material) { 0 } else { asked.clamp(lowest, highest) };
        self.x[place] += by;
        by != 0
    }
}

/// More than six neighbors within their bounds can ask for together, and few enough to be doubled in 32 bits.
const MOST_ASKED: u32 = 1 << 30;

/// The nearest integer to a mean, of two that are equally near the one nearer to 0.
fn mean(sum: i32, count: u32) -> i32 {
    let twice = 2 * sum.unsigned_abs().min(MOST_ASKED);
    // Divisions by a number that is known beforehand are multiplications.
    let size = match count {
        6 => (twice + 5) / 12,
        5 => (twice + 4) / 10,
        4 => (twice + 3) / 8,
        3 => (twice + 2) / 6,
        2 => (twice + 1) / 4,
        _ => twice / 2,
    };
    size as i32 * sum.signum()
}

#[cfg(test)]
mod tests {
    use super::mean;

    #[test]
    fn means_are_rounded_to_the_nearest_and_ties_towards_zero() {
        let of = |sum, count| (mean(sum, count), mean(-sum, count));
        assert_eq!(of(3, 2), (1, -1));
        assert_eq!(of(5, 3), (2, -2));
        assert_eq!(of(4, 3), (1, -1));
        assert_eq!(of(1, 2), (0, 0));
    }
}
