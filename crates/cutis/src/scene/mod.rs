//! The scene file: everything that a run depends on, as plain data with units in the key names.
//!
//! Positions are world millimeters in the volume's RAS+ frame. Unknown keys are refused. [`Scene::load`] reads a
//! file, applies overrides and checks every value; each section is a struct of this module.

mod choice;
mod demo;
mod load;
mod reference;
mod sections;
mod validate;

pub use demo::demo;
pub use load::{LoadedScene, Override, schema, template};
pub use reference::reference;
pub use sections::*;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One scene: what is simulated and what is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Deformation model: position-based dynamics, or ChainMail.
    #[serde(default)]
    pub model: Model,
    /// Where the CT comes from.
    pub volume: VolumeSection,
    /// The tetrahedral lattice laid over the volume. Left out: one vertex on every voxel center.
    #[serde(default)]
    pub lattice: LatticeSection,
    /// What is tissue, and what it weighs.
    #[serde(default)]
    pub tissue: TissueSection,
    /// Which triangles are skin.
    #[serde(default)]
    pub skin: SkinSection,
    /// The constraint kinds; a kind that is left out costs nothing.
    #[serde(default)]
    pub constraints: ConstraintsSection,
    /// ChainMail, where it is the model. Left out: its defaults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chainmail: Option<ChainmailSection>,
    /// What does not move.
    #[serde(default)]
    pub fixed: FixedSection,
    /// Cuts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub incision: Vec<IncisionSection>,
    /// Spheres of tissue that are dragged along.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub handle: Vec<HandleSection>,
    /// Time stepping.
    #[serde(default)]
    pub solver: SolverSection,
    /// How long to run.
    #[serde(default)]
    pub run: RunSection,
    /// What to write. Left out: everything but the tissue mesh.
    #[serde(default)]
    pub output: OutputSection,
}
