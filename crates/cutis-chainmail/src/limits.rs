//! The bounds of links between all pairs of materials, in units.

use crate::material::Material;
use crate::units::{UNITS_PER_STEP, from_steps};

/// Bounds on the difference `after − before` of a coordinate along a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bounds {
    pub(crate) lo: i32,
    pub(crate) hi: i32,
}

/// Bounds by coordinate, pair of materials and axis.
#[derive(Clone, Debug)]
pub(crate) struct Limits {
    bounds: [Vec<[Bounds; 3]>; 3],
    /// `k` by material in units; at least 1.
    k: Vec<i32>,
    materials: usize,
}

impl Limits {
    /// Computes the bounds between all pairs of validated `materials`.
    pub(crate) fn new(materials: &[Material], spacing_mm: [f64; 3]) -> Self {
        let pairs = || materials.iter().flat_map(|a| materials.iter().map(move |b| (a, b)));
        let bounds = [0, 1, 2].map(|coordinate| {
            pairs().map(|(a, b)| [0, 1, 2].map(|axis| between(a, b, axis, coordinate, spacing_mm))).collect()
        });
        let units = |steps: f64| from_steps(steps).unwrap_or(i32::MAX).max(1);
        Self { bounds, k: materials.iter().map(|m| units(m.k)).collect(), materials: materials.len() }
    }

    /// Bounds of a coordinate for links along an axis. See [`Limits::pair`] for the number of a
    /// pair.
    #[inline]
    pub(crate) fn of(&self, coordinate: usize, pair: usize, axis: usize) -> Bounds {
        self.bounds[coordinate][pair][axis]
    }

    /// All bounds of a coordinate, as `[lo, hi]` by pair and axis.
    #[cfg(feature = "gpu")]
    pub(crate) fn table(&self, coordinate: usize) -> Vec<[i32; 2]> {
        self.bounds[coordinate].iter().flatten().map(|bounds| [bounds.lo, bounds.hi]).collect()
    }

    /// `k` of every material, in units.
    #[cfg(feature = "gpu")]
    pub(crate) fn all_k(&self) -> &[i32] {
        &self.k
    }

    /// Number of a pair of materials.
    #[inline]
    pub(crate) fn pair(&self, a: u8, b: u8) -> usize {
        usize::from(a) * self.materials + usize::from(b)
    }

    /// Smallest move that relaxation makes with a material, in units.
    #[inline]
    pub(crate) fn k(&self, material: u8) -> i32 {
        self.k[usize::from(material)]
    }
}

/// Bounds of a link: half from each end, rounded inwards. The state at rest satisfies them, because
/// a rest length is a whole number of units.
fn between(a: &Material, b: &Material, axis: usize, coordinate: usize, spacing_mm: [f64; 3]) -> Bounds {
    let one = f64::from(UNITS_PER_STEP);
    if axis == coordinate {
        let lo = 0.5 * (a.shortest[axis] + b.shortest[axis]);
        let hi = 0.5 * (a.longest[axis] + b.longest[axis]);
        Bounds { lo: (lo * one).ceil() as i32, hi: (hi * one).floor() as i32 }
    } else {
        // The quotient may overflow, and infinity times 0 is not a number.
        let steps = (spacing_mm[axis] / spacing_mm[coordinate]).min(f64::from(MOST_SHEAR));
        let shear = 0.5 * (a.shear[axis] + b.shear[axis]) * steps;
        let most = (shear * one).floor().min(f64::from(MOST_SHEAR)) as i32;
        Bounds { lo: -most, hi: most }
    }
}

/// Largest shear in units. It does not restrict any grid, and keeps sums within 32 bits.
const MOST_SHEAR: i32 = 1 << 26;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_takes_half_of_its_limits_from_each_end() {
        let soft = Material { shear: [0.5, 0.25, 0.125], ..Material::isotropic(0.5, 2.0, 0.0, 0.0) };
        let limits = Limits::new(&[soft, Material::RIGID], [1.0, 2.0, 4.0]);
        let of = |a, b, axis, coordinate| {
            let Bounds { lo, hi } = limits.of(coordinate, limits.pair(a, b), axis);
            [lo, hi].map(|units| f64::from(units) / f64::from(UNITS_PER_STEP))
        };
        assert_eq!(of(0, 0, 0, 0), [0.5, 2.0]);
        assert_eq!((of(0, 1, 1, 1), of(1, 0, 1, 1)), ([0.75, 1.5], [0.75, 1.5]));
        assert_eq!((of(1, 1, 2, 2), of(1, 1, 2, 0)), ([1.0, 1.0], [0.0, 0.0]));
        // A link along y is 2 mm long; a quarter of that is half a step along x.
        assert_eq!((of(0, 0, 1, 0), of(0, 1, 1, 0)), ([-0.5, 0.5], [-0.25, 0.25]));
        assert_eq!([0, 1].map(|material| limits.k(material)), [1, 1]);
    }

    #[test]
    fn rigid_materials_do_not_shear_at_any_spacing() {
        for spacing_mm in [[1e300, 1e-300, 1.0], [f64::MIN_POSITIVE, 1.0, f64::MAX]] {
            let limits =
                Limits::new(&[Material::RIGID, Material { shear: [1.0; 3], ..Material::RIGID }], spacing_mm);
            for (axis, coordinate) in [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)] {
                assert_eq!(limits.of(coordinate, 0, axis), Bounds { lo: 0, hi: 0 });
                let soft = limits.of(coordinate, limits.pair(1, 1), axis);
                assert!(soft.lo == -soft.hi && (0..=MOST_SHEAR).contains(&soft.hi), "{soft:?}");
            }
        }
    }

    /// With equal spacings the spacing cancels without rounding.
    #[test]
    fn shear_does_not_depend_on_the_step_of_an_even_grid() {
        let lean = Material { shear: [1.5; 3], ..Material::isotropic(0.5, 2.0, 0.0, 0.0) };
        for n in 1..2000 {
            let limits = Limits::new(&[lean], [f64::from(n) / 337.0; 3]);
            assert_eq!(limits.of(0, 0, 1).hi, UNITS_PER_STEP + UNITS_PER_STEP / 2, "{n}");
        }
    }

    /// One unit more would exceed what the material allows.
    #[test]
    fn limits_are_rounded_inwards() {
        let odd = Material { shear: [0.1, 0.1, 0.1], ..Material::isotropic(0.7, 1.1, 0.0, 0.0) };
        let limits = Limits::new(&[odd], [1.0; 3]);
        assert_eq!(limits.of(0, 0, 0), Bounds { lo: 45_876, hi: 72_089 }, "0.7 and 1.1 of 65536");
        assert_eq!(limits.of(1, 0, 0), Bounds { lo: -6_553, hi: 6_553 });
    }
}
