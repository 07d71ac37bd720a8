//! Compliances from material parameters that do not depend on the mesh.
//!
//! A compliance `α` turns a constraint `C` into the energy `C²/(2α)` in joules. Each formula
//! contains the size of the element. Refining a mesh therefore changes the compliances but not the
//! material. Arguments and results are `f64` in SI units. An infinite modulus means a rigid
//! material: `α = 0`.

/// An invalid material parameter or rest size.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// A value that must be above 0 is 0 or less, infinite where that is not allowed, or NaN.
    #[error("{quantity} is {value} {unit}; it must be a finite number above 0")]
    NotPositive {
        /// Name of the quantity.
        quantity: &'static str,
        /// The value.
        value: f64,
        /// Unit of the value; "1" if it has none.
        unit: &'static str,
    },
    /// A value that must be 0 or more is negative or not finite.
    #[error("{quantity} is {value} {unit}; it must be a finite number, 0 or more")]
    Negative {
        /// Name of the quantity.
        quantity: &'static str,
        /// The value.
        value: f64,
        /// Unit of the value; "1" if it has none.
        unit: &'static str,
    },
    /// A PBD stiffness is not above 0 and at most 1. It is the fraction of the error that one
    /// iteration removes.
    #[error("stiffness is {value}; it must be above 0 and at most 1")]
    StiffnessOutOfRange {
        /// The value.
        value: f64,
    },
    /// A vector that must give a direction is zero or not finite.
    #[error("the {quantity} is {value:?}; it must be a finite vector that is not zero")]
    NotADirection {
        /// Name of the vector.
        quantity: &'static str,
        /// The vector.
        value: [f64; 3],
    },
    /// The direction of a skin strip is along the normal of the skin.
    #[error(
        "the direction {direction:?} is along the normal {normal:?} of the skin; it must lie in the skin"
    )]
    AlongNormal {
        /// The direction.
        direction: [f64; 3],
        /// The normal.
        normal: [f64; 3],
    },
    /// The compression of a skin strip is not from 0 to 1.
    #[error("compression of a skin strip is {value}; it must be from 0 to 1")]
    CompressionOutOfRange {
        /// The value.
        value: f64,
    },
    /// The tension of a skin strip is not below its modulus, so the strip would have no length
    /// without tension.
    #[error(
        "tension of a skin strip is {tension_n_per_m} N/m with a modulus of {modulus_n_per_m} N/m; \
         the tension must be below the modulus"
    )]
    TensionTooLarge {
        /// The tension in N/m.
        tension_n_per_m: f64,
        /// The modulus in N/m.
        modulus_n_per_m: f64,
    },
    /// A triangle has no extent across a strip, so it cannot hold it.
    #[error("a triangle is {width} m wide across a skin strip; it must have an extent there")]
    NoWidth {
        /// Extent across the strip in m.
        width: f64,
    },
    /// The arguments are valid, but so small or large that the compliance is not a finite number.
    #[error(
        "the compliance of a {constraint} constraint with rest size {rest_size} is {value}; \
         it must be a finite number"
    )]
    ComplianceOutOfRange {
        /// Name of the constraint.
        constraint: &'static str,
        /// Rest length (m), area (m²) or volume (m³).
        rest_size: f64,
        /// The compliance.
        value: f64,
    },
}

/// Returns the compliance of a [`Distance`](crate::Distance) in m/N: `α = L²/(E·V_e)`.
///
/// The edge is a rod with the length `rest_length` `L` (m), the cross-section `V_e/L` and Young's
/// modulus `youngs_modulus_pa` `E` (Pa). `edge_volume` `V_e` (m³) is the edge's share of the volume
/// of the tetrahedra around it.
///
/// # Errors
/// [`MaterialError::NotPositive`] and [`MaterialError::ComplianceOutOfRange`].
///
/// ```
/// // 1 cm of a rod with a cross-section of 1 cm² and 20 kPa: k = E·area/L = 200 N/m.
/// let alpha = cutis_constraints::distance_compliance(0.01, 2e4, 1e-6)?;
/// assert!((alpha - 1.0 / 200.0).abs() < 1e-15);
/// # Ok::<(), cutis_constraints::MaterialError>(())
/// ```
pub fn distance_compliance(
    rest_length: f64,
    youngs_modulus_pa: f64,
    edge_volume: f64,
) -> Result<f64, MaterialError> {
    check_positive("rest length", "m", rest_length)?;
    check_modulus("Young's modulus", "Pa", youngs_modulus_pa)?;
    check_positive("edge volume", "m³", edge_volume)?;
    // The quotients come first, because their exponents stay near that of the result.
    let compliance = rest_length / youngs_modulus_pa * (rest_length / edge_volume);
    finite("distance", rest_length, compliance)
}

/// Returns the compliance of a [`Volume`](crate::Volume) in m³/Pa: `α = V0/K`.
///
/// `V0` is `rest_volume` in m³ and `K` is `bulk_modulus_pa` in Pa. The energy `C²/(2α)` is then `½
/// K (ΔV/V0)² V0`.
///
/// # Errors
/// [`MaterialError::NotPositive`] and [`MaterialError::ComplianceOutOfRange`].
pub fn volume_compliance(rest_volume: f64, bulk_modulus_pa: f64) -> Result<f64, MaterialError> {
    check_positive("rest volume", "m³", rest_volume)?;
    check_modulus("bulk modulus", "Pa", bulk_modulus_pa)?;
    finite("volume", rest_volume, rest_volume / bulk_modulus_pa)
}

/// Returns the compliance of a [`SkinTension`](crate::SkinTension) in m³/N: `α = A0/T`.
///
/// `A0` is `rest_area` in m². `T` is `area_modulus_n_per_m` in N/m, the tension per relative growth
/// of the area. `k = T/A0` is the stiffness of the energy form.
///
/// # Errors
/// [`MaterialError::NotPositive`] and [`MaterialError::ComplianceOutOfRange`].
pub fn skin_compliance(rest_area: f64, area_modulus_n_per_m: f64) -> Result<f64, MaterialError> {
    check_positive("rest area", "m²", rest_area)?;
    check_modulus("area modulus", "N/m", area_modulus_n_per_m)?;
    finite("skin tension", rest_area, rest_area / area_modulus_n_per_m)
}

/// Returns the compliance of a [`SkinStrip`](crate::SkinStrip) in m/N: `α = ℓ²/(T·A_p)`.
///
/// `ℓ` is `length` in m and `A_p` is `projected_area` in m², both from
/// [`SkinStripMaterial::shape`](crate::SkinStripMaterial::shape). `T` is `modulus_n_per_m` in N/m.
/// The energy `C²/(2α)` is then `½ T ε² A_p` for the strain `ε` of the skin along the strip.
///
/// # Errors
/// [`MaterialError::NotPositive`] and [`MaterialError::ComplianceOutOfRange`].
pub fn skin_strip_compliance(
    length: f64,
    projected_area: f64,
    modulus_n_per_m: f64,
) -> Result<f64, MaterialError> {
    check_positive("length of a skin strip", "m", length)?;
    check_positive("projected area", "m²", projected_area)?;
    check_modulus("modulus of a skin strip", "N/m", modulus_n_per_m)?;
    finite("skin strip", length, length / modulus_n_per_m * (length / projected_area))
}

/// Returns the compliance of a [`LipContact`](crate::LipContact) in 1/J: `α = 1/(M A L)`.
///
/// `A` is `area`, the area of the cut that the contact stands for, in m². `L` is `length`, that of
/// the severed edge, in m. `M` is `modulus_pa` in Pa. Pressed sides overlap by the share `C = p/M`
/// of the edge under the pressure `p`: as a layer of the modulus `M` and the thickness `L` does.
///
/// # Errors
/// [`MaterialError::NotPositive`] and [`MaterialError::ComplianceOutOfRange`].
pub fn lip_contact_compliance(area: f64, length: f64, modulus_pa: f64) -> Result<f64, MaterialError> {
    check_positive("area of a contact", "m²", area)?;
    check_positive("length of a severed edge", "m", length)?;
    check_modulus("modulus of a contact", "Pa", modulus_pa)?;
    finite("contact", area * length, 1.0 / (modulus_pa * area * length))
}

/// Fails unless `value` is finite and above 0.
pub(crate) fn check_positive(
    quantity: &'static str,
    unit: &'static str,
    value: f64,
) -> Result<(), MaterialError> {
    if value.is_finite() { check_modulus(quantity, unit, value) } else { not_positive(quantity, unit, value) }
}

/// Fails unless `value` is finite and 0 or more.
pub(crate) fn check_not_negative(
    quantity: &'static str,
    unit: &'static str,
    value: f64,
) -> Result<(), MaterialError> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(MaterialError::Negative { quantity, value, unit })
    }
}

/// Fails unless `value` is above 0. Infinity is allowed: a rigid material.
fn check_modulus(quantity: &'static str, unit: &'static str, value: f64) -> Result<(), MaterialError> {
    if value > 0.0 { Ok(()) } else { not_positive(quantity, unit, value) }
}

fn not_positive(quantity: &'static str, unit: &'static str, value: f64) -> Result<(), MaterialError> {
    Err(MaterialError::NotPositive { quantity, value, unit })
}

fn finite(constraint: &'static str, rest_size: f64, value: f64) -> Result<f64, MaterialError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(MaterialError::ComplianceOutOfRange { constraint, rest_size, value })
    }
}
