//! The sections of a scene that a body is built from.

use std::path::Path;

use cutis_mesh::{Excision, Incision, SkinMode, Undermining};

use super::growing::Timing;
use super::memory::bytes_per_tet;
use crate::model::ModelChoice;
use crate::scene::{
    ExcisionSection, HandleSection, IncisionSection, LatticeSection, LoadedScene, MembraneSection, Scene,
    SceneFile, SutureSection, TissueMaterials, TissueSection, UnderminingSection,
};

/// The sections of a scene that a body is built from.
#[derive(Clone)]
pub(crate) struct BodySections<'a> {
    pub(crate) file: SceneFile<'a>,
    /// The name of the CT in messages.
    pub(crate) ct: &'a Path,
    pub(crate) lattice: &'a LatticeSection,
    /// Memory that a tetrahedron takes.
    pub(crate) bytes_per_tet: u64,
    pub(crate) tissue: &'a TissueSection,
    /// Whether a constraint puts the skin under tension.
    pub(crate) has_tension: bool,
    /// Rule by which the skin is found; none if the scene does not need the skin.
    pub(crate) skin: Option<SkinMode>,
    /// Whether the vertices of the skin move onto a smooth surface.
    pub(crate) smooth_skin: bool,
    /// The membrane that needs normals and directions of the skin; none if the scene has none, or a
    /// model without constraints.
    pub(crate) membrane: Option<&'a MembraneSection>,
    /// The table of materials; none if the scene has none or its model does not use it.
    pub(crate) materials: Option<&'a TissueMaterials>,
    pub(crate) incisions: &'a [IncisionSection],
    pub(crate) underminings: Vec<Undermining>,
    /// The blades whose sides never come apart: of underminings that adhere.
    pub(crate) adhering_blades: Vec<u32>,
    pub(crate) excisions: &'a [ExcisionSection],
    /// When each cut of no width is made: incisions, underminings, excisions.
    pub(crate) times: Vec<Timing>,
    /// Whether incisions without a width are made at their times. If not, they exist from the
    /// start.
    pub(crate) cuts_grow: bool,
    pub(crate) handles: &'a [HandleSection],
    /// None with a model that has no sutures.
    pub(crate) sutures: &'a [SutureSection],
    /// The number of the wound that each suture closes: incisions first, then excisions.
    pub(crate) closes: Vec<usize>,
}

impl<'a> BodySections<'a> {
    pub(crate) fn of(loaded: &'a LoadedScene) -> Self {
        let scene = &loaded.scene;
        let times = Timing::all(scene);
        Self {
            file: loaded.file(),
            ct: scene.volume.path.as_deref().unwrap_or(Path::new("phantom")),
            lattice: &scene.lattice,
            bytes_per_tet: bytes_per_tet(scene),
            tissue: &scene.tissue,
            has_tension: scene.model == ModelChoice::Pbd && scene.constraints.need_skin(),
            skin: needs_skin(scene).then_some(scene.skin.mode),
            smooth_skin: smooth_skin(scene),
            membrane: membrane(scene),
            materials: scene.used_materials(),
            incisions: &scene.incision,
            underminings: scene
                .undermining
                .iter()
                .filter_map(|section| undermining(scene, section))
                .collect(),
            adhering_blades: adhering_blades(scene),
            excisions: &scene.excision,
            cuts_grow: times.iter().any(|time| scene.model.cuts_while_moving(time.is_later())),
            times,
            handles: &scene.handle,
            sutures: if scene.model == ModelChoice::Pbd { &scene.suture } else { &[] },
            closes: scene.suture.iter().filter_map(|suture| scene.wound(&suture.wound)).collect(),
        }
    }
}

impl BodySections<'_> {
    /// Whether something cuts the body.
    pub(super) fn cuts(&self) -> bool {
        !self.incisions.is_empty() || !self.excisions.is_empty()
    }
}

/// The membrane of a scene whose model has constraints.
fn membrane(scene: &Scene) -> Option<&MembraneSection> {
    scene.constraints.membrane.as_ref().filter(|_| scene.model == ModelChoice::Pbd)
}

/// Whether the vertices of the skin move onto a smooth surface.
pub(crate) fn smooth_skin(scene: &Scene) -> bool {
    scene.skin.smooth.unwrap_or(membrane(scene).is_some())
}

/// Whether a part of the scene refers to the skin, so that it must be found.
pub(crate) fn needs_skin(scene: &Scene) -> bool {
    scene.constraints.need_skin()
        || smooth_skin(scene)
        || scene.cuts()
        || scene.output.surface
        || scene.output.series_every > 0
        || scene.output.ply
        || scene.output.stl
        || scene.output.pictures
        || scene.used_materials().is_some_and(TissueMaterials::name_depth)
}

/// The undermining of a section. None if its wound does not exist.
fn undermining(scene: &Scene, section: &UnderminingSection) -> Option<Undermining> {
    let UnderminingSection { distance_mm, depth_mm, .. } = *section;
    Some(Undermining { wound: scene.wound(&section.wound)?, distance_mm, depth_mm })
}

/// The blades of underminings that adhere. They follow those of the incisions without a width.
fn adhering_blades(scene: &Scene) -> Vec<u32> {
    let incisions = scene.incision.iter().filter(|incision| incision.width_mm.is_none()).count() as u32;
    let blades = (incisions..).zip(&scene.undermining);
    blades.filter(|(_, undermining)| undermining.adheres).map(|(blade, _)| blade).collect()
}

impl From<&ExcisionSection> for Excision {
    fn from(section: &ExcisionSection) -> Self {
        Self { path_mm: section.path_mm.clone(), depth_mm: section.depth_mm }
    }
}

impl From<&IncisionSection> for Incision {
    fn from(section: &IncisionSection) -> Self {
        let IncisionSection { depth_mm, width_mm, .. } = *section;
        Self { path_mm: section.path(), depth_mm, width_mm }
    }
}
