//! The errors of this crate, and whether the input or the run is at fault.

use std::path::PathBuf;

use cutis_chainmail::ChainError;
use cutis_coloring::ColoringError;
use cutis_constraints::MaterialError;
#[cfg(feature = "gpu")]
use cutis_gpu::GpuError;
use cutis_mesh::MeshError;
use cutis_render::RenderError;
use cutis_resample::ResampleError;
use cutis_rest::RestError;
use cutis_skin::SkinError;
use cutis_solver::SolverError;
use cutis_solver_cpu::CpuError;
use cutis_volume::VolumeError;

use crate::NoSkin;

/// An error of the pipeline.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene file cannot be read.
    #[error("{}: cannot read the scene: {why}", file.display())]
    SceneFile {
        /// The scene file.
        file: PathBuf,
        /// The message of the system.
        why: String,
    },
    /// The scene file is not TOML.
    #[error("{}: not valid TOML: {why}", file.display())]
    SceneSyntax {
        /// The scene file.
        file: PathBuf,
        /// Line, column and reason.
        why: String,
    },
    /// A key of the scene is unknown or its value cannot be used.
    #[error("{}: key `{key}`{}: {why}", file.display(), if value.is_empty() { String::new() } else { format!(" = {value}") })]
    SceneKey {
        /// The scene file.
        file: PathBuf,
        /// Dotted key.
        key: String,
        /// The value that was found, as text; empty if there is none to show.
        value: String,
        /// The valid values.
        why: String,
    },
    /// A section of the scene is well formed, but asks for something that cannot be done.
    #[error("{}: `{section}`: {source}", file.display())]
    SceneSection {
        /// The scene file.
        file: PathBuf,
        /// Dotted name of the section.
        section: String,
        /// The reason.
        source: Box<Error>,
    },
    /// A study file cannot be read.
    #[error("{}: cannot read the study: {why}", file.display())]
    StudyFile {
        /// The study file.
        file: PathBuf,
        /// The message of the system, or line, column and reason.
        why: String,
    },
    /// A key of a study is unknown or its value cannot be used.
    #[error("{}: key `{key}`{}: {why}", file.display(), if value.is_empty() { String::new() } else { format!(" = {value}") })]
    StudyKey {
        /// The study file.
        file: PathBuf,
        /// Dotted key.
        key: String,
        /// The value that was found, as text; empty if there is none to show.
        value: String,
        /// The valid values.
        why: String,
    },
    /// The scene of a case of a study is not valid.
    #[error("{}: case `{case}`: {source}", file.display())]
    StudyCase {
        /// The study file.
        file: PathBuf,
        /// Name of the case.
        case: String,
        /// The reason.
        source: Box<Error>,
    },
    /// A request from the command line or a caller that cannot be met.
    #[error("{what}: {why}")]
    Request {
        /// The request.
        what: String,
        /// The valid requests, or the reason for the refusal.
        why: String,
    },
    /// The scene names a backend that this build lacks, or an adapter that this machine lacks.
    #[error("backend `{backend}`: {why}")]
    Backend {
        /// The backend that the scene names.
        backend: String,
        /// The reason, and what to use instead.
        why: String,
    },
    /// A CT has no skin.
    #[error("{}: there is no skin: {why}", ct.display())]
    NoSkin {
        /// The CT.
        ct: PathBuf,
        /// The reason, and what to change.
        why: NoSkin,
    },
    /// An error of a volume, its file or a table.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// An error of the lattice, the skin or an incision.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// An error of a material parameter.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// An error of the skin's normals and directions, or of a file of strokes.
    #[error(transparent)]
    Skin(#[from] SkinError),
    /// An error of the grouping of constraints.
    #[error(transparent)]
    Coloring(#[from] ColoringError),
    /// An error of the system or of time stepping.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// The body has no state of rest, or none was found.
    #[error("run.until = \"rest\": {0}")]
    Rest(#[source] RestError),
    /// An error of the CPU backend.
    #[error(transparent)]
    Cpu(#[from] CpuError),
    /// An error of the ChainMail model.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// A GPU could not be opened, or has too little memory for the body.
    #[cfg(feature = "gpu")]
    #[error("{0}; the backend \"cpu\" needs no GPU")]
    Gpu(#[from] GpuError),
    /// The user asked for the end of a run, and its state was saved.
    #[error("interrupted after frame {frame}; {} holds this state: continue with --resume", checkpoint.display())]
    Interrupted {
        /// The last frame that was computed.
        frame: u32,
        /// The checkpoint.
        checkpoint: PathBuf,
    },
    /// The device of the backend failed during a run.
    #[error(
        "frame {frame}: {source}; {}",
        match saved {
            Some((frame, path)) => format!(
                "{} holds frame {frame}: continue with --resume, and with --backend cpu to use no GPU",
                path.display()
            ),
            None => "there is no checkpoint to resume from (run.checkpoint_every)".into(),
        }
    )]
    Stopped {
        /// The frame in which it happened, counted from 1.
        frame: u32,
        /// The frame and the path of the last checkpoint of this run.
        saved: Option<(u32, PathBuf)>,
        /// The error, with the time of the last state that was read.
        source: SolverError,
    },
    /// No setting of a scene meets the target.
    #[error("no setting meets the target ({demand}): {nearest}; no scene was written")]
    NoSetting {
        /// The demand.
        demand: String,
        /// The best value of the measured settings.
        nearest: String,
    },
    /// An error of resampling.
    #[error(transparent)]
    Resample(#[from] ResampleError),
    /// An error of a picture.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A file of the run folder cannot be read or written.
    #[error("{}: cannot {action}: {why}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// The action that failed.
        action: &'static str,
        /// The message of the system.
        why: String,
    },
    /// A checkpoint belongs to another scene or is damaged.
    #[error("{}: no checkpoint of this scene: {why}", path.display())]
    Checkpoint {
        /// The checkpoint file.
        path: PathBuf,
        /// The mismatch or the damage.
        why: String,
    },
}

/// A GPU that fails in a search is an error of the GPU.
impl From<RestError> for Error {
    fn from(error: RestError) -> Self {
        match error {
            #[cfg(feature = "gpu")]
            RestError::Gpu(error) => Self::Gpu(error),
            other => Self::Rest(other),
        }
    }
}

impl Error {
    /// Exit code of a program that ends with this error: 2 if the input or the request is at fault,
    /// 1 if the run itself failed.
    pub fn exit_code(&self) -> u8 {
        if self.is_bad_input() { 2 } else { 1 }
    }

    /// True if the input or the request is at fault, false if the run itself failed.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::SceneFile { .. }
            | Self::SceneSyntax { .. }
            | Self::SceneKey { .. }
            | Self::StudyFile { .. }
            | Self::StudyKey { .. }
            | Self::Request { .. }
            | Self::Backend { .. }
            | Self::Checkpoint { .. }
            | Self::NoSkin { .. }
            | Self::Material(_)
            | Self::Skin(_)
            | Self::Chain(_)
            | Self::Coloring(_) => true,
            Self::SceneSection { source, .. } | Self::StudyCase { source, .. } => source.is_bad_input(),
            Self::Volume(e) | Self::Mesh(MeshError::Volume(e)) => {
                !matches!(e, VolumeError::Io { action: "write" | "create", .. })
            }
            Self::Mesh(e) => !matches!(e, MeshError::Write { .. }),
            Self::Solver(e) => !matches!(e, SolverError::NotFinite { .. } | SolverError::Device { .. }),
            Self::Cpu(e) => !matches!(e, CpuError::ThreadPool { .. }),
            Self::File { action, .. } => *action == "read",
            // In these cases the scene does not fit the GPU. All others are faults of the GPU or
            // the program.
            #[cfg(feature = "gpu")]
            Self::Gpu(e) => matches!(
                e,
                GpuError::NoAdapter
                    | GpuError::NoSuchAdapter { .. }
                    | GpuError::Device { .. }
                    | GpuError::Limit { .. }
                    | GpuError::OutOfMemory { .. }
            ),
            Self::Rest(e) => !matches!(e, RestError::NotAtRest { .. }),
            Self::Resample(_)
            | Self::Render(_)
            | Self::Interrupted { .. }
            | Self::Stopped { .. }
            | Self::NoSetting { .. } => false,
        }
    }
}
