//! NIfTI files. Reads NIfTI-1 and NIfTI-2, writes NIfTI-1 with int16 voxels.

mod encode;
mod header;
mod placement;
mod read;
mod write;

pub(crate) use read::read_files;
pub use read::{read, read_observed};
pub use write::{Writer, write};
