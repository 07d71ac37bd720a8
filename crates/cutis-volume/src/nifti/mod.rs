//! NIfTI files: NIfTI-1 and NIfTI-2 in, NIfTI-1 int16 out.

mod encode;
mod gzip;
mod write;

pub use write::{Writer, write};
