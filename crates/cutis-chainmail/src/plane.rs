//! Relaxation of the elements of a plane: one by one, and eight at a time where they and all around them are of one material.

use crate::chain::{Body, NO_MATERIAL};
use crate::limits::Bounds;
use crate::units::UNITS_PER_STEP;

/// Elements that are relaxed side by side.
const LANES: usize = 8;
/// From the first of them to the last, which are two apart.
const SPAN: usize = 2 * LANES - 1;

/// A coordinate of the elements of a plane, and of the planes beside it.
pub(crate) struct Plane<'a> {
    pub(crate) body: &'a Body,
    pub(crate) uniform: &'a [u8],
    pub(crate) coordinate: usize,
    pub(crate) k: usize,
    pub(crate) x: &'a mut [i32],
    pub(crate) below: &'a [i32],
    pub(crate) above: &'a [i32],
}

/// The material of elements that are free, linked with six neighbours, and of the same material as these; [`NO_MATERIAL`] for others.
pub(crate) fn uniform(body: &Body) -> Vec<u8> {
    let of = |element: u32| {
        let material = body.materials[element as usize];
        let alike = |neighbour: u32| body.materials[neighbour as usize] == material;
        let same = material != NO_MATERIAL
            && !body.links.is_held(element)
            && body.links.of(element).filter(|n| alike(n.element)).count() == 6;
        if same { material } else { NO_MATERIAL }
    };
    (0..body.materials.len() as u32).map(of).collect()
}

impl Plane<'_> {
    /// Moves the elements whose `i + j + k` is even, or odd; how many moved.
    pub(crate) fn relax(&mut self, odd: usize) -> u64 {
        let [nx, ny, _] = self.body.links.shape();
        let mut moves = 0;
        for j in 0..ny {
            let mut i = (odd + j + self.k) % 2;
            while i < nx {
                let place = j * nx + i;
                if i + SPAN <= nx
                    && let Some(material) = self.alike(place)
                {
                    moves += self.relax_eight(place, material);
                    i += 2 * LANES;
                } else {
                    moves += u64::from(self.relax_one(place));
                    i += 2;
                }
            }
        }
        moves
    }

    /// The material of eight elements from here, if it is the only one in and around them.
    fn alike(&self, place: usize) -> Option<u8> {
        let first = self.k * self.x.len() + place;
        let eight = &self.uniform[first..first + SPAN];
        let material = eight[0];
        (material != NO_MATERIAL && eight.iter().step_by(2).all(|&other| other == material))
            .then_some(material)
    }

    #[inline]
    fn relax_eight(&mut self, place: usize, material: u8) -> u64 {
        let limits = &self.body.limits;
        let (pair, k) = (limits.pair(material, material), limits.k(material));
        let nx = self.body.links.shape()[0];
        let at = |x: &[i32], place: usize| -> [i32; LANES] {
            let x = &x[place..place + SPAN];
            std::array::from_fn(|lane| x[2 * lane])
        };
        let x = at(self.x, place);
        let pairs = [
            [at(self.x, place - 1), at(self.x, place + 1)],
            [at(self.x, place - nx), at(self.x, place + nx)],
            [at(self.below, place), at(self.above, place)],
        ];
        // The rest lengths before and after cancel in the sum.
        let (mut sum, mut lowest, mut highest) = ([0_i32; LANES], [i32::MIN; LANES], [i32::MAX; LANES]);
        for (axis, [before, after]) in pairs.iter().enumerate() {
            let Bounds { lo, hi } = limits.of(self.coordinate, pair, axis);
            for lane in 0..LANES {
                let (before, after) = (before[lane] - x[lane], after[lane] - x[lane]);
                sum[lane] = sum[lane].wrapping_add(before).wrapping_add(after);
                lowest[lane] = lowest[lane].max(before + lo).max(after - hi);
                highest[lane] = highest[lane].min(before + hi).min(after - lo);
            }
        }
        let by: [i32; LANES] = std::array::from_fn(|lane| {
            let size = (2 * sum[lane].unsigned_abs().min(MOST_ASKED) + 5) / 12;
            let asked = if sum[lane] < 0 { -(size as i32) } else { size as i32 };
            let stays = (size as i32) < k || lowest[lane] > 0 || highest[lane] < 0;
            if stays { 0 } else { asked.min(highest[lane]).max(lowest[lane]) }
        });
        let to = &mut self.x[place..place + SPAN];
        (0..LANES).for_each(|lane| to[2 * lane] += by[lane]);
        by.iter().map(|&by| u64::from(by != 0)).sum()
    }

    /// Whether the element moved.
    fn relax_one(&mut self, place: usize) -> bool {
        let body = self.body;
        let first = (self.k * self.x.len()) as u32;
        let element = first + place as u32;
        let material = body.materials[element as usize];
        if material == NO_MATERIAL || body.links.is_held(element) {
            return false;
        }
        let x = self.x[place];
        let (mut count, mut sum, mut lowest, mut highest) = (0, 0_i32, i32::MIN, i32::MAX);
        for neighbour in body.links.of(element) {
            let there = match (neighbour.axis, neighbour.next) {
                (2, false) => self.below[place],
                (2, true) => self.above[place],
                _ => self.x[(neighbour.element - first) as usize],
            };
            let apart = there - x;
            let Bounds { lo, hi } = body.bounds(element, neighbour, self.coordinate);
            let rest = if neighbour.axis == self.coordinate { UNITS_PER_STEP } else { 0 };
            let (asked, from, to) = if neighbour.next {
                (apart - rest, apart - hi, apart - lo)
            } else {
                (apart + rest, apart + lo, apart + hi)
            };
            count += 1;
            sum = sum.wrapping_add(asked);
            (lowest, highest) = (lowest.max(from), highest.min(to));
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

/// More than six neighbours within their bounds can ask for together, and few enough to be doubled in 32 bits.
const MOST_ASKED: u32 = 1 << 30;

/// The nearest integer to a mean, of two that are equally near the one nearer to 0.
fn mean(sum: i32, count: u32) -> i32 {
    let size = (2 * sum.unsigned_abs().min(MOST_ASKED) + count - 1) / (2 * count);
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
