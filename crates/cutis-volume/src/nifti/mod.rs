//! NIfTI files: NIfTI-1 and NIfTI-2 in, NIfTI-1 int16 out.

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
