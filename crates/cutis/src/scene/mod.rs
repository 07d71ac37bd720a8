//! The scene file: all inputs of a run as plain data, with units in the key names.
//!
//! Positions are world millimeters in the volume's RAS+ frame. Unknown keys are refused.
//! [`Scene::load`] reads a file, applies overrides and checks every value. Each section is a struct
//! of this module. The sections of constraint kinds and of models are defined next to the code that
//! builds them, in the stage `model`. Values that also exist without a scene have the types of the
//! library: [`Split`](crate::mesh::Split), [`SkinMode`](crate::mesh::SkinMode),
//! [`HalfSpace`](crate::mesh::HalfSpace) and [`Formulation`](crate::solver::Formulation).

mod choice;
mod demo;
mod first_scene;
mod load;
mod markups;
pub(crate) mod nearest;
mod pick_region;
mod reference;
mod sections;
mod steps;
pub(crate) mod validate;
mod validate_cuts;

pub(crate) use choice::OneOr;
pub use demo::demo;
pub use first_scene::template_for;
pub(crate) use load::SceneFile;
pub use load::{LoadedScene, Override, schema, template};
pub use reference::reference;
pub use sections::*;

pub use crate::model::ModelChoice;
pub use crate::model::chainmail::section::*;
pub use crate::model::constraints::kinds::{
    AdhesionSection, ConstraintsSection, ContactSection, DistanceSection, MembraneDirections,
    MembraneSection, NearIncisionSection, StcForm, StcSection, VolumeConstraintSection, constraint_kinds,
};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One scene: what is simulated and what is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Deformation model: position-based dynamics, or ChainMail.
    #[serde(default)]
    pub model: ModelChoice,
    /// Whether the scan shows the body in equilibrium (`pbd`). If so, a constant load balances the
    /// skin's tension and the weight of the uncut body, so that only a cut or a handle moves it. If
    /// not, the body shrinks and sags from the first frame, as in the paper.
    #[serde(default = "at_rest")]
    pub scan_is_at_rest: bool,
    /// Where the CT comes from.
    pub volume: VolumeSection,
    /// The tetrahedral lattice laid over the volume. Left out: one vertex on every voxel center.
    #[serde(default)]
    pub lattice: LatticeSection,
    /// Which voxels are tissue, and their density.
    #[serde(default)]
    pub tissue: TissueSection,
    /// Which triangles are skin.
    #[serde(default)]
    pub skin: SkinSection,
    /// Moduli by HU and by depth below the skin: preset `layered`, `trunk`, `limb` or `head`, or
    /// rows. Left out: each constraint kind has one modulus for the whole body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub materials: Option<TissueMaterials>,
    /// The constraint kinds; a kind that is left out costs nothing.
    #[serde(default)]
    pub constraints: ConstraintsSection,
    /// Settings of the model `chainmail`. Left out: its defaults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chainmail: Option<ChainmailSection>,
    /// The vertices that do not move.
    #[serde(default)]
    pub fixed: FixedSection,
    /// Incisions, which cut the body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub incision: Vec<IncisionSection>,
    /// Underminings, which separate skin from what is below it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub undermining: Vec<UnderminingSection>,
    /// Excisions, which take pieces out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excision: Vec<ExcisionSection>,
    /// Sutures, which close wounds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub suture: Vec<SutureSection>,
    /// Spheres of tissue that are dragged along.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub handle: Vec<HandleSection>,
    /// Time stepping.
    #[serde(default)]
    pub solver: SolverSection,
    /// How long to run.
    #[serde(default)]
    pub run: RunSection,
    /// The files to write. Without the section: the deformed CT, the skin, the pictures and the
    /// report.
    #[serde(default)]
    pub output: OutputSection,
}

impl Scene {
    /// The number of the wound that a section refers to: incisions first, then excisions. None if
    /// there is no such wound.
    pub fn wound(&self, wound: &WoundRef) -> Option<usize> {
        match wound {
            WoundRef::Number(number) => Some(*number).filter(|&number| number < self.wounds()),
            WoundRef::Name(name) => self.wound_names().position(|of_wound| of_wound == Some(name)),
        }
    }

    /// Number of incisions and excisions.
    pub fn wounds(&self) -> usize {
        self.incision.len() + self.excision.len()
    }

    /// The name of each wound that has one: incisions first, then excisions.
    pub fn wound_names(&self) -> impl Iterator<Item = Option<&str>> {
        let incisions = self.incision.iter().map(|incision| incision.name.as_deref());
        incisions.chain(self.excision.iter().map(|excision| excision.name.as_deref()))
    }

    /// Number of frames in which something may be done to the body. A run that ends at rest goes on
    /// until all is done.
    pub(crate) fn most_frames(&self) -> u32 {
        if self.run.until == RunEnd::Rest { u32::MAX } else { self.run.frames }
    }

    /// Time in s at which the last one of these frames begins.
    pub(crate) fn last_frame_s(&self) -> f64 {
        f64::from(self.most_frames().saturating_sub(1)) * self.solver.dt_s
    }

    /// Whether something cuts the body.
    pub fn cuts(&self) -> bool {
        self.wounds() > 0
    }
}

fn at_rest() -> bool {
    true
}
