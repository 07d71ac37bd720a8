//! The sections that act on the body: fixed vertices, incisions, handles.

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

/// An incision along straight segments on the skin. It is placed on the body at rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IncisionSection {
    /// One end, on or near the skin, mm. Left out with `path_mm`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<[f64; 3]>,
    /// The other end, mm. Left out with `path_mm`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<[f64; 3]>,
    /// Two or more points on or near the skin, mm, in place of `from_mm` and `to_mm`. The incision
    /// runs straight from each point to the next.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path_mm: Vec<[f64; 3]>,
    /// Depth below the skin, mm.
    pub depth_mm: f64,
    /// Width of the strip of tissue that is removed, mm, as in the paper. Left out: the cut has no
    /// width and removes nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width_mm: Option<f64>,
    /// Time at which the incision is made or begins, s. With the model `pbd` an incision with a
    /// width is made at 0.
    #[serde(default)]
    pub at_s: f64,
    /// Speed at which the incision grows from one end to the other, mm/s (model `pbd`, without a
    /// width). Left out: it is made at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mm_s: Option<f64>,
}

impl IncisionSection {
    /// The points of its path, mm.
    pub fn path(&self) -> Vec<[f64; 3]> {
        let ends = || self.from_mm.into_iter().chain(self.to_mm).collect();
        if self.path_mm.is_empty() { ends() } else { self.path_mm.clone() }
    }
}

/// Stitches along an incision without a width (model `pbd`). Each stitch is a thread between two
/// points of the skin, one on each side. It pulls and does not push.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SutureSection {
    /// Number of the incision, from 0.
    pub incision: usize,
    /// Distance from stitch to stitch, mm.
    pub every_mm: f64,
    /// Distance of the ends of a stitch from the incision, mm.
    #[serde(default = "SutureSection::default_bite_mm")]
    pub bite_mm: f64,
    /// Stiffness of a thread, N/m (`xpbd`, `vbd`).
    #[serde(default = "SutureSection::default_thread_n_per_m")]
    pub thread_n_per_m: f64,
    /// Time at which the threads begin to pull, s.
    #[serde(default)]
    pub at_s: f64,
    /// Time in which they shorten, s; 0: at once.
    #[serde(default = "SutureSection::default_tighten_s")]
    pub tighten_s: f64,
    /// Length of a tightened thread over the distance of its ends in the scan, at most 1. Skin
    /// between the stitches and the incision is free and recoils, so lips meet below 1.
    #[serde(default = "SutureSection::default_tighten_to")]
    pub tighten_to: f64,
    /// Time at which they are cut, s. Left out: they stay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub release_s: Option<f64>,
}

impl SutureSection {
    fn default_bite_mm() -> f64 {
        5.0
    }

    fn default_thread_n_per_m() -> f64 {
        1000.0
    }

    fn default_tighten_s() -> f64 {
        0.5
    }

    fn default_tighten_to() -> f64 {
        1.0
    }
}

/// A sphere of tissue that is dragged along a straight line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HandleSection {
    /// Center of the sphere that is grabbed, mm.
    pub at_mm: [f64; 3],
    /// Radius of the sphere, mm.
    pub radius_mm: f64,
    /// Displacement at the end of the movement, mm.
    pub move_mm: [f64; 3],
    /// Duration of the movement, s.
    #[serde(default = "HandleSection::default_over_s")]
    pub over_s: f64,
}

impl HandleSection {
    fn default_over_s() -> f64 {
        1.0
    }
}
