//! From the CT to the body at rest: lattice, tissue, skin, incisions and the region of interest.

mod build;
mod find_skin;
pub(crate) mod region;

pub(crate) use build::{Body, needs_skin};
pub use find_skin::{SkinRequest, find_skin};
