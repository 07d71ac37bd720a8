//! The CT of a scene: read from a NIfTI file or made by the phantom. The first stage of a run.

mod inspect;
pub(crate) mod source;

pub use inspect::{Inspection, inspect};
