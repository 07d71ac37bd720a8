//! The section `chainmail` of a scene: link limits by HU, and the amount of relaxation.

use cutis_chainmail::{ChainError, Material, MaterialTable};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use crate::Error;
use crate::scene::validate::Check;
use crate::scene::{ModelChoice, OneOr, Scene, SceneFile, TissueSection};

/// Key of the materials.
const MATERIALS_KEY: &str = "chainmail.materials";

/// Settings of the model `chainmail`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ChainmailSection {
    /// How far links stretch, shorten and shear, by HU: preset `tissue` (fat, firmer soft tissue,
    /// rigid bone) or `uniform`, or a list of materials.
    pub materials: MaterialsChoice,
    /// Most sweeps of elastic relaxation after the drag of each frame; 0 leaves links where the
    /// drag left them. Frames after the last drag continue to relax.
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
    /// The name of a preset.
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

/// Limits of the links of elements from `from_hu` up to the `from_hu` of the next material, in rest
/// lengths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChainMaterialSection {
    /// Lowest HU.
    pub from_hu: f32,
    /// Shortest length of a link, 0 to 1.
    pub shortest: PerAxis,
    /// Longest length of a link, 1 to 16.
    pub longest: PerAxis,
    /// Largest distance across the link by which its ends move apart, 0 to 16.
    pub shear: PerAxis,
    /// Distance from the balance with its neighbors at which relaxation leaves an element, in
    /// lattice steps, 0 to 4096; 0 is elastic.
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
    /// The value along each axis.
    pub fn values(self) -> [f64; 3] {
        match self {
            Self::All(value) => [value; 3],
            Self::Each(values) => values,
        }
    }
}

/// Checks the section, and the other sections as far as ChainMail limits them.
pub(crate) fn validate(scene: &Scene, check: &Check<'_>) -> Result<(), Error> {
    if let Some(chainmail) = &scene.chainmail {
        chainmail.table(check.file, &scene.tissue)?;
    }
    if scene.model != ModelChoice::Chainmail {
        return Ok(());
    }
    let why =
        "must be left out with model = \"chainmail\", whose links all have the length of one lattice step";
    check.require(scene.lattice.grading.is_none(), "lattice.grading", "", why)?;
    check.require(scene.skin.smooth != Some(true), "skin.smooth", true, why)?;
    let why = "must be left out with model = \"chainmail\", whose links have no force that a thread could \
               hold; model = \"pbd\" has sutures";
    let count = scene.suture.len();
    let shown = format!("{count} suture{}", if count == 1 { "" } else { "s" });
    check.require(count == 0, "suture", shown, why)
}

impl ChainmailSection {
    /// The materials, which must begin where tissue does.
    ///
    /// # Errors
    /// [`Error::SceneKey`] for a preset that does not exist, and for a value out of range.
    pub(super) fn table(&self, file: SceneFile<'_>, tissue: &TissueSection) -> Result<MaterialTable, Error> {
        let (table, value) = match &self.materials {
            MaterialsChoice::Preset(name) => (MaterialTable::preset(name), format!("{name:?}")),
            MaterialsChoice::List(list) => {
                let entries: Vec<_> = list.iter().map(|entry| (entry.from_hu, entry.into())).collect();
                (MaterialTable::new(&entries), String::new())
            }
        };
        let table = table.map_err(|error| match error {
            ChainError::Material { material, key, value, range } => {
                let field = if key == "k" { "k_steps" } else { key };
                let key = format!("{MATERIALS_KEY}[{material}].{field}");
                file.bad_key(&key, &format!("{value:?}"), &format!("must be {range}"))
            }
            ChainError::TableOrder { entry, from_hu } => {
                let key = format!("{MATERIALS_KEY}[{entry}].from_hu");
                let why = "must be a finite number above from_hu of the material before";
                file.bad_key(&key, &format!("{from_hu:?}"), why)
            }
            other => file.bad_key(MATERIALS_KEY, &value, &other.to_string()),
        })?;
        let (lowest, air) = (table.lowest_hu(), tissue.air_below_hu);
        if lowest > air {
            let why = format!(
                "the first material begins at {lowest} HU; it must begin where tissue does or below \
                 (tissue.air_below_hu = {air})"
            );
            return Err(file.bad_key(MATERIALS_KEY, &value, &why));
        }
        Ok(table)
    }
}

impl From<&ChainMaterialSection> for Material {
    fn from(section: &ChainMaterialSection) -> Self {
        let ChainMaterialSection { shortest, longest, shear, k_steps, from_hu: _ } = *section;
        Self { shortest: shortest.values(), longest: longest.values(), shear: shear.values(), k: k_steps }
    }
}
