//! What users look at: pictures, meshes, tables and reports of a run, checked against a body whose
//! landmarks are known in millimeters. The files are read here without the product's own readers.

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
mod vtu;
