//! The CT of a scene: read from its files or made by the phantom. The first stage of a run.

mod convert;
mod inspect;
pub(crate) mod source;

pub use convert::convert;
pub use inspect::{FolderInspection, Inspection, Series, inspect, inspect_folder};
