//! Elastic relaxation: each element moves towards the mean of the positions that its neighbors ask
//! for.
//!
//! A neighbor asks for the position that is at rest relative to itself. At the mean of these
//! positions the element has its least energy. The element goes there as far as the bounds of its
//! links allow, unless the mean is nearer than its material's `k` in that coordinate. Elements
//! whose `i + j + k` is even have only odd neighbors, so that all elements of one color can move at
//! once. A sweep moves the even elements, then the odd ones, with the same bits on any number of
//! threads.
//!
//! The energy of an element is a parabola, and a move approaches its minimum without passing it.
//! Every move therefore lowers the energy. Coordinates are integers, so that the energy cannot
//! decrease without end, and relaxation stops.
//!
//! An element moves again only if a neighbor has moved since its last visit. Each row records
//! whether it changed, and rows without changes around them are skipped. Relaxation after a local
//! drag therefore costs as much as the part that moves.

use rayon::prelude::*;

use crate::chain::Chain;
use crate::neighborhood::{IMMOBILE, NeighborhoodClasses};
use crate::plane::Plane;

/// The effect of a relaxation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Relaxation {
    /// Number of sweeps over all elements.
    pub sweeps: u32,
    /// Number of times that a coordinate of an element changed.
    pub moves: u64,
    /// True if nothing moves any more.
    pub settled: bool,
}

impl Chain {
    /// Sweeps until nothing moves, or `most` times. Fixed elements and the elements in `held` stay.
    ///
    /// The first call also finds the classes of elements that relax together. Call it with `most` =
    /// 0 to do this work before the first frame.
    pub fn relax(&mut self, most: u32, held: &[u32]) -> Relaxation {
        let held: Vec<u32> = held.iter().copied().filter(|&element| self.has_element(element)).collect();
        let mut classes = std::mem::take(&mut self.classes);
        if classes.class_of.is_empty() {
            classes = NeighborhoodClasses::new(&self.structure);
        }
        let free: Vec<u8> = held.iter().map(|&element| classes.class_of[element as usize]).collect();
        held.iter().for_each(|&element| classes.class_of[element as usize] = IMMOBILE);
        let mut done = Relaxation::default();
        let [_, ny, nz] = self.shape();
        let rows = || [0, 1, 2].map(|_| vec![false; ny * nz]);
        let (mut even, mut odd) = (rows(), [0, 1, 2].map(|_| self.changed.clone()));
        while !done.settled && done.sweeps < most {
            let mut moves = self.sweep_half(0, &classes, &odd, &mut even);
            if done.sweeps == 0 {
                let before = even.iter_mut().map(|rows| rows.iter_mut().zip(&self.changed));
                before.flatten().for_each(|(row, changed)| *row |= changed);
            }
            moves += self.sweep_half(1, &classes, &even, &mut odd);
            done.sweeps += 1;
            done.moves += moves;
            done.settled = moves == 0;
        }
        if done.sweeps > 0 {
            let moved = |row: usize| odd.iter().any(|rows| rows[row]);
            self.changed = (0..ny * nz).map(moved).collect();
        }
        held.iter()
            .zip(&free)
            .rev()
            .for_each(|(&element, &state)| classes.class_of[element as usize] = state);
        self.mark_held(&held);
        self.classes = classes;
        done
    }

    /// Marks the rows of held elements as changed: when the elements are released, they may move.
    pub(crate) fn mark_held(&mut self, held: &[u32]) {
        held.iter().for_each(|&element| self.mark_changed(element));
    }

    /// Moves the elements of one color. The elements of every second plane move first, then those
    /// of the planes between. `changed` and `moved` are by coordinate and row of the grid.
    fn sweep_half(
        &mut self,
        odd: usize,
        classes: &NeighborhoodClasses,
        changed: &[Vec<bool>; 3],
        moved: &mut [Vec<bool>; 3],
    ) -> u64 {
        let Self { structure, positions, simd, .. } = self;
        let [nx, ny, nz] = structure.links.shape();
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
                        planes.push(Plane {
                            structure,
                            classes,
                            coordinate,
                            k,
                            x,
                            below,
                            above,
                            changed,
                            moved,
                        });
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
                planes.into_par_iter().map(|mut plane| simd.relax(&mut plane, odd)).collect();
            moves += moved.iter().sum::<u64>();
        }
        moves
    }
}

#[cfg(test)]
mod tests {
    use crate::neighborhood::UNCLASSIFIED;
    use crate::simd::SimdLevel;
    use crate::{Chain, Drag, Material, Order};

    /// A body with rows longer and shorter than a block, two clustered materials and 40 drags.
    fn dragged(shape: [usize; 3]) -> Chain {
        let [soft, stiff] = [1.5, 1.25].map(|most| Material::isotropic(0.5, most, most - 1.0, 0.01));
        let random = |n: u32| n.wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(0x9E37_79B9) >> 8;
        let count: usize = shape.iter().product();
        let material = |n: usize| u8::from(random((n / 37) as u32) % 3 == 0);
        let mut chain =
            Chain::new(shape, [1.0; 3], &[soft, stiff], (0..count).map(material).collect()).unwrap();
        chain.fix(&[chain.element([shape[0] - 1, 0, 0])]).unwrap();
        for n in 0..40 {
            let element = random(n) % count as u32;
            let at = chain.position(element);
            let by = |axis: u32| f64::from(random(3 * n + axis) % 300) / 100.0 - 1.5;
            let to = [at[0] + by(0), at[1] + by(1), at[2] + by(2)];
            if !chain.is_fixed(element) {
                chain.drag(&[Drag { element, to }], Order::Slabs).unwrap();
            }
        }
        chain
    }

    #[test]
    fn classes_and_single_elements_give_the_same_bits() {
        for shape in [[150, 9, 8], [64, 4, 5], [13, 12, 11]] {
            let mut chain = dragged(shape);
            chain.relax(0, &[]);
            let row: Vec<_> = (0..40).map(|n| chain.element([shape[0] / 2, 2, 2]) - n).collect();
            row.windows(2).step_by(2).for_each(|pair| {
                chain.cut_links(&[[pair[1], pair[0]]]);
            });
            let mut single = chain.clone();
            let classified = single.classes.class_of.iter_mut().filter(|class| **class < UNCLASSIFIED);
            assert!(classified.map(|class| *class = UNCLASSIFIED).count() > 50);
            assert!(chain.classes.classes.len() > 10);
            let report = chain.relax(20, &[3]);
            assert!(report.moves > 1000 && report == single.relax(20, &[3]), "{report:?}");
            assert!(chain.positions == single.positions);
        }
    }

    #[test]
    fn every_simd_level_gives_the_same_bits() {
        for shape in [[150, 9, 8], [64, 4, 5], [13, 12, 11], [1, 30, 30]] {
            let chain = dragged(shape);
            let relaxed = |simd| {
                let mut chain = Chain { simd, ..chain.clone() };
                let report = chain.relax(20, &[3]);
                (report, chain.positions)
            };
            let baseline = relaxed(SimdLevel::available()[0]);
            assert!(baseline.0.moves > 1000, "{:?}", baseline.0);
            assert!(SimdLevel::available().into_iter().all(|level| relaxed(level) == baseline));
            assert_ne!(relaxed(SimdLevel::best()).1, chain.positions);
        }
    }
}
