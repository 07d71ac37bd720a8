//! Relaxation of one plane: elements of a common class together, all others one by one.

use crate::chain::Structure;
use crate::limits::Bounds;
use crate::links::{BEFORE, NEXT};
use crate::neighborhood::{IMMOBILE, NeighborhoodClass, NeighborhoodClasses, UNCLASSIFIED};
use crate::units::UNITS_PER_STEP;

/// Elements of a row that are processed together. Half of them, of one checkerboard color, may
/// move.
const BLOCK: usize = 64;
/// Coordinates in the widest SIMD vector.
const VECTOR: usize = 16;
/// A class with no more members than this in a block is relaxed one by one, which is as fast.
const FEW: usize = 4;

/// One coordinate of the elements of a plane, and of the two neighboring planes.
pub(crate) struct Plane<'a> {
    pub(crate) structure: &'a Structure,
    /// Classes of all elements of the grid.
    pub(crate) classes: &'a NeighborhoodClasses,
    pub(crate) coordinate: usize,
    pub(crate) k: usize,
    pub(crate) x: &'a mut [i32],
    pub(crate) below: &'a [i32],
    pub(crate) above: &'a [i32],
    /// By row of the grid: true if the row changed since elements of this color were last relaxed.
    pub(crate) changed: &'a [bool],
    /// By row of this plane: true if something moved now.
    pub(crate) moved: &'a mut [bool],
}

impl Plane<'_> {
    /// Moves the elements whose `i + j + k` is even (`odd` = 0) or odd, and returns how many moved.
    /// Rows are skipped if neither they nor their neighbors changed.
    #[inline(always)]
    pub(crate) fn relax(&mut self, odd: usize) -> u64 {
        let rows = self.moved.len();
        let mut moves = 0;
        for j in 0..rows {
            let row_moves = if self.must_visit(j) { self.relax_row(j, (odd + j + self.k) % 2) } else { 0 };
            self.moved[j] = row_moves > 0;
            moves += row_moves;
        }
        moves
    }

    /// True if a row or one of its neighbors has changed.
    fn must_visit(&self, j: usize) -> bool {
        let (rows, at) = (self.moved.len(), |row: usize| self.changed.get(row).copied().unwrap_or_default());
        let row = self.k * rows + j;
        at(row)
            || at(row + rows)
            || row.checked_sub(rows).is_some_and(at)
            || (j > 0 && at(row - 1))
            || (j + 1 < rows && at(row + 1))
    }

    /// Moves the elements of a row whose `i` is even or odd.
    #[inline(always)]
    fn relax_row(&mut self, j: usize, odd: usize) -> u64 {
        let nx = self.structure.links.shape()[0];
        let (row, first) = (j * nx, self.k * self.x.len() + j * nx);
        let row_classes = &self.classes.class_of[first..first + nx];
        let mut moves = 0;
        for (part, i) in row_classes.chunks(BLOCK).zip((0..).step_by(BLOCK)) {
            let (place, odd) = (row + i, (odd + i) % 2);
            if part.iter().fold(IMMOBILE, |all, class| all & class) == IMMOBILE {
                continue;
            }
            let mut classes = [IMMOBILE; BLOCK];
            classes[..part.len()].copy_from_slice(part);
            // The set of classes in this block, one bit for each.
            let mut present = classes
                .iter()
                .filter(|&&class| class < UNCLASSIFIED)
                .fold(0_u64, |all, class| all | 1 << class);
            while present != 0 {
                let class_number = present.trailing_zeros() as u8;
                present &= present - 1;
                if classes.iter().filter(|&&class| class == class_number).count() > FEW {
                    moves += self.relax_class(place, part.len(), &classes, class_number, odd);
                } else {
                    classes
                        .iter_mut()
                        .filter(|class| **class == class_number)
                        .for_each(|class| *class = UNCLASSIFIED);
                }
            }
            for (eight, lanes) in classes.as_chunks::<8>().0.iter().zip((0..).step_by(8)) {
                if eight.iter().fold(false, |any, &class| any | (class == UNCLASSIFIED)) {
                    for lane in (odd..8).step_by(2).filter(|&lane| eight[lane] == UNCLASSIFIED) {
                        moves += u64::from(self.relax_one(place + lanes + lane));
                    }
                }
            }
        }
        moves
    }

    /// Moves the elements of a class among `count` elements that begin at `place`. They have
    /// six links, so that there are neighbors on all sides.
    #[inline(always)]
    fn relax_class(
        &mut self,
        place: usize,
        count: usize,
        classes: &[u8; BLOCK],
        class: u8,
        odd: usize,
    ) -> u64 {
        let nx = self.structure.links.shape()[0];
        // Whole vectors are faster. Nothing moves where they reach beyond the block.
        let count = count.next_multiple_of(VECTOR).min(self.x.len() - place - nx);
        let NeighborhoodClass { bounds, k } = &self.classes.classes[usize::from(class)];
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
                (classes[lane] == class) & (lane % 2 == odd) & (size >= k) & (lowest <= 0) & (highest >= 0);
            let by = if moves_here { asked.min(highest).max(lowest) } else { 0 };
            moves += u32::from(by != 0);
            to[lane] = x.wrapping_add(by);
        }
        self.x[place..place + count].copy_from_slice(to);
        u64::from(moves)
    }

    /// Relaxes one free element. Returns true if it moved.
    fn relax_one(&mut self, place: usize) -> bool {
        let (structure, nx) = (self.structure, self.structure.links.shape()[0]);
        let element = self.k * self.x.len() + place;
        let (material, bits) = (structure.materials[element], structure.links.bits_of(element));
        let plane = self.x.len();
        let x = self.x[place];
        let (mut count, mut sum, mut lowest, mut highest) = (0_u32, 0_i32, i32::MIN, i32::MAX);
        let mut ask = |axis: usize, next: bool, element: usize, there: i32| {
            let apart = there - x;
            let Bounds { lo, hi } = structure.limits.of(
                self.coordinate,
                structure.limits.pair(material, structure.materials[element]),
                axis,
            );
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
        // An element with a link beyond its bounds stays, because its allowed range is empty.
        if count == 0 || lowest > 0 || highest < 0 {
            return false;
        }
        let asked = mean(sum, count);
        let by = if asked.abs() < structure.limits.k(material) { 0 } else { asked.clamp(lowest, highest) };
        self.x[place] += by;
        by != 0
    }
}

/// Upper limit of the sum. It is more than six neighbors within their bounds can ask for, and twice
/// its value fits into 32 bits.
const MOST_ASKED: u32 = 1 << 30;

/// The integer nearest to a mean; of two equally near ones, the one nearer to 0.
fn mean(sum: i32, count: u32) -> i32 {
    let twice = 2 * sum.unsigned_abs().min(MOST_ASKED);
    // The compiler turns divisions by constants into multiplications.
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
