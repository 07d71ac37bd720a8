//! From a CT scan to a cut, deformed body: scene files and the whole pipeline.
//!
//! ```no_run
//! use cutis::{RunOptions, Scene, Silent};
//!
//! let loaded = Scene::load("scene.toml".as_ref(), &[])?;
//! let plan = cutis::check(&loaded, &Silent)?;
//! println!("{} tetrahedra, left out: {:?}", plan.sizes.tets, plan.left_out);
//! let report = cutis::run(&loaded, &RunOptions { out: "run".into(), resume: false }, &Silent)?;
//! println!("{:?}", report.wound);
//! # Ok::<(), cutis::Error>(())
//! ```
//!
//! A run goes through the modules of this crate in this order: `scene` (the scene file), `ct` (the
//! volume), `body` (lattice, skin, incisions), `model` (constraints or ChainMail), `backend` (CPU
//! or GPU), `run` (frames) and `output` (files and report). Three more modules use these: `cost`
//! (plans and costs), `tune` (the choice of a setting) and [`sweep`] (many scans and settings).
//! Start reading at `run`.
//!
//! The parts are crates of their own, re-exported here: [`volume`] (CT in and out), [`mesh`]
//! (lattice, skin, incisions), [`constraints`], [`coloring`], [`solver`] and [`solver_cpu`],
//! [`chainmail`], [`resample`] and [`render`]. This crate adds the scene file ([`scene`]), the
//! order of the stages, and the run folder with its [`report::Report`].
#![forbid(unsafe_code)]

mod backend;
mod body;
mod cost;
mod ct;
mod error;
mod model;
mod output;
mod progress;
mod run;
pub mod scene;
pub mod sweep;
pub mod tune;

pub use cutis_chainmail as chainmail;
pub use cutis_coloring as coloring;
pub use cutis_constraints as constraints;
#[cfg(feature = "gpu")]
pub use cutis_gpu as gpu;
pub use cutis_mesh as mesh;
pub use cutis_render as render;
pub use cutis_resample as resample;
pub use cutis_rest as rest;
pub use cutis_solver as solver;
pub use cutis_solver_cpu as solver_cpu;
#[cfg(feature = "gpu")]
pub use cutis_solver_gpu as solver_gpu;
pub use cutis_volume as volume;

pub use backend::{Device, DeviceLimits, Devices, devices};
pub use body::{NoSkin, SkinRequest, find_skin};
pub use cost::{CostPart, CostReport, Plan, check};
pub use ct::{FolderInspection, Inspection, Series, convert, inspect, inspect_folder};
pub use error::Error;
pub use model::{ScanTension, SceneCt, SceneSystem, build_system, build_system_and_ct};
pub use output::{FieldDirection, ResampleInput, ResampleRequest, report, resample_run};
pub use progress::{Progress, Silent};
pub use run::checkpoint::Checkpoint;
pub use run::files::RunFolder;
#[cfg(feature = "gpu")]
pub use run::run_on;
pub use run::{RunOptions, run};
pub use scene::{LoadedScene, Override, Scene, demo};
pub use tune::{TuneOptions, Tuning, tune};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(doctest)]
#[doc = include_str!("../../../docs/book/extending.md")]
struct Extending;
