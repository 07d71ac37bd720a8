//! Tests of the outputs that users look at: pictures, meshes, tables and reports of a run. They are
//! compared with a body whose landmarks are known in millimeters. The tests read the files without
//! the product's own readers.

mod body;
mod deformed;
mod effects;
mod frames;
mod image;
mod looks;
mod meshes;
mod nifti;
mod page;
mod pictures;
mod report;
mod tension;
mod view;
pub mod vtu;
