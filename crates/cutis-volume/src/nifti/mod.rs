//! NIfTI files. Reads NIfTI-1 and NIfTI-2, writes NIfTI-1 with int16 voxels.

mod encode;
mod header;
mod placement;
mod read;
mod write;

pub use read::{read, read_observed};
pub(crate) use read::{read_files, with_open};
pub(crate) use write::write_voxels;
pub use write::{Writer, write};
