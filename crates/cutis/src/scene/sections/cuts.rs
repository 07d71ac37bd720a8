//! The sections that cut the body: incisions, underminings, excisions.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An incision along straight segments on the skin. It is placed on the body at rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IncisionSection {
    /// Name, by which underminings and sutures refer to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// One end, on or near the skin, mm. Left out with `path_mm` and `markups`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<[f64; 3]>,
    /// The other end, mm. Left out with `path_mm` and `markups`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<[f64; 3]>,
    /// Two or more points on or near the skin, mm, in place of `from_mm` and `to_mm`. The incision
    /// runs straight from each point to the next.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path_mm: Vec<[f64; 3]>,
    /// File with the path, in place of points: a curve, a line or a list of points of 3D Slicer
    /// (`.mrk.json`), or text with one point `x y z` per line. The name starts from the folder of
    /// the scene. The points are read with the scene and stand in `path_mm` of the report.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub markups: Option<PathBuf>,
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
    /// Speed at which the incision grows from one end to the other, mm/s (without a width). Left
    /// out: it is made at once.
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

/// A wound that another section refers to: its number, or its name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum WoundRef {
    /// Number of an incision, from 0. Excisions follow the incisions.
    Number(usize),
    /// The `name` of an incision or an excision.
    Name(String),
}

impl std::fmt::Display for WoundRef {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Name(name) => write!(f, "{name:?}"),
        }
    }
}

/// Skin around a wound that is separated from what is below it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnderminingSection {
    /// The wound from which it is made: the number of an incision from 0 (excisions follow the
    /// incisions), or a name.
    pub wound: WoundRef,
    /// How far it reaches from the incision or the outline in all directions, mm.
    pub distance_mm: f64,
    /// Depth below the skin, mm: at most that of the wound.
    pub depth_mm: f64,
    /// Time at which it is made or begins, s: not before the wound.
    #[serde(default)]
    pub at_s: f64,
    /// Speed at which it grows from the wound outwards, mm/s. Left out: it is made at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mm_s: Option<f64>,
    /// Whether the skin slides over the tissue below it without coming off, as wet tissue does
    /// where no air gets in. `false`: it also comes off. It acts through `constraints.adhesion`.
    #[serde(default)]
    pub adheres: bool,
}

/// A piece of tissue below a closed outline on the skin that is taken out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExcisionSection {
    /// Name, by which sutures refer to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Points of the outline on or near the skin, mm: three or more, and the first one again at the
    /// end. Left out with `markups`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path_mm: Vec<[f64; 3]>,
    /// File with the outline, in place of points, as for an incision: a closed curve of 3D Slicer,
    /// or a path that ends where it began.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub markups: Option<PathBuf>,
    /// Depth below the skin, mm.
    pub depth_mm: f64,
    /// Time at which the piece is taken out, s.
    #[serde(default)]
    pub at_s: f64,
}
