//! CT volumes: their files, geometry, Hounsfield-unit tables, sampling at lattice points, and a
//! synthetic phantom.
#![doc = ""]
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod affine;
#[cfg(feature = "dicom")]
pub mod dicom;
mod error;
mod grid;
mod gzip_members;
mod labels;
mod loaded;
pub mod metaimage;
pub mod nifti;
pub mod nrrd;
mod partial_file;
pub mod phantom;
mod read;
mod regrid;
pub mod sample;
mod table;
mod volume;
mod voxels;
mod write;

pub use affine::Affine;
pub use error::VolumeError;
pub use grid::Grid;
pub use labels::LabelMap;
pub use loaded::{HuStats, Loaded};
pub use partial_file::PartialFile;
pub use read::{ReadOptions, read, read_observed};
pub use regrid::to_perpendicular_axes;
pub use table::{Table, TableKind};
pub use volume::{AIR_HU, Volume};
pub use write::{Format, write};
