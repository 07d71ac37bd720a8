//! ChainMail: what gives way how far, and how much is relaxed.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use crate::scene::choice::OneOr;

/// ChainMail, where it is the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ChainmailSection {
    /// How far links give way, by HU: preset `tissue` (fat, firmer soft tissue, rigid bone) or `uniform`, or a list of
    /// materials.
    pub materials: MaterialsChoice,
    /// Sweeps of elastic relaxation after the drag of each frame, at the most; 0 leaves links where the drag left them. Frames
    /// after the last drag relax on.
    pub relax_per_frame: u32,
}

impl Default for ChainmailSection {
    fn default() -> Self {
        Self { materials: MaterialsChoice::Preset("tissue".into()), relax_per_frame: 10 }
    }
}

/// Materials by HU: the name of a preset, or a list.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum MaterialsChoice {
    /// A preset by name.
    Preset(String),
    /// `{ from_hu, shortest, longest, shear, k_steps }`, `from_hu` strictly increasing.
    List(Vec<ChainMaterialSection>),
}

impl<'de> Deserialize<'de> for MaterialsChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match OneOr::deserialize(deserializer)? {
            OneOr::One(name) => Self::Preset(name),
            OneOr::List(list) => Self::List(list),
        })
    }
}

/// Limits of the links of what has an HU from `from_hu` up to that of the next one, in rest lengths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChainMaterialSection {
    /// Lowest HU.
    pub from_hu: f32,
    /// Shortest length of a link, 0 to 1.
    pub shortest: PerAxis,
    /// Longest length of a link, 1 to 16.
    pub longest: PerAxis,
    /// Farthest that the ends of a link move apart across it, 0 to 16.
    pub shear: PerAxis,
    /// How near to where its neighbors ask it to be relaxation leaves an element, in lattice steps, 0 to 4096; 0 is elastic.
    #[serde(default)]
    pub k_steps: f64,
}

/// One number, or one for links along each axis of the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum PerAxis {
    /// The same along every axis.
    All(f64),
    /// Along `i`, `j` and `k`.
    Each([f64; 3]),
}

impl<'de> Deserialize<'de> for PerAxis {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match OneOr::deserialize(deserializer)? {
            OneOr::One(value) => Self::All(value),
            OneOr::List(values) => Self::Each(values),
        })
    }
}

impl PerAxis {
    /// Along each axis.
    pub fn values(self) -> [f64; 3] {
        match self {
            Self::All(value) => [value; 3],
            Self::Each(values) => values,
        }
    }
}
