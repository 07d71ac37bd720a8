//! The constraint kinds of a scene and their materials.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::TableChoice;

/// The constraint kinds of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstraintsSection {
    /// Springs along the lattice edges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance: Option<DistanceSection>,
    /// Volumes of the tetrahedra.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume: Option<VolumeConstraintSection>,
    /// Skin tension over the skin triangles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stc: Option<StcSection>,
}

/// Springs along the lattice edges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistanceSection {
    /// Young's modulus, Pa (`xpbd`).
    pub youngs_modulus_pa: f64,
    /// Share of the error removed per projection, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
}

/// Volumes of the tetrahedra.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumeConstraintSection {
    /// Bulk modulus, Pa (`xpbd`).
    pub bulk_modulus_pa: f64,
    /// Share of the error removed per projection, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
}

/// Skin tension over the skin triangles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StcSection {
    /// Area modulus of the skin, N/m (`xpbd`).
    pub area_modulus_n_per_m: f64,
    /// Share of the error removed per projection, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
    /// Tensile amplification β of the restoring force, 0 or more.
    #[serde(default = "default_amplification")]
    pub amplification: f64,
    /// Rest area over area in the scan; below 1 the skin is under tension.
    #[serde(default = "default_rest_area_scale")]
    pub rest_area_scale: f64,
    /// Formula: `"energy"` is stable for any amplification; `"paper"` is the paper's clamped update, for `pbd` only.
    #[serde(default)]
    pub form: StcForm,
    /// HU → factor on the modulus (on the stiffness in `pbd`), at the mean HU of a triangle's vertices: preset `uniform` or
    /// `paper`, or points.
    #[serde(default = "uniform")]
    pub stiffness_table: TableChoice,
    /// Other values near the incisions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near_incision: Option<NearIncisionSection>,
}

/// Formula of the skin tension constraint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StcForm {
    /// Derived from an energy; stable for any amplification.
    #[default]
    Energy,
    /// The paper's update with the right gradient, clamped; `pbd` only.
    Paper,
}

/// Skin parameters near an incision, blended linearly to the general ones at `radius_mm`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NearIncisionSection {
    /// Distance from the segment at which the general values hold, mm.
    pub radius_mm: f64,
    /// Factor on the rest area at the segment.
    #[serde(default = "one")]
    pub rest_area_factor: f64,
    /// Factor on the modulus (stiffness) at the segment.
    #[serde(default = "one")]
    pub stiffness_factor: f64,
}

pub(super) fn one() -> f64 {
    1.0
}

fn default_amplification() -> f64 {
    2.0
}

fn default_rest_area_scale() -> f64 {
    0.9
}

fn uniform() -> TableChoice {
    TableChoice::Preset("uniform".into())
}
