//! Tensions and moduli of the skin of random planes, and their distribution.

use cutis_test_kit::Random;
use nalgebra::{Matrix2, Vector3};
use serde::Serialize;

use super::forms::Form;
use super::skin::{PlaneSkin, area_vector};
use crate::kit::Failure;

/// Strain for the modulus.
const STRAIN: f64 = 1e-4;

/// A form on the skin of one plane. All figures are relative to the wanted ones.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Patch {
    /// The smaller and the larger of the two principal tensions in the plane.
    pub tension: [f64; 2],
    /// The moduli along and across.
    pub modulus: [f64; 2],
}

impl Patch {
    /// Measures a form on a skin.
    pub fn of(form: Form, skin: &PlaneSkin) -> Self {
        let pieces = form.pieces(skin);
        let axes = [skin.along, skin.across()];
        let tension = |a: usize, b: usize, strain: f64| {
            let share = |[a, b]: [&Vector3<f64>; 2]| {
                pieces.iter().map(|piece| piece.virial(a, b, a, strain)).sum::<f64>() / skin.area
            };
            share([&axes[a], &axes[b]])
        };
        let wanted = form.tension();
        let relative = Matrix2::from_fn(|a, b| tension(a, b, 0.0) / (wanted[a] * wanted[b]).sqrt());
        let principal = ((relative + relative.transpose()) * 0.5).symmetric_eigenvalues();
        let modulus =
            |a: usize| (tension(a, a, STRAIN) - tension(a, a, -STRAIN)) / (2.0 * STRAIN * form.modulus()[a]);
        Self { tension: [principal.min(), principal.max()], modulus: [modulus(0), modulus(1)] }
    }

    /// The larger over the smaller principal tension.
    pub fn ratio(&self) -> f64 {
        self.tension[1] / self.tension[0]
    }
}

/// The staircase of one plane, as shares of the area of the plane.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Staircase {
    /// Area of the triangles.
    pub area: f64,
    /// Area of the triangles as seen along the normal.
    pub projected: f64,
    /// Area of the triangles that face inwards.
    pub inwards: f64,
}

impl Staircase {
    /// Measures the staircase of a skin.
    pub fn of(skin: &PlaneSkin) -> Self {
        let facing = |x: &_| area_vector(x).dot(&skin.normal);
        Self {
            area: skin.mean(|x| area_vector(x).norm()),
            projected: skin.mean(facing),
            inwards: skin.mean(|x| (-facing(x)).max(0.0)),
        }
    }
}

/// The skins of `count` random planes, the same in every run.
///
/// # Errors
/// A lattice is refused.
pub fn skins(count: usize) -> Result<Vec<PlaneSkin>, Failure> {
    let mut random = Random::new(5);
    (0..count).map(|_| PlaneSkin::random(&mut random)).collect()
}

/// Mean and quantiles of many values.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Spread {
    /// The mean.
    pub mean: f64,
    /// The value below which 5 % of the values are.
    pub low: f64,
    /// The value below which 95 % of the values are.
    pub high: f64,
    /// The largest value.
    pub most: f64,
}

impl Spread {
    /// The spread of the values, or `None` if there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get(((values.len() as f64 - 1.0) * share).round() as usize).copied();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Some(Self { mean, low: at(0.05)?, high: at(0.95)?, most: at(1.0)? })
    }
}

/// A form on the skins of all planes.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Name of the form.
    pub form: &'static str,
    /// Principal tensions over the wanted ones.
    pub tension: Spread,
    /// Larger over smaller principal tension.
    pub ratio: Spread,
    /// Moduli over the wanted ones.
    pub modulus: Spread,
    /// Largest difference of a principal tension from the wanted one.
    pub worst: f64,
}

impl Measured {
    /// Measures a form on many skins. `None` if there are none.
    pub fn of(form: Form, skins: &[PlaneSkin]) -> Option<Self> {
        let patches: Vec<Patch> = skins.iter().map(|skin| Patch::of(form, skin)).collect();
        let tensions = || patches.iter().flat_map(|patch| patch.tension);
        Some(Self {
            form: form.name(),
            tension: Spread::of(tensions())?,
            ratio: Spread::of(patches.iter().map(Patch::ratio))?,
            modulus: Spread::of(patches.iter().flat_map(|patch| patch.modulus))?,
            worst: tensions().map(|t| (t - 1.0).abs()).fold(0.0, f64::max),
        })
    }
}
