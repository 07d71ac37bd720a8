//! CT volumes: NIfTI files, geometry, Hounsfield-unit tables, sampling at lattice points, and a
//! synthetic phantom.
#![doc = ""]
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod affine;
mod error;
mod grid;
mod loaded;
pub mod nifti;
mod partial_file;
pub mod phantom;
pub mod sample;
mod table;
mod volume;
mod voxels;

pub use affine::Affine;
pub use error::VolumeError;
pub use grid::Grid;
pub use loaded::{HuStats, Loaded};
pub use partial_file::PartialFile;
pub use table::{Table, TableKind};
pub use volume::{AIR_HU, Volume};
