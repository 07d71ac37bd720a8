//! The sections of a scene that a body is built from.

use cutis_mesh::{Incision, SkinMode};

use crate::model::ModelChoice;
use crate::scene::{
    HandleSection, IncisionSection, LatticeSection, LoadedScene, MembraneSection, Scene, SceneFile,
    SutureSection, TissueMaterials, TissueSection,
};

/// The sections of a scene that a body is built from.
#[derive(Clone, Copy)]
pub(crate) struct BodySections<'a> {
    pub(crate) file: SceneFile<'a>,
    pub(crate) lattice: &'a LatticeSection,
    pub(crate) tissue: &'a TissueSection,
    /// Rule by which the skin is found; none if the scene does not need the skin.
    pub(crate) skin: Option<SkinMode>,
    /// The membrane that needs normals and directions of the skin; none if the scene has none, or a
    /// model without constraints.
    pub(crate) membrane: Option<&'a MembraneSection>,
    /// The table of materials; none if the scene has none or its model does not use it.
    pub(crate) materials: Option<&'a TissueMaterials>,
    pub(crate) incisions: &'a [IncisionSection],
    /// Whether incisions without a width are made at their times. If not, they exist from the
    /// start.
    pub(crate) cuts_grow: bool,
    pub(crate) handles: &'a [HandleSection],
    /// None with a model that has no sutures.
    pub(crate) sutures: &'a [SutureSection],
}

impl<'a> BodySections<'a> {
    pub(crate) fn of(loaded: &'a LoadedScene) -> Self {
        let scene = &loaded.scene;
        Self {
            file: loaded.file(),
            lattice: &scene.lattice,
            tissue: &scene.tissue,
            skin: needs_skin(scene).then_some(scene.skin.mode),
            membrane: scene.constraints.membrane.as_ref().filter(|_| scene.model == ModelChoice::Pbd),
            materials: scene.used_materials(),
            incisions: &scene.incision,
            cuts_grow: scene.model == ModelChoice::Pbd && scene.incision.iter().any(IncisionSection::grows),
            handles: &scene.handle,
            sutures: if scene.model == ModelChoice::Pbd { &scene.suture } else { &[] },
        }
    }
}

/// Whether a part of the scene refers to the skin, so that it must be found.
pub(crate) fn needs_skin(scene: &Scene) -> bool {
    scene.constraints.need_skin()
        || !scene.incision.is_empty()
        || scene.output.surface
        || scene.output.pictures
        || scene.used_materials().is_some_and(TissueMaterials::name_depth)
}

impl From<&IncisionSection> for Incision {
    fn from(section: &IncisionSection) -> Self {
        let IncisionSection { depth_mm, width_mm, .. } = *section;
        Self { path_mm: section.path(), depth_mm, width_mm }
    }
}
