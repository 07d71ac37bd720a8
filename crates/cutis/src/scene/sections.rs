//! The sections of a scene file, each with its defaults.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Deformation model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// Position-based dynamics over a tetrahedral lattice.
    #[default]
    Pbd,
}

/// Where the CT comes from: exactly one of `path` and `phantom`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumeSection {
    /// A NIfTI file (`.nii`, `.nii.gz`, `.hdr`), relative to the scene file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<PathBuf>,
    /// The built-in synthetic torso instead of a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phantom: Option<PhantomSection>,
}

/// The synthetic torso.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhantomSection {
    /// Voxels per axis.
    pub size: [usize; 3],
    /// Anatomy and noise vary with it.
    #[serde(default)]
    pub seed: u64,
}

/// The lattice: at most one of `spacing_mm` and `vertices`; neither puts a vertex on every voxel centre.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LatticeSection {
    /// Distance between neighbouring vertices, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing_mm: Option<f64>,
    /// Vertices per axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertices: Option<[usize; 3]>,
    /// How a cell is split into tetrahedra.
    #[serde(default)]
    pub split: SplitChoice,
}

/// How a lattice cell is split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SplitChoice {
    /// Six tetrahedra around the main diagonal.
    #[default]
    Kuhn6,
    /// Five tetrahedra, mirrored on odd cells.
    Five,
}

/// What is tissue, and what it weighs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TissueSection {
    /// HU below which a vertex is air.
    pub air_below_hu: f32,
    /// Which connected parts are simulated.
    pub keep: Keep,
    /// Half-spaces that are dropped before anything else, for example a scanner table in contact with the body.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cut_planes: Vec<PlaneSection>,
    /// HU → density, kg/m³.
    pub density: TableChoice,
}

impl Default for TissueSection {
    fn default() -> Self {
        Self {
            air_below_hu: -449.0,
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
    /// The largest one: the scanner table and other objects beside the body are left out.
    #[default]
    Largest,
    /// All of them.
    All,
}

/// A piecewise-linear table over HU: the name of a preset, or points `[hu, value]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum TableChoice {
    /// A preset by name.
    Preset(String),
    /// Points `[hu, value]`, HU strictly increasing.
    Points(Vec<[f32; 2]>),
}

/// Which triangles are skin.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkinSection {
    /// Detection rule.
    #[serde(default)]
    pub mode: SkinChoice,
}

/// Skin detection rule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SkinChoice {
    /// The paper's rule, taken literally: every tetrahedron with exactly one air vertex gives a triangle.
    Paper,
    /// All faces between a kept and a dropped tetrahedron.
    Boundary,
    /// Faces that touch the air around the largest body.
    #[default]
    Exterior,
}

/// The constraint kinds of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstraintsSection {
    /// Springs along the lattice edges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance: Option<DistanceSection>,
    /// Volumes of the tetrahedra.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume: Option<VolumeConstraintSection>,
    /// Skin tension over the skin triangles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stc: Option<StcSection>,
}

/// Springs along the lattice edges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistanceSection {
    /// Young's modulus, Pa (`xpbd`).
    pub youngs_modulus_pa: f64,
    /// Share of the error removed per projection, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
}

/// Volumes of the tetrahedra.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumeConstraintSection {
    /// Bulk modulus, Pa (`xpbd`).
    pub bulk_modulus_pa: f64,
    /// Share of the error removed per projection, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
}

/// Skin tension over the skin triangles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StcSection {
    /// Area modulus of the skin, N/m (`xpbd`).
    pub area_modulus_n_per_m: f64,
    /// Share of the error removed per projection, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
    /// Tensile amplification β of the restoring force.
    #[serde(default = "default_amplification")]
    pub amplification: f64,
    /// Rest area over area in the scan; below 1 the skin is under tension.
    #[serde(default = "default_rest_area_scale")]
    pub rest_area_scale: f64,
    /// Formula.
    #[serde(default)]
    pub form: StcForm,
    /// HU → factor on the modulus (on the stiffness in `pbd`), at the mean HU of a triangle's vertices.
    #[serde(default = "uniform")]
    pub stiffness_table: TableChoice,
    /// Other values near the incisions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near_incision: Option<NearIncisionSection>,
}

/// Formula of the skin tension constraint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StcForm {
    /// Derived from an energy; stable for any amplification.
    #[default]
    Energy,
    /// The paper's update with the right gradient, clamped; `pbd` only.
    Paper,
}

/// Skin parameters near an incision, blended linearly to the general ones at `radius_mm`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NearIncisionSection {
    /// Distance from the segment at which the general values hold, mm.
    pub radius_mm: f64,
    /// Factor on the rest area at the segment.
    #[serde(default = "one")]
    pub rest_area_factor: f64,
    /// Factor on the modulus (stiffness) at the segment.
    #[serde(default = "one")]
    pub stiffness_factor: f64,
}

/// What does not move.
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
    pub planes: Vec<PlaneSection>,
    /// Vertices in the first and last layer of the lattice along these axes (`"i"`, `"j"`, `"k"`), where the scan ends.
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
    /// 0, 1 or 2.
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

/// A half-space: the side of the plane to which the normal points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneSection {
    /// A point of the plane, mm.
    pub point_mm: [f64; 3],
    /// Direction of the half-space; any length but zero.
    pub normal: [f64; 3],
}

/// A static incision: the paper's, with a mid-surface that always parts the lips.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IncisionSection {
    /// One end, on or near the skin, mm.
    pub from_mm: [f64; 3],
    /// The other end, mm.
    pub to_mm: [f64; 3],
    /// Depth below the skin, mm.
    pub depth_mm: f64,
    /// Width of the removed strip, mm.
    pub width_mm: f64,
}

/// Tissue that is dragged along a straight line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HandleSection {
    /// Centre of the sphere that is grabbed, mm.
    pub at_mm: [f64; 3],
    /// Radius of the sphere, mm.
    pub radius_mm: f64,
    /// Where it ends up, relative to where it was, mm.
    pub move_mm: [f64; 3],
    /// Duration of the movement, s.
    #[serde(default = "one")]
    pub over_s: f64,
}

/// Time stepping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverSection {
    /// Where it runs.
    pub backend: BackendChoice,
    /// Position-based dynamics as in the paper, or its compliant form.
    pub formulation: FormulationChoice,
    /// Duration of a frame, s.
    pub dt_s: f64,
    /// Substeps per frame.
    pub substeps: u32,
    /// Iterations per substep.
    pub iterations: u32,
    /// Acceleration, m/s², along R, A, S.
    pub gravity_m_s2: [f64; 3],
    /// Velocities decay as exp(−damping·t), 1/s.
    pub damping_per_s: f64,
    /// Worker threads; 0 takes all cores. The result does not depend on it.
    pub threads: usize,
}

impl Default for SolverSection {
    fn default() -> Self {
        Self {
            backend: BackendChoice::default(),
            formulation: FormulationChoice::default(),
            dt_s: 1.0 / 60.0,
            substeps: 10,
            iterations: 1,
            gravity_m_s2: [0.0; 3],
            damping_per_s: 10.0,
            threads: 0,
        }
    }
}

/// Where the solver runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BackendChoice {
    /// The best one that this build and machine have; the report says which and why.
    #[default]
    Auto,
    /// All CPU cores.
    Cpu,
    /// The scalar reference solver, one thread.
    Reference,
    /// A GPU. Not part of this build: refused.
    Gpu,
}

/// Formulation of the projection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FormulationChoice {
    /// Stiffness per iteration, as in the paper.
    Pbd,
    /// Compliance in physical units.
    #[default]
    Xpbd,
}

/// How long to run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RunSection {
    /// Number of frames.
    pub frames: u32,
    /// Frames between checkpoints, from which `--resume` goes on; 0 writes none.
    pub checkpoint_every: u32,
}

impl Default for RunSection {
    fn default() -> Self {
        Self { frames: 60, checkpoint_every: 0 }
    }
}

/// What to write. In a scene that has this section, what it does not name is neither computed nor written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutputSection {
    /// `deformed.nii.gz`: the CT, carried along by the body.
    #[serde(default)]
    pub volume: bool,
    /// `skin.vtu`: the deformed skin.
    #[serde(default)]
    pub surface: bool,
    /// `tissue.vtu`: the deformed tetrahedra.
    #[serde(default)]
    pub tissue: bool,
    /// `before.png`, `after.png`, `slice.png`.
    #[serde(default)]
    pub pictures: bool,
    /// `report.json`, `report.html`, `frames.csv`.
    #[serde(default)]
    pub report: bool,
}

impl Default for OutputSection {
    fn default() -> Self {
        Self { volume: true, surface: true, tissue: false, pictures: true, report: true }
    }
}

fn one() -> f64 {
    1.0
}

fn default_amplification() -> f64 {
    2.0
}

fn default_rest_area_scale() -> f64 {
    0.9
}

fn uniform() -> TableChoice {
    TableChoice::Preset("uniform".into())
}
