//! Tetrahedral lattices of CT volumes: meshes of tissue, skin detection, incisions, wound gape and
//! mesh files.
//!
//! Mesh coordinates are local meters in 32 bits. A [`Frame`] maps them to world millimeters. Names
//! of values in millimeters end in `_mm`.
#![forbid(unsafe_code)]

mod below_skin;
mod build;
mod cells;
mod component;
mod copies;
mod edges;
mod error;
mod frame;
mod gape;
mod grading;
mod incision;
mod lattice;
mod mass;
mod moved;
mod neighbors;
mod path;
mod piece;
mod pocket;
mod pvd;
mod select;
pub mod sever;
mod shell;
pub mod skin;
mod skin_surface;
mod slit;
mod stencil;
mod stitch;
mod surface;
mod surface_files;
mod tissue_mask;
mod tissue_tets;
pub mod vtk;

pub use build::{NO_VERTEX, TetMesh, Tissue};
pub use copies::Copies;
pub use error::MeshError;
pub use frame::Frame;
pub use gape::{Gape, WoundGape};
pub use grading::{Grading, Planes};
pub use incision::{Cut, Incision, Removed};
pub use lattice::{Lattice, Split};
pub use piece::{Excision, Piece};
pub use pocket::{Pocket, Undermining};
pub use pvd::write_pvd;
pub use select::HalfSpace;
pub use shell::Shell;
pub use skin::{Skin, SkinMode, SkinOptions, SkinReport};
pub use slit::Slit;
pub use stitch::{Stitch, Stitching};
pub use surface::Topology;
pub use surface_files::{Surface, write_ply, write_stl};
pub use tissue_mask::{InactiveSkin, InactiveTissue, TissueMask};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
