//! What can go wrong between a scene file and a run folder, and whose fault it is.

use std::path::PathBuf;

use cutis_chainmail::ChainError;
use cutis_coloring::ColoringError;
use cutis_constraints::MaterialError;
#[cfg(feature = "gpu")]
use cutis_gpu::GpuError;
use cutis_mesh::MeshError;
use cutis_render::RenderError;
use cutis_resample::ResampleError;
use cutis_solver::SolverError;
use cutis_solver_cpu::CpuError;
use cutis_volume::VolumeError;

/// An error of the pipeline.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene file cannot be read.
    #[error("{}: cannot read the scene: {why}", file.display())]
    SceneFile {
        /// The scene file.
        file: PathBuf,
        /// What the system said.
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
        /// The value found, as text; empty if there is none to show.
        value: String,
        /// What would be right.
        why: String,
    },
    /// A section of the scene is well formed, but what it asks for cannot be done.
    #[error("{}: `{section}`: {source}", file.display())]
    SceneSection {
        /// The scene file.
        file: PathBuf,
        /// Dotted name of the section.
        section: String,
        /// What stands against it.
        source: Box<Error>,
    },
    /// A request from the command line or a caller that cannot be met.
    #[error("{what}: {why}")]
    Request {
        /// The request.
        what: String,
        /// What would be right.
        why: String,
    },
    /// The scene names a backend that this build does not have, or an adapter that this machine does not have.
    #[error("backend `{backend}`: {why}")]
    Backend {
        /// The backend asked for.
        backend: String,
        /// What would be right.
        why: String,
    },
    /// A volume, its file or a table.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// Lattice, skin or incision.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A material parameter.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// Grouping of constraints.
    #[error(transparent)]
    Coloring(#[from] ColoringError),
    /// System or time stepping.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// The CPU backend.
    #[error(transparent)]
    Cpu(#[from] CpuError),
    /// A chain, or what is asked of it.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// A GPU that is there could not be opened, or did not take the body.
    #[cfg(feature = "gpu")]
    #[error("{0}; the backend \"cpu\" does without")]
    Gpu(#[from] GpuError),
    /// The device of the backend failed during a run.
    #[error(
        "frame {frame}: {source}; {}",
        match saved {
            Some((frame, path)) => format!(
                "{} holds frame {frame}: go on with --resume, without a GPU with --backend cpu", path.display()
            ),
            None => "there is no checkpoint to go on from (run.checkpoint_every)".into(),
        }
    )]
    Stopped {
        /// The frame that it happened in, counted from 1.
        frame: u32,
        /// The last checkpoint of this run, and the frame that it holds.
        saved: Option<(u32, PathBuf)>,
        /// What happened, with the time of the last state that was read.
        source: SolverError,
    },
    /// No setting of a scene does what is asked of it.
    #[error("no setting meets the demand ({demand}): {nearest}; no scene was written")]
    NoSetting {
        /// What was asked for.
        demand: String,
        /// How near the settings came.
        nearest: String,
    },
    /// Resampling.
    #[error(transparent)]
    Resample(#[from] ResampleError),
    /// Pictures.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A file of the run folder.
    #[error("{}: cannot {action}: {why}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        why: String,
    },
    /// A checkpoint that does not belong to this scene or is damaged.
    #[error("{}: not a checkpoint of this scene: {why}", path.display())]
    Checkpoint {
        /// The checkpoint file.
        path: PathBuf,
        /// What does not fit.
        why: String,
    },
}

impl Error {
    /// True if the input or the request is at fault (exit code 2), false if the run itself failed (exit code 1).
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::SceneFile { .. }
            | Self::SceneSyntax { .. }
            | Self::SceneKey { .. }
            | Self::Request { .. }
            | Self::Backend { .. }
            | Self::Checkpoint { .. }
            | Self::Material(_)
            | Self::Chain(_)
            | Self::Coloring(_) => true,
            Self::SceneSection { source, .. } => source.is_bad_input(),
            Self::Volume(e) | Self::Mesh(MeshError::Volume(e)) => {
                !matches!(e, VolumeError::Io { action: "write" | "create", .. })
            }
            Self::Mesh(e) => !matches!(e, MeshError::Write { .. }),
            Self::Solver(e) => !matches!(e, SolverError::NotFinite { .. } | SolverError::Device { .. }),
            Self::Cpu(e) => !matches!(e, CpuError::ThreadPool { .. }),
            Self::File { action, .. } => *action == "read",
            // What was asked of the device does not fit it; all else is the device's or the program's fault.
            #[cfg(feature = "gpu")]
            Self::Gpu(e) => matches!(
                e,
                GpuError::NoAdapter
                    | GpuError::NoSuchAdapter { .. }
                    | GpuError::Device { .. }
                    | GpuError::Limit { .. }
                    | GpuError::OutOfMemory { .. }
            ),
            Self::Resample(_) | Self::Render(_) | Self::Stopped { .. } | Self::NoSetting { .. } => false,
        }
    }
}
