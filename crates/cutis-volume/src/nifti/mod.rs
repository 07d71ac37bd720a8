//! NIfTI files. Reads NIfTI-1 and NIfTI-2, writes NIfTI-1 with int16 voxels.

mod convert;
mod encode;
mod gzip;
mod header;
mod placement;
mod read;
mod source;
mod write;

pub use read::{HuStats, Loaded, read, read_observed};
pub use write::{Writer, write};
