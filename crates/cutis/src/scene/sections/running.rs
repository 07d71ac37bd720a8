//! The sections of a run: time steps, number of frames, outputs.

use cutis_solver::Formulation;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Time stepping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverSection {
    /// Backend of the solver: all CPU cores, the scalar reference solver, a GPU, or the best one
    /// for the size of the scene. A build without the feature `gpu` refuses `"gpu"`.
    pub backend: BackendChoice,
    /// The GPU to use: a part of its name, or its index in `cutis devices`. Left out: the best one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adapter: Option<String>,
    /// `pbd` as in the paper, `xpbd` its compliant form, or `vbd`, vertex block descent. `vbd` has
    /// the materials of `xpbd`, and its state of rest is an equilibrium for any number of substeps.
    /// `xpbd` needs many substeps for stiff skin: with too few, a wound opens too far.
    pub formulation: Formulation,
    /// Duration of a frame, s.
    pub dt_s: f64,
    /// Substeps per frame, 1 or more. Left out: 2 with `vbd`, 10 with `xpbd` and `pbd`.
    pub substeps: u32,
    /// Iterations per substep, 1 or more. Left out: 2 with `vbd`, 1 with `xpbd` and `pbd`.
    pub iterations: u32,
    /// Acceleration, m/s², along R, A, S.
    pub gravity_m_s2: [f64; 3],
    /// Velocities decay as exp(−damping·t), 1/s; 0 or more.
    pub damping_per_s: f64,
    /// Over-relaxation of `vbd`, above 0 and below 2; 1 with the other formulations. About 1.3
    /// helps with several iterations.
    pub relaxation: f64,
    /// Worker threads; 0 uses all cores. The result does not depend on their number.
    pub threads: usize,
}

impl SolverSection {
    /// The substeps and iterations of a scene that names only this formulation. The fit is that of
    /// the wounds in `docs/results/accuracy.md`.
    pub(in crate::scene) const fn steps_of(formulation: Formulation) -> (u32, u32) {
        match formulation {
            Formulation::Vbd => (2, 2),
            Formulation::Pbd | Formulation::Xpbd => (10, 1),
        }
    }
}

impl Default for SolverSection {
    fn default() -> Self {
        let formulation = Formulation::Vbd;
        let (substeps, iterations) = Self::steps_of(formulation);
        Self {
            backend: BackendChoice::default(),
            adapter: None,
            formulation,
            dt_s: 1.0 / 60.0,
            substeps,
            iterations,
            gravity_m_s2: [0.0; 3],
            damping_per_s: 10.0,
            relaxation: 1.0,
            threads: 0,
        }
    }
}

/// The backend of the solver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BackendChoice {
    /// The best backend for the scene on this machine; the report names it and says why.
    #[default]
    Auto,
    /// All CPU cores.
    Cpu,
    /// The scalar reference solver, one thread.
    Reference,
    /// A GPU.
    Gpu,
}

/// Where a run ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RunEnd {
    /// After the frames.
    #[default]
    Frames,
    /// In the state of rest after the frames, and after all that is done to the body later.
    Rest,
}

/// How long to run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RunSection {
    /// Number of frames.
    pub frames: u32,
    /// Where the run ends: `frames` after the frames, or `rest` in the state of rest that the body
    /// would reach after them. The state of rest is computed without the motion to it. What is to
    /// be done to the body later than the frames is done one after the other, each from the state
    /// of rest before it to the next one.
    pub until: RunEnd,
    /// Largest error of the state of rest: its distance from the true one over the displacement, as
    /// the search for it estimates both. The search also ends where the forces cancel to single
    /// precision.
    pub error: f64,
    /// Frames between checkpoints, from which `--resume` continues; 0 writes none. Any other number
    /// also keeps each state of rest.
    pub checkpoint_every: u32,
}

impl Default for RunSection {
    fn default() -> Self {
        Self { frames: 60, until: RunEnd::default(), error: 1e-3, checkpoint_every: 0 }
    }
}

/// The files to write. In a scene with this section, an output that the section does not name is
/// neither computed nor written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OutputSection {
    /// `deformed.nii.gz`: the deformed CT.
    #[serde(default)]
    pub volume: bool,
    /// `skin.vtu`: the deformed skin. With `constraints.membrane` also its normals, lines and
    /// tension in the scan.
    #[serde(default)]
    pub surface: bool,
    /// `skin.pvd` and the folder `skin-series`: the skin before the first frame, after every so
    /// many frames, after the last one and in each state of rest, as a time series for ParaView; 0
    /// writes none. A state of rest has no time: the list gives it that of a frame more.
    #[serde(default)]
    pub series_every: u32,
    /// `skin.ply`: the deformed skin without data, LPS, mm.
    #[serde(default)]
    pub ply: bool,
    /// `skin.stl`: the same as STL.
    #[serde(default)]
    pub stl: bool,
    /// `tissue.vtu`: the deformed tetrahedra.
    #[serde(default)]
    pub tissue: bool,
    /// `displacement.nrrd`: for each voxel of the deformed CT the way to its place at rest, as ITK
    /// and 3D Slicer resample with it, and `displacement-coverage.nrrd`: where the field is that of
    /// the body (1), where the body has left (2), and everything else (0).
    #[serde(default)]
    pub displacement: bool,
    /// `displacement-forward.nrrd`: for each voxel at rest the way to its place in the deformed
    /// body, for points and models.
    #[serde(default)]
    pub displacement_forward: bool,
    /// `before.png`, `after.png`, `slice.png`. With directions of `constraints.membrane` also
    /// `tension.png`, the lines of tension on the skin.
    #[serde(default)]
    pub pictures: bool,
    /// `report.json`, `report.html`, `frames.csv`.
    #[serde(default)]
    pub report: bool,
}

impl OutputSection {
    /// No output.
    pub const NONE: Self = Self::each(false);
    /// Every output.
    pub const ALL: Self = Self::each(true);

    const fn each(written: bool) -> Self {
        Self {
            volume: written,
            surface: written,
            series_every: written as u32,
            ply: written,
            stl: written,
            tissue: written,
            displacement: written,
            displacement_forward: written,
            pictures: written,
            report: written,
        }
    }
}

impl Default for OutputSection {
    fn default() -> Self {
        Self { volume: true, surface: true, pictures: true, report: true, ..Self::NONE }
    }
}
