//! The material of a strip of skin: its directions, its elastic law, and its compliance.

use nalgebra::{Point3, Vector3};

use crate::material::{MaterialError, check_not_negative, check_positive, skin_strip_compliance};
use crate::strip::Weights;

/// The elastic law of a strip of skin.
///
/// `τ` is the tension in the scan and `T` the modulus. A small strain `ε` of the skin along the
/// strip changes the tension to `τ + Tε`, a larger one to about `τ + T(ε + βε²/2)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinStripLaw {
    /// `τ`: force per width along the strip in the scan, in N/m; 0 or more, and below the modulus.
    pub tension_n_per_m: f64,
    /// `T`: growth of the tension per strain, in N/m, above 0.
    pub modulus_n_per_m: f64,
    /// `β`: growth of the modulus per strain beyond the scan, without unit; 0 or more. It gives the
    /// J-shaped curve of skin.
    pub stiffening: f64,
    /// `κ`: stiffness below the rest length over stiffness above it, from 0 to 1. With 0 the skin
    /// wrinkles without resistance. With 1 it resists compression as it resists tension.
    pub compression: f64,
}

impl SkinStripLaw {
    /// Checks the values.
    ///
    /// # Errors
    /// - [`MaterialError::Negative`] for a tension or a stiffening that is negative or not finite;
    /// - [`MaterialError::NotPositive`] for a modulus that is not finite or not above 0;
    /// - [`MaterialError::CompressionOutOfRange`] unless the compression is from 0 to 1;
    /// - [`MaterialError::TensionTooLarge`] unless the tension is below the modulus.
    pub fn check(&self) -> Result<(), MaterialError> {
        let Self { tension_n_per_m, modulus_n_per_m, stiffening, compression } = *self;
        check_not_negative("tension of a skin strip", "N/m", tension_n_per_m)?;
        check_positive("modulus of a skin strip", "N/m", modulus_n_per_m)?;
        check_not_negative("stiffening of a skin strip", "1", stiffening)?;
        if !(0.0..=1.0).contains(&compression) {
            return Err(MaterialError::CompressionOutOfRange { value: compression });
        }
        if tension_n_per_m >= modulus_n_per_m {
            return Err(MaterialError::TensionTooLarge { tension_n_per_m, modulus_n_per_m });
        }
        Ok(())
    }
}

/// The material of a strip on one triangle: the outward normal of the smooth skin, the direction of
/// the strip in the skin, and the elastic law.
///
/// ```
/// use cutis_constraints::{SkinStripLaw, SkinStripMaterial};
/// let law =
///     SkinStripLaw { tension_n_per_m: 8.0, modulus_n_per_m: 50.0, stiffening: 0.0, compression: 0.0 };
/// let along = SkinStripMaterial::new([0.0, 0.0, 2.0], [3.0, 0.0, 0.1], law)?;
/// assert_eq!(along.direction().as_slice(), [1.0, 0.0, 0.0]);
/// assert!(SkinStripMaterial::new([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], law).is_err());
/// # Ok::<(), cutis_constraints::MaterialError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinStripMaterial {
    normal: Vector3<f64>,
    direction: Vector3<f64>,
    law: SkinStripLaw,
}

/// The measures of a strip on a triangle in the scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinStripShape {
    /// `A_p`: area of the triangle seen along the normal, in m², and at least
    /// [`LEAST_FACING`](SkinStripMaterial::LEAST_FACING) times its area.
    pub projected_area: f64,
    /// `ℓ`: length in m of the strip in the scan.
    pub length: f64,
}

impl SkinStripMaterial {
    /// The least share of a triangle's area that counts as seen along the normal. The stiffness of
    /// a strip grows as the inverse of the projected area. A facet that is closer to edge-on, or
    /// that faces inwards, has the stiffness of this share.
    pub const LEAST_FACING: f64 = 0.05;

    /// The least extent across a strip over the root of the triangle's area.
    const LEAST_WIDTH: f64 = 1e-3;

    /// Angle in rad between direction and normal below which the direction counts as the normal.
    const PARALLEL: f64 = 1e-6;

    /// Returns the material of a strip. The vectors may have any length. The part of the direction
    /// along the normal is removed.
    ///
    /// # Errors
    /// [`MaterialError::NotADirection`] for a vector that is zero or not finite,
    /// [`MaterialError::AlongNormal`] for a direction along the normal, and the errors of
    /// [`SkinStripLaw::check`].
    pub fn new(normal: [f64; 3], direction: [f64; 3], law: SkinStripLaw) -> Result<Self, MaterialError> {
        law.check()?;
        let unit_normal = unit("normal of the skin", normal)?;
        let along = unit("direction of a skin strip", direction)?;
        let tangent = along - unit_normal * unit_normal.dot(&along);
        if tangent.norm() < Self::PARALLEL {
            return Err(MaterialError::AlongNormal { direction, normal });
        }
        Ok(Self { normal: unit_normal, direction: tangent.normalize(), law })
    }

    /// The unit normal.
    #[must_use]
    pub fn normal(&self) -> &Vector3<f64> {
        &self.normal
    }

    /// The unit direction, perpendicular to the normal.
    #[must_use]
    pub fn direction(&self) -> &Vector3<f64> {
        &self.direction
    }

    /// The elastic law.
    #[must_use]
    pub fn law(&self) -> &SkinStripLaw {
        &self.law
    }

    /// Returns the measures of this strip on the triangle `x`, in the scan and in meters.
    ///
    /// # Errors
    /// [`MaterialError::NoWidth`] if the triangle has no extent across the strip: it is seen from
    /// its edge, and the edge runs along the strip. Such a strip has no force, and a caller may
    /// omit it. [`MaterialError::NotPositive`] if the area is zero or not finite.
    pub fn shape(&self, x: &[Point3<f64>; 3]) -> Result<SkinStripShape, MaterialError> {
        let area = 0.5 * (x[1] - x[0]).cross(&(x[2] - x[0])).norm();
        check_positive("area of a skin triangle", "m²", area)?;
        let Weights { width, twice_area, .. } = Weights::of(x, self);
        if width < Self::LEAST_WIDTH * area.sqrt() {
            return Err(MaterialError::NoWidth { width });
        }
        Ok(SkinStripShape { projected_area: 0.5 * twice_area, length: twice_area / width })
    }

    /// Returns the compliance in m/N of a strip on the triangle `x`, in the scan and in meters. All
    /// kinds of strips have the same compliance.
    ///
    /// # Errors
    /// The errors of [`shape`](Self::shape) and [`skin_strip_compliance`].
    pub fn compliance(&self, x: &[Point3<f64>; 3]) -> Result<f64, MaterialError> {
        let SkinStripShape { projected_area, length } = self.shape(x)?;
        skin_strip_compliance(length, projected_area, self.law.modulus_n_per_m)
    }
}

/// Returns the unit vector along `value`.
fn unit(quantity: &'static str, value: [f64; 3]) -> Result<Vector3<f64>, MaterialError> {
    // Dividing by the largest component first keeps the squares in range.
    let vector = Vector3::from(value);
    let largest = vector.amax();
    if largest > 0.0 && value.iter().all(|component| component.is_finite()) {
        Ok((vector / largest).normalize())
    } else {
        Err(MaterialError::NotADirection { quantity, value })
    }
}
