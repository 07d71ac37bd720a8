//! The widest vector unit that the processor has: planes are relaxed by the same source, compiled for each.
//!
//! The only unsafe code of the crate. Instructions that a processor lacks must not run on it; here they run only with a
//! [`Width`] that says so, and one is only made where the processor was asked.
#![allow(unsafe_code)]

use crate::plane::Plane;

/// A vector unit that this processor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Width(Unit);

/// The vector units that planes are relaxed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    /// What every processor of the architecture has.
    Baseline,
    /// Eight coordinates at once.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Sixteen.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Width {
    /// The widest.
    pub(crate) fn widest() -> Self {
        Self::all().into_iter().next_back().unwrap_or(Self(Unit::Baseline))
    }

    /// All that this processor has, the narrowest first.
    pub(crate) fn all() -> Vec<Self> {
        let mut all = vec![Self(Unit::Baseline)];
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx2") {
                all.push(Self(Unit::Avx2));
            }
            let has = std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512bw")
                && std::arch::is_x86_feature_detected!("avx512dq")
                && std::arch::is_x86_feature_detected!("avx512vl");
            if has && all.len() > 1 {
                all.push(Self(Unit::Avx512));
            }
        }
        all
    }

    /// As [`Plane::relax`].
    pub(crate) fn relax(self, plane: &mut Plane<'_>, odd: usize) -> u64 {
        match self.0 {
            Unit::Baseline => plane.relax(odd),
            // SAFETY: `all` made this one where the processor has AVX2.
            #[cfg(target_arch = "x86_64")]
            Unit::Avx2 => unsafe { with_avx2(plane, odd) },
            // SAFETY: `all` made this one where the processor has AVX2 and these parts of AVX-512.
            #[cfg(target_arch = "x86_64")]
            Unit::Avx512 => unsafe { with_avx512(plane, odd) },
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
    use super::Width;
    use crate::census::MIXED;
    use crate::{Chain, Drag, Material, Order};

    /// Rows longer and shorter than a block, of two materials in clumps, pulled at many elements.
    fn kneaded(shape: [usize; 3]) -> Chain {
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
    fn side_by_side_and_one_by_one_give_the_same_bits() {
        for shape in [[150, 9, 8], [64, 4, 5], [13, 12, 11]] {
            let mut chain = kneaded(shape);
            chain.relax(0, &[]);
            let links: Vec<_> = (0..40).map(|n| chain.element([shape[0] / 2, 2, 2]) - n).collect();
            links.windows(2).step_by(2).for_each(|pair| {
                chain.cut_links(&[[pair[1], pair[0]]]);
            });
            let mut alone = chain.clone();
            let some = alone.census.of.iter_mut().filter(|state| **state < MIXED);
            assert!(some.map(|state| *state = MIXED).count() > 50 && chain.census.kinds.len() > 10);
            let done = chain.relax(20, &[3]);
            assert!(done.moves > 1000 && done == alone.relax(20, &[3]), "{done:?}");
            assert!(chain.positions == alone.positions);
        }
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        for shape in [[150, 9, 8], [64, 4, 5], [13, 12, 11], [1, 30, 30]] {
            let chain = kneaded(shape);
            let relaxed = |width| {
                let mut chain = Chain { width, ..chain.clone() };
                let done = chain.relax(20, &[3]);
                (done, chain.positions)
            };
            let narrow = relaxed(Width::all()[0]);
            assert!(narrow.0.moves > 1000, "{:?}", narrow.0);
            assert!(Width::all().into_iter().all(|width| relaxed(width) == narrow));
            assert_ne!(relaxed(Width::widest()).1, chain.positions);
        }
    }
}
