//! The sections that hold and drag the body: fixed vertices and handles.

use std::path::PathBuf;

use cutis_mesh::HalfSpace;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The vertices that do not move.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixedSection {
    /// Vertices above this HU.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bone_above_hu: Option<f32>,
    /// Vertices inside these boxes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub boxes: Vec<BoxSection>,
    /// Vertices on the side of these planes to which the normal points.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub planes: Vec<HalfSpace>,
    /// Vertices in the first and last layer of the lattice along these axes (`"i"`, `"j"`, `"k"`),
    /// where the scan ends.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub end_layers: Vec<AxisChoice>,
}

/// A lattice axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AxisChoice {
    /// First voxel axis.
    I,
    /// Second voxel axis.
    J,
    /// Third voxel axis.
    K,
}

impl AxisChoice {
    /// The number of the axis: 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// An axis-aligned box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxSection {
    /// Lowest corner, mm.
    pub min_mm: [f64; 3],
    /// Highest corner, mm.
    pub max_mm: [f64; 3],
}

/// A sphere of tissue that is dragged along a straight line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HandleSection {
    /// Center of the sphere that is grabbed, mm. Left out with `markups`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_mm: Option<[f64; 3]>,
    /// Radius of the sphere, mm.
    pub radius_mm: f64,
    /// Displacement at the end of the movement, mm. Left out with `markups`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub move_mm: Option<[f64; 3]>,
    /// A file with two points in place of `at_mm` and `move_mm`: where the handle grabs and where
    /// it moves to, as a line of 3D Slicer (`.mrk.json`). Relative to the scene file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub markups: Option<PathBuf>,
    /// Time in s at which the handle grabs the tissue, where it is then, and begins to move it. It
    /// does so when a frame begins at that time or later.
    #[serde(default)]
    pub at_s: f64,
    /// Duration of the movement, s.
    #[serde(default = "HandleSection::default_over_s")]
    pub over_s: f64,
}

impl HandleSection {
    /// Center of the sphere, mm. A checked scene has one.
    pub fn center_mm(&self) -> [f64; 3] {
        self.at_mm.unwrap_or_default()
    }

    /// Displacement at the end of the movement, mm. A checked scene has one.
    pub fn displacement_mm(&self) -> [f64; 3] {
        self.move_mm.unwrap_or_default()
    }

    fn default_over_s() -> f64 {
        1.0
    }
}
