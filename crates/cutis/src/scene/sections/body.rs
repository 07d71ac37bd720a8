//! The sections of the body: the CT, the lattice over it, tissue and skin.

use std::path::PathBuf;

use cutis_mesh::{HalfSpace, SkinMode, Split};
use cutis_volume::ReadOptions;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use super::region::RegionSection;
use crate::body::AIR_BELOW_HU;
use crate::scene::choice::OneOr;

/// The CT: exactly one of `path` and `phantom`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumeSection {
    /// A NIfTI file (`.nii`, `.nii.gz`, `.hdr`), an NRRD file (`.nrrd`, `.nhdr`), a MetaImage
    /// (`.mha`, `.mhd`), or a DICOM series: its folder, or one of its files. Relative to the scene
    /// file, and in `--set` to the present folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<PathBuf>,
    /// Number of the DICOM series to read, if the folder has several. `cutis inspect FOLDER` lists
    /// them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub series: Option<u32>,
    /// Resample slices that are tilted (gantry tilt) or unevenly spaced to a regular grid with
    /// perpendicular axes. Without it such a scan is refused, or read with a warning that its
    /// deformed volume cannot be written.
    #[serde(default, skip_serializing_if = "is_false")]
    pub resample: bool,
    /// HU that are added to every value of the file, for a CT that was stored with an offset and
    /// without an intercept. If air is 0 in the file, it is -1024.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub offset_hu: f32,
    /// The built-in synthetic torso, used instead of a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phantom: Option<PhantomSection>,
}

impl VolumeSection {
    /// How to read the file.
    pub(crate) fn options(&self) -> ReadOptions {
        ReadOptions { series: self.series, resample: self.resample }
    }
}

fn is_false(value: &bool) -> bool {
    !value
}

fn is_zero(hu: &f32) -> bool {
    *hu == 0.0
}

/// The synthetic torso.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhantomSection {
    /// Voxels per axis, 1 to 4096.
    pub size: [usize; 3],
    /// Seed of the random anatomy and noise.
    #[serde(default)]
    pub seed: u64,
    /// Angles by which the person lies turned in the scanner, degrees: about the x axis first, then
    /// about y, then about z, through the middle of the scan. The table turns with the person.
    #[serde(default)]
    pub turn_deg: [f64; 3],
}

/// The lattice: at most one of `spacing_mm` and `vertices`; neither puts a vertex on every voxel
/// center.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LatticeSection {
    /// Distance between neighboring vertices, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing_mm: Option<f64>,
    /// Vertices per axis, at least 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertices: Option<[usize; 3]>,
    /// How a cell is split into tetrahedra.
    #[serde(default)]
    pub split: Split,
    /// The part of the body that is simulated: `"whole"`, `around_mm`, or a box. Tissue outside it
    /// does not move and takes neither time nor memory of the solver. Skin and largest part are
    /// found on the whole body first. Left out: about 105 mm around the incisions if the scan is
    /// at rest, nothing else acts but sutures, and the scene has the presets of `materials` and
    /// `constraints.membrane` and no `grading`. In other scenes the whole body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<RegionSection>,
    /// A fine zone, `around_mm` or a box, in which the lattice has the spacing that it would have
    /// without this section. Outside it the distance between planes of vertices grows along each
    /// axis. Left out: all cells have the same size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grading: Option<GradingSection>,
}

/// A fine zone, `around_mm` or a box, and the growth of the lattice steps outside it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GradingSection {
    /// The fine zone is the box, along the axes of the lattice, around everything within this
    /// distance of an incision (straight down to its depth) or a handle, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub around_mm: Option<f64>,
    /// Lowest corner of the box, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_mm: Option<[f64; 3]>,
    /// Highest corner of the box, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_mm: Option<[f64; 3]>,
    /// Largest ratio of neighboring steps along an axis: above 1, at most 2.
    #[serde(default = "GradingSection::default_growth")]
    pub growth: f64,
    /// Longest step, in steps of the fine zone: above 1, at most 8.
    #[serde(default = "GradingSection::default_coarsest")]
    pub coarsest: f64,
}

impl GradingSection {
    /// A fine zone within this distance of the action, mm, with the default growth.
    pub(crate) fn around(mm: f64) -> Self {
        Self {
            around_mm: Some(mm),
            min_mm: None,
            max_mm: None,
            growth: Self::default_growth(),
            coarsest: Self::default_coarsest(),
        }
    }

    fn default_growth() -> f64 {
        1.5
    }

    fn default_coarsest() -> f64 {
        4.0
    }
}

/// A zone that a scene names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Zone {
    /// Within this distance of an incision or a handle, mm.
    Around(f64),
    /// A box, mm.
    Box([f64; 3], [f64; 3]),
}

impl Zone {
    /// The zone, if exactly one of the two is given.
    pub(crate) fn of(
        around_mm: Option<f64>,
        min_mm: Option<[f64; 3]>,
        max_mm: Option<[f64; 3]>,
    ) -> Option<Self> {
        match (around_mm, min_mm, max_mm) {
            (Some(around), None, None) => Some(Self::Around(around)),
            (None, Some(min), Some(max)) => Some(Self::Box(min, max)),
            _ => None,
        }
    }
}

impl GradingSection {
    pub(crate) fn zone(&self) -> Option<Zone> {
        Zone::of(self.around_mm, self.min_mm, self.max_mm)
    }
}

/// Which voxels are tissue, and their density.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TissueSection {
    /// HU below which a vertex is air.
    pub air_below_hu: f32,
    /// Which connected parts are simulated.
    pub keep: Keep,
    /// Half-spaces that are removed first, for example a scanner table in contact with the body.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cut_planes: Vec<HalfSpace>,
    /// HU → density, kg/m³: preset `schneider2000` or `water`, or points.
    pub density: TableChoice,
}

impl Default for TissueSection {
    fn default() -> Self {
        Self {
            air_below_hu: AIR_BELOW_HU,
            keep: Keep::default(),
            cut_planes: Vec::new(),
            density: TableChoice::Preset("schneider2000".into()),
        }
    }
}

/// Which connected parts of the tissue are simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Keep {
    /// The largest part: the scanner table and other objects next to the body are left out.
    #[default]
    Largest,
    /// All parts.
    All,
}

/// A piecewise-linear table over HU: the name of a preset, or points `[hu, value]`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum TableChoice {
    /// The name of a preset.
    Preset(String),
    /// Points `[hu, value]`, HU strictly increasing.
    Points(Vec<[f32; 2]>),
}

impl<'de> Deserialize<'de> for TableChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match OneOr::deserialize(deserializer)? {
            OneOr::One(name) => Self::Preset(name),
            OneOr::List(points) => Self::Points(points),
        })
    }
}

/// Which triangles are skin, and where their vertices are.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkinSection {
    /// Rule by which skin triangles are chosen: the outer skin of the body, all faces between
    /// tissue and the rest, or the paper's rule, taken literally.
    #[serde(default)]
    pub mode: SkinMode,
    /// Whether the vertices of the skin move onto a smooth surface, half a lattice step below the
    /// skin of the CT. If not, the skin is a staircase of lattice facets, and its tension depends
    /// on how the patient lies on the lattice. Left out: true for `constraints.membrane`, false
    /// otherwise. ChainMail needs a regular lattice and refuses it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub smooth: Option<bool>,
}
