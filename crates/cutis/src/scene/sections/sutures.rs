//! The section that closes wounds.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::WoundRef;

/// Stitches that close a wound without a width (model `pbd`). Each stitch is a thread between two
/// points of the skin, or of tissue below it. It pulls and does not push. A second suture with a
/// `depth_mm` closes the space below the skin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SutureSection {
    /// The wound that it closes: the number of an incision from 0 (excisions follow the incisions),
    /// or a name.
    pub wound: WoundRef,
    /// Distance from stitch to stitch along the incision, or along the long axis of an excision,
    /// mm. Left out with `pairs_mm` and `markups`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every_mm: Option<f64>,
    /// Pairs of points on or near the skin that stitches join, mm, in place of `every_mm`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs_mm: Vec<[[f64; 3]; 2]>,
    /// A file with the points of `pairs_mm`: lines, or a list of points of which each two are a
    /// pair, as markups of 3D Slicer (`.mrk.json`). Relative to the scene file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub markups: Option<PathBuf>,
    /// Distance of the ends of a stitch from the edge of the wound, mm.
    #[serde(default = "SutureSection::default_bite_mm")]
    pub bite_mm: f64,
    /// Depth of the ends of a stitch below the skin, mm: less than that of the wound, and of an
    /// undermining around it. 0: on the skin, as with `pairs_mm`.
    #[serde(default)]
    pub depth_mm: f64,
    /// Stiffness of a thread, N/m (`xpbd`, `vbd`).
    #[serde(default = "SutureSection::default_thread_n_per_m")]
    pub thread_n_per_m: f64,
    /// Time at which the threads begin to pull, s.
    #[serde(default)]
    pub at_s: f64,
    /// Time in which they shorten, s; 0: at once.
    #[serde(default = "SutureSection::default_tighten_s")]
    pub tighten_s: f64,
    /// Length of a tightened thread over the distance of its ends when the lips meet, at most 1.
    /// That distance is the one in the scan for an incision, and 2 `bite_mm` otherwise. Skin
    /// between the stitches and the edge is free and recoils, so lips meet below 1.
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
