//! SIMD levels: the relaxation of a plane, compiled once for each instruction set.
//!
//! This is the only file of the crate with unsafe code. A function that is compiled for an
//! instruction set must not run on a processor that lacks it. Here a [`SimdLevel`] is the proof
//! that the processor has the instructions: it is only created after a check of the processor.
#![allow(unsafe_code)]

use crate::plane::Plane;

/// An instruction set that this processor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SimdLevel(InstructionSet);

/// The instruction sets that the relaxation is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InstructionSet {
    /// The instructions that every processor of the architecture has.
    Baseline,
    /// Eight coordinates at once.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Sixteen coordinates at once.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl SimdLevel {
    /// The level with the widest vectors.
    pub(crate) fn best() -> Self {
        Self::available().into_iter().next_back().unwrap_or(Self(InstructionSet::Baseline))
    }

    /// All levels of this processor, the narrowest first.
    pub(crate) fn available() -> Vec<Self> {
        let mut levels = vec![Self(InstructionSet::Baseline)];
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx2") {
                levels.push(Self(InstructionSet::Avx2));
            }
            let has_avx512 = std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512bw")
                && std::arch::is_x86_feature_detected!("avx512dq")
                && std::arch::is_x86_feature_detected!("avx512vl");
            if has_avx512 && levels.len() > 1 {
                levels.push(Self(InstructionSet::Avx512));
            }
        }
        levels
    }

    /// Runs [`Plane::relax`] with the instructions of this level.
    pub(crate) fn relax(self, plane: &mut Plane<'_>, odd: usize) -> u64 {
        match self.0 {
            InstructionSet::Baseline => plane.relax(odd),
            // SAFETY: `available` creates this level only if the processor has AVX2.
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => unsafe { with_avx2(plane, odd) },
            // SAFETY: `available` creates this level only if the processor has AVX2 and these
            // parts of AVX-512.
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => unsafe { with_avx512(plane, odd) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2(plane: &mut Plane<'_>, odd: usize) -> u64 {
    plane.relax(odd)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
fn with_avx512(plane: &mut Plane<'_>, odd: usize) -> u64 {
    plane.relax(odd)
}

#[cfg(test)]
mod tests {
    //! These tests are small enough for Miri: `cargo miri test -p cutis-chainmail --lib simd::`.
    //! Miri has only the instruction sets that the compiler enables. To run every unsafe block, set
    //! `RUSTFLAGS="-Ctarget-feature=+avx2,+avx512f,+avx512bw,+avx512dq,+avx512vl"`.

    use super::SimdLevel;
    use crate::limits::{Bounds, Limits};
    use crate::links::Links;
    use crate::neighborhood::{IMMOBILE, NeighborhoodClass, NeighborhoodClasses, UNCLASSIFIED};
    use crate::plane::Plane;
    use crate::units::UNITS_PER_STEP;
    use crate::{Material, chain::Structure};

    const SHAPE: [usize; 3] = [12, 3, 3];

    /// Moves of the middle plane of a block of 12 × 3 × 3 elements by one level, and the x
    /// coordinates after them. The inner elements of the middle row have one class.
    fn relaxed(level: SimdLevel, odd: usize) -> (u64, Vec<i32>) {
        let [nx, ny, nz] = SHAPE;
        let count = nx * ny * nz;
        let material = Material::isotropic(0.5, 2.0, 0.5, 0.0);
        let structure = Structure {
            links: Links::new(SHAPE, |_| true).unwrap(),
            materials: vec![0; count],
            limits: Limits::new(&[material], [1.0; 3]),
        };
        let link = |coordinate, axis| [structure.limits.of(coordinate, 0, axis); 2];
        let bounds: [[[Bounds; 2]; 3]; 3] = [0, 1, 2].map(|c| [0, 1, 2].map(|axis| link(c, axis)));
        let mut class_of = vec![UNCLASSIFIED; count];
        class_of[nx * ny + nx + 1..nx * ny + 2 * nx - 1].fill(0);
        class_of[nx * ny + 2 * nx] = IMMOBILE;
        let classes = NeighborhoodClasses { class_of, classes: vec![NeighborhoodClass { bounds, k: 1 }] };
        // Within all bounds, but no element is at the mean of its neighbors.
        let at =
            |element: usize| (element % nx) as i32 * UNITS_PER_STEP + (element as i32 * 7919 % 97 - 48) * 150;
        let mut x: Vec<i32> = (0..count).map(at).collect();
        let (below, rest) = x.split_at_mut(nx * ny);
        let (middle, above) = rest.split_at_mut(nx * ny);
        let mut moved = vec![false; ny];
        let mut plane = Plane {
            structure: &structure,
            classes: &classes,
            coordinate: 0,
            k: 1,
            x: middle,
            below,
            above,
            changed: &[true; 9],
            moved: &mut moved,
        };
        let moves = level.relax(&mut plane, odd);
        (moves, x)
    }

    #[test]
    fn every_level_moves_a_small_plane_to_the_same_bits() {
        for odd in [0, 1] {
            let levels = SimdLevel::available();
            let expected = relaxed(levels[0], odd);
            // Half of 36 elements may move, except the immobile one.
            assert!((12..=18).contains(&expected.0), "{} moves", expected.0);
            for level in levels {
                assert_eq!(relaxed(level, odd), expected, "{level:?}");
            }
        }
    }

    #[test]
    fn the_best_level_is_the_last_available_one() {
        assert_eq!(SimdLevel::available().last(), Some(&SimdLevel::best()));
    }
}
