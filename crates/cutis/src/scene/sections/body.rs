//! What is simulated: the CT, the lattice over it, what is tissue and what is skin.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PlaneSection;

/// Deformation model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// Position-based dynamics over a tetrahedral lattice.
    #[default]
    Pbd,
}

/// Where the CT comes from: exactly one of `path` and `phantom`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumeSection {
    /// A NIfTI file (`.nii`, `.nii.gz`, `.hdr`), relative to the scene file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<PathBuf>,
    /// The built-in synthetic torso instead of a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phantom: Option<PhantomSection>,
}

/// The synthetic torso.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhantomSection {
    /// Voxels per axis, 1 to 4096.
    pub size: [usize; 3],
    /// Anatomy and noise vary with it.
    #[serde(default)]
    pub seed: u64,
}

/// The lattice: at most one of `spacing_mm` and `vertices`; neither puts a vertex on every voxel centre.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LatticeSection {
    /// Distance between neighbouring vertices, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing_mm: Option<f64>,
    /// Vertices per axis, at least 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertices: Option<[usize; 3]>,
    /// How a cell is split into tetrahedra.
    #[serde(default)]
    pub split: SplitChoice,
}

/// How a lattice cell is split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SplitChoice {
    /// Six tetrahedra around the main diagonal.
    #[default]
    Kuhn6,
    /// Five tetrahedra, mirrored on odd cells.
    Five,
}

/// What is tissue, and what it weighs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TissueSection {
    /// HU below which a vertex is air.
    pub air_below_hu: f32,
    /// Which connected parts are simulated.
    pub keep: Keep,
    /// Half-spaces that are dropped before anything else, for example a scanner table in contact with the body.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cut_planes: Vec<PlaneSection>,
    /// HU → density, kg/m³: preset `schneider2000` or `water`, or points.
    pub density: TableChoice,
}

impl Default for TissueSection {
    fn default() -> Self {
        Self {
            air_below_hu: -449.0,
            keep: Keep::default(),
            cut_planes: Vec::new(),
            density: TableChoice::Preset("schneider2000".into()),
        }
    }
}

/// Which connected parts of the tissue are simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Keep {
    /// The largest one: the scanner table and other objects beside the body are left out.
    #[default]
    Largest,
    /// All of them.
    All,
}

/// A piecewise-linear table over HU: the name of a preset, or points `[hu, value]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum TableChoice {
    /// A preset by name.
    Preset(String),
    /// Points `[hu, value]`, HU strictly increasing.
    Points(Vec<[f32; 2]>),
}

/// Which triangles are skin.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkinSection {
    /// Detection rule: the outer skin of the body, all faces between tissue and the rest, or the paper's rule literally.
    #[serde(default)]
    pub mode: SkinChoice,
}

/// Skin detection rule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SkinChoice {
    /// The paper's rule, taken literally: every tetrahedron with exactly one air vertex gives a triangle.
    Paper,
    /// All faces between a kept and a dropped tetrahedron.
    Boundary,
    /// Faces that touch the air around the largest body.
    #[default]
    Exterior,
}
